// SPDX-License-Identifier: BSD-3-Clause
// The least-squares problem of a scene fit. Internal to this folder's sources.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit/joint_whitening.h"
#include "fit/scene_forward.h"

namespace truebox {

/// Readings with their joint covariance, priors below them: rows of unit variance.
class WhitenedProblem {
 public:
  using Index = Eigen::Index;

  /// The problem must outlive it.
  explicit WhitenedProblem(const SceneFitProblem& problem);

  const SceneForward& forward() const { return forward_; }
  Index rows() const { return readings() + static_cast<Index>(forward_.priors().size()); }
  Index readings() const { return value_.size(); }
  const Eigen::VectorXd& value() const { return value_; }
  const Eigen::VectorXd& weight() const { return weight_; }
  const std::vector<CommonMode>& regions() const { return regions_; }
  /// u of each reading alone, as the robust loss weighs it.
  Eigen::VectorXd sigma() const { return own_.cwiseQuotient(weight_.cwiseSqrt()); }
  /// u of each reading, what its region shares included.
  Eigen::VectorXd total() const {
    return (own_.array().square() + common_.array().square()).sqrt();
  }

  /// Huber's weights at the residuals; true if they still change by more than 1 %.
  bool reweight(const Eigen::VectorXd& predicted, double robust_sigma);

  /// Residuals (model less reading, then priors) and their derivatives; both may be asked for
  /// without the other. False if a solve failed.
  bool evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& residual, Eigen::MatrixXd* jacobian,
                Eigen::VectorXd* predicted = nullptr) const;

 private:
  const SceneFitProblem& problem_;
  SceneForward forward_;
  Eigen::VectorXd value_, own_, common_, weight_;
  std::vector<CommonMode> regions_;
};

}  // namespace truebox
