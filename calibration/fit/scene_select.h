// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "fit/scene_measurement_fit.h"

namespace truebox {

/// One model of the same readings, and what speaks for it.
struct ModelCandidate {
  std::string name;
  Outcome outcome = Outcome::not_run;
  std::size_t parameters = 0;
  double chi2 = 0.0;  ///< of fitted readings and priors
  /// chi2 / s + 2 k + 2 k (k + 1) / (n - k - 1) and chi2 / s + k ln n, n the effective number of
  /// readings. s is the chi2/nu of the richest model where chance does not explain it: what no
  /// candidate can describe must not speak for parameters. Sources: Hurvich & Tsai (1989); Schwarz
  /// (1978); the scale: Burnham & Anderson (2002), 2.5.
  double aicc = 0.0, bic = 0.0;
  double held_out_rms = 0.0;   ///< relative
  double held_out_chi2 = 0.0;  ///< a reading, each with its full u
  bool chosen = false;
  std::string why;  ///< what speaks against it
};

/// Fits each model to the same readings and holds it against those held out, from the simplest to
/// the richest: direct light or interreflection, without or with gloss of the materials for which
/// the model knows a lobe, one reflectance for all bands or one a band. The first one is chosen
/// whose BIC is within 10 of the lowest and whose held-out rms is within 5 % of the lowest. Without
/// readings held out BIC alone decides.
std::vector<ModelCandidate> select_model(const SceneFitProblem& problem,
                                         const std::vector<std::vector<BlockReading>>& held_out,
                                         const SceneFitOptions& options);

std::string describe(const std::vector<ModelCandidate>& candidates);

}  // namespace truebox
