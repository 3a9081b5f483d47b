// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/refinement.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>

#include "alignment/normal_matrix.h"
#include "alignment/projection.h"

namespace truebox {
namespace {

template <class T>
bool across_edge(const Frame& frame, const EdgeObservation& seen, const T* const* p, T* residual) {
  T px[2];
  if (!project_point(frame.rotation, frame.aspect, frame.offset_m, p[0], p[1], p[2], p[3], px))
    return false;
  residual[0] = (seen.normal[0] * (px[0] - seen.position.x_px) +
                 seen.normal[1] * (px[1] - seen.position.y_px)) /
                seen.u_px;
  return true;
}

template <class T>
bool from_point(const Frame& frame, const PointObservation& seen, const T* const* p, T* residual) {
  T px[2];
  if (!project_point(frame.rotation, frame.aspect, frame.offset_m, p[0], p[1], p[2], p[3], px))
    return false;
  residual[0] = (px[0] - seen.position.x_px) / seen.u_px;
  residual[1] = (px[1] - seen.position.y_px) / seen.u_px;
  return true;
}

struct EdgeCost {
  Frame frame;
  EdgeObservation seen;
  template <class T>
  bool operator()(const T* a, const T* b, const T* c, const T* d, T* residual) const {
    const T* p[] = {a, b, c, d};
    return across_edge(frame, seen, p, residual);
  }
};

struct PointCost {
  Frame frame;
  PointObservation seen;
  template <class T>
  bool operator()(const T* a, const T* b, const T* c, const T* d, T* residual) const {
    const T* p[] = {a, b, c, d};
    return from_point(frame, seen, p, residual);
  }
};

void add_blocks(ceres::Problem& problem, CameraParameters& p, const ParameterFreedom& freedom) {
  for (const Block& block : blocks_of(p)) {
    problem.AddParameterBlock(block.values, block.size);
    std::vector<int> fixed;
    ceres::Matrix weights = ceres::Matrix::Zero(block.size, block.size);
    ceres::Vector known = ceres::Vector::Zero(block.size);
    for (int k = 0; k < block.size; ++k) {
      const auto i = static_cast<std::size_t>(block.first + k);
      if (!freedom.free[i]) fixed.push_back(k);
      known[k] = freedom.prior_value[i];
      if (std::isfinite(freedom.prior_u[i])) weights(k, k) = 1.0 / freedom.prior_u[i];
    }
    if (static_cast<int>(fixed.size()) == block.size) {
      problem.SetParameterBlockConstant(block.values);
      continue;
    }
    if (!fixed.empty())
      problem.SetManifold(block.values, new ceres::SubsetManifold(block.size, fixed));
    problem.AddResidualBlock(new ceres::NormalPrior(weights, known), nullptr, block.values);
  }
}

}  // namespace

std::vector<std::size_t> ParameterFreedom::indices() const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < kCameraParameters; ++i)
    if (free[i]) found.push_back(i);
  return found;
}

Refinement refine(const CameraParameters& start, const Observations& observations,
                  const RefinementOptions& options) {
  Refinement result;
  result.parameters = start;
  CameraParameters& p = result.parameters;
  ceres::Problem problem;
  add_blocks(problem, p, options.freedom);
  const auto loss = [&]() -> ceres::LossFunction* {
    return options.cauchy_width > 0.0 ? new ceres::CauchyLoss(options.cauchy_width) : nullptr;
  };
  for (const EdgeObservation& seen : observations.edges)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EdgeCost, 1, kPose, kIntrinsics, kDistortion, kStretch>(
            new EdgeCost{{p.rotation, p.aspect, seen.point_m - p.centre_m}, seen}),
        loss(), p.pose.data(), p.intrinsics.data(), p.distortion.data(), p.stretch.data());
  for (const PointObservation& seen : observations.points)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PointCost, 2, kPose, kIntrinsics, kDistortion, kStretch>(
            new PointCost{{p.rotation, p.aspect, seen.point_m - p.centre_m}, seen}),
        loss(), p.pose.data(), p.intrinsics.data(), p.distortion.data(), p.stretch.data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-10;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.message = summary.message;
  return result;
}

std::vector<double> edge_residuals_px(const CameraParameters& parameters,
                                      const std::vector<EdgeObservation>& edges) {
  std::vector<double> residuals;
  for (const EdgeObservation& seen : edges) {
    const auto px = projected(parameters, seen.point_m);
    residuals.push_back(px ? seen.normal[0] * (px->x_px - seen.position.x_px) +
                                 seen.normal[1] * (px->y_px - seen.position.y_px)
                           : std::numeric_limits<double>::quiet_NaN());
  }
  return residuals;
}

namespace {

using Jet = ceres::Jet<double, static_cast<int>(kCameraParameters)>;

/// Derivatives of residuals by the free parameters, at one place.
class Derivatives {
 public:
  Derivatives(const CameraParameters& at, const ParameterFreedom& freedom)
      : at_(at), free_(freedom.indices()) {
    CameraParameters copy = at;
    for (const Block& block : blocks_of(copy))
      for (int k = 0; k < block.size; ++k)
        jets_[static_cast<std::size_t>(block.first + k)] = Jet(block.values[k], block.first + k);
  }

  Eigen::Index count() const { return static_cast<Eigen::Index>(free_.size()); }
  const std::vector<std::size_t>& free() const { return free_; }

  /// Of one row; zero behind the camera.
  Eigen::RowVectorXd edge(const EdgeObservation& seen, double* value) const {
    EdgeObservation unweighted = seen;
    unweighted.u_px = 1.0;
    Jet residual;
    if (!across_edge(frame(seen.point_m), unweighted, blocks().data(), &residual))
      residual = Jet(0.0);
    *value = residual.a;
    return row(residual);
  }

  /// Of both coordinates over u; false behind the camera.
  bool point(const PointObservation& seen, Eigen::MatrixXd* rows, Eigen::Vector2d* values) const {
    Jet residual[2];
    if (!from_point(frame(seen.point_m), seen, blocks().data(), residual)) return false;
    rows->resize(2, count());
    for (Eigen::Index k = 0; k < 2; ++k) {
      rows->row(k) = row(residual[k]);
      (*values)[k] = residual[k].a;
    }
    return true;
  }

 private:
  std::array<const Jet*, 4> blocks() const {
    return {jets_.data(), jets_.data() + kPose, jets_.data() + kPose + kIntrinsics,
            jets_.data() + kPose + kIntrinsics + kDistortion};
  }
  Frame frame(const Vec3& point) const { return {at_.rotation, at_.aspect, point - at_.centre_m}; }
  Eigen::RowVectorXd row(const Jet& residual) const {
    Eigen::RowVectorXd j(count());
    for (Eigen::Index k = 0; k < count(); ++k)
      j[k] = residual.v[static_cast<Eigen::Index>(free_[static_cast<std::size_t>(k)])];
    return j;
  }

  const CameraParameters& at_;
  std::vector<std::size_t> free_;
  std::array<Jet, kCameraParameters> jets_;
};

EdgeChain chain_of(const Derivatives& derivatives, const EdgeObservation* first,
                   std::size_t count) {
  EdgeChain chain;
  const auto n = static_cast<Eigen::Index>(count);
  chain.rows.resize(n, derivatives.count());
  for (Eigen::VectorXd* v : {&chain.residual_px, &chain.noise_u_px, &chain.u_px, &chain.gap_px})
    v->setZero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const EdgeObservation& seen = first[i];
    chain.rows.row(i) = derivatives.edge(seen, &chain.residual_px[i]);
    chain.noise_u_px[i] = seen.noise_u_px;
    chain.u_px[i] = seen.u_px;
    if (i > 0)
      chain.gap_px[i] = std::hypot(seen.position.x_px - first[i - 1].position.x_px,
                                   seen.position.y_px - first[i - 1].position.y_px);
  }
  return chain;
}

/// The fit near `parameters`; information and pull of priors and points.
LinearisedFit linearised(const CameraParameters& parameters, const Derivatives& derivatives,
                         const Observations& observations, const ParameterFreedom& freedom) {
  LinearisedFit fit;
  const Eigen::Index n = derivatives.count();
  fit.information = Eigen::MatrixXd::Zero(n, n);
  fit.pull = Eigen::VectorXd::Zero(n);
  const auto values = values_of(parameters);
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::size_t i = derivatives.free()[static_cast<std::size_t>(k)];
    if (!std::isfinite(freedom.prior_u[i])) continue;
    fit.information(k, k) = std::pow(freedom.prior_u[i], -2.0);
    fit.pull[k] = fit.information(k, k) * (values[i] - freedom.prior_value[i]);
  }
  Eigen::MatrixXd rows;
  Eigen::Vector2d residual;
  for (const PointObservation& seen : observations.points) {
    if (!derivatives.point(seen, &rows, &residual)) continue;
    fit.information += rows.transpose() * rows;
    fit.pull += rows.transpose() * residual;
  }
  const auto& edges = observations.edges;
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
    while (last < edges.size() && edges[last].edge == edges[first].edge) ++last;
    fit.edges.push_back(chain_of(derivatives, &edges[first], last - first));
  }
  return fit;
}

}  // namespace

ParameterCovariance parameter_covariance(const CameraParameters& parameters,
                                         const Observations& observations,
                                         const ParameterFreedom& freedom) {
  const Derivatives derivatives(parameters, freedom);
  const LinearisedFit fit = linearised(parameters, derivatives, observations, freedom);
  Eigen::MatrixXd curvature = fit.information;
  for (const EdgeChain& chain : fit.edges) {
    const Eigen::MatrixXd weighted = chain.u_px.cwiseInverse().asDiagonal() * chain.rows;
    curvature += weighted.transpose() * weighted;
  }
  std::vector<std::string> names;
  for (const std::size_t i : derivatives.free()) names.push_back(parameter_names()[i]);
  const NormalInverse inverse = invert_normal_matrix(curvature, names);
  ParameterCovariance result;
  result.condition = inverse.condition;
  if (!inverse.inverse) {
    result.outcome = AlignmentOutcome::rank_deficient;
    result.null_direction = inverse.weakest;
    return result;
  }
  const auto posterior = edge_error_posterior(fit);
  result.errors = mean_errors(posterior);
  Eigen::MatrixXd scatter = fit.information;
  for (const auto& [errors, probability] : posterior)
    scatter += probability * edge_scatter(fit, errors);
  result.covariance = *inverse.inverse * scatter * *inverse.inverse;
  result.outcome = AlignmentOutcome::converged;
  return result;
}

double excess_u_px(const std::vector<double>& residuals_px, const std::vector<double>& u_px,
                   double degrees) {
  const auto chi2 = [&](double x) {
    double sum = 0.0;
    for (std::size_t i = 0; i < residuals_px.size(); ++i)
      sum += residuals_px[i] * residuals_px[i] / (u_px[i] * u_px[i] + x * x);
    return sum;
  };
  if (!(degrees > 0.0) || chi2(0.0) <= degrees) return 0.0;
  double low = 0.0, high = 1e-3;
  while (chi2(high) > degrees && high < 1e6) high *= 2.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (chi2(middle) > degrees ? low : high) = middle;
  }
  return high;
}

}  // namespace truebox
