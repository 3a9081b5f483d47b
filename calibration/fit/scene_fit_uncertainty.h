// SPDX-License-Identifier: BSD-3-Clause
// From the Jacobian at the solution to what a scene fit claims. Internal to this folder's sources.
#pragma once

#include "fit/scene_fit.h"
#include "fit/whitened_problem.h"

namespace truebox {

/// Fills parameters, covariance, null directions, budgets, statistics and readings of the fit at x.
void fill_uncertainties(const WhitenedProblem& whitened, const Eigen::VectorXd& x, SceneFit& fit);

/// Fills the fitted spectra; fit.state, parameters and covariance must be there.
void fill_spectra(const SceneFitProblem& problem, const SceneForward& forward, SceneFit& fit);

}  // namespace truebox
