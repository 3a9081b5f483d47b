// SPDX-License-Identifier: BSD-3-Clause
// The parameters of a scene fit and what the readings would be. Internal to this folder's sources.
#pragma once

#include <string>
#include <vector>

#include "fit/identifiability.h"
#include "fit/scene_fit_problem.h"

namespace truebox {

struct SceneParameter {
  ParameterName name;
  double start = 0.0, low = 0.0, high = 0.0;
  double size = 1.0;  ///< a large change of it
  std::string unit = {};
};

/// A row that ties parameters to what was known before: (sum k_i x_i - value) in units of u.
struct PriorRow {
  std::string source;  ///< "prior of exposures": a line of the budget
  std::vector<std::pair<std::size_t, double>> terms;
  double value = 0.0;
};

/// Readings as a function of the free parameters, with exact derivatives.
class SceneForward {
 public:
  explicit SceneForward(const SceneFitProblem& problem);

  const std::vector<SceneParameter>& parameters() const { return parameters_; }
  const std::vector<PriorRow>& priors() const { return priors_; }
  Eigen::VectorXd start() const;

  /// What the readings would be, in the order of planes and readings; `derivatives` (readings x
  /// parameters) may be null. False if a solve failed.
  bool predict(const Eigen::VectorXd& x, Eigen::VectorXd& readings,
               Eigen::MatrixXd* derivatives) const;

  SceneState state_of(const Eigen::VectorXd& x) const;
  /// d rho of a material (bands) / d its coefficients, and where those are among the parameters;
  /// no columns if it is held.
  struct SpectrumMap {
    Eigen::MatrixXd basis;
    std::size_t first = 0;
  };
  const SpectrumMap& spectrum_of(std::size_t material) const { return spectra_[material]; }

 private:
  std::size_t add(SceneParameter parameter);
  void add_reflectances();
  void add_reflectance_priors(std::size_t material);
  void add_emissions();
  void add_gains();
  void add_response();
  void add_gloss();
  void add_shape();
  void start_gains();
  void differentiate(const BlockRadiosity& b, Eigen::Index block, const Eigen::RowVectorXd& slopes,
                     Eigen::Ref<Eigen::RowVectorXd> row) const;

  const SceneFitProblem& problem_;
  SceneState fixed_;
  std::vector<SceneParameter> parameters_;
  std::vector<PriorRow> priors_;
  std::vector<SpectrumMap> spectra_;                // one a material
  std::vector<std::vector<std::size_t>> emission_;  // lamp -> parameter of each band; none if held
  std::vector<std::optional<std::size_t>> gain_;    // plane -> parameter
  std::vector<std::size_t> gamma_;
  std::vector<std::optional<std::size_t>> gloss_;  // material -> parameter
  std::vector<std::optional<std::size_t>> shape_;  // term -> parameter
  std::optional<ResponseCurve> curve_;
};

}  // namespace truebox
