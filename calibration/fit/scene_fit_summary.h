// SPDX-License-Identifier: BSD-3-Clause
// What a scene fit says in words. Internal to this folder's sources.
#pragma once

#include "fit/identifiability.h"
#include "fit/scene_fit.h"

namespace truebox {

/// The direction of the largest relative uncertainty, in words, with that uncertainty.
std::string weakest_direction(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& size_of,
                              const std::vector<ParameterName>& names);

/// Notes on parameters: not determined, at a bound, no more known than that it lies in [0, 1),
/// correlated with others beyond kNearlyOne, seen by no pixel.
void add_notes(const SceneFitProblem& problem, SceneFit& fit);

/// Above it a correlation is said in words: what the two have in common is hardly known.
inline constexpr double kNearlyOne = 0.99;

}  // namespace truebox
