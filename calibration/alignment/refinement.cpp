// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/refinement.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "alignment/normal_matrix.h"
#include "alignment/projection.h"

namespace truebox {
namespace {

constexpr int kPose = 6, kIntrinsics = 3, kDistortion = 12, kStretch = 3;

/// What does not change while parameters do.
struct Frame {
  Eigen::Matrix3d rotation;
  double aspect;
  Vec3 offset_m;
};

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

struct Block {
  double* values;
  int first, size;
};

std::array<Block, 4> blocks_of(CameraParameters& p) {
  return {Block{p.pose.data(), 0, kPose}, Block{p.intrinsics.data(), kPose, kIntrinsics},
          Block{p.distortion.data(), kPose + kIntrinsics, kDistortion},
          Block{p.stretch.data(), kPose + kIntrinsics + kDistortion, kStretch}};
}

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

ParameterCovariance parameter_covariance(const CameraParameters& parameters,
                                         const Observations& observations,
                                         const ParameterFreedom& freedom,
                                         const std::vector<double>& along_edge) {
  using Jet = ceres::Jet<double, static_cast<int>(kCameraParameters)>;
  CameraParameters at = parameters;
  std::array<Jet, kCameraParameters> jets;
  for (const Block& block : blocks_of(at))
    for (int k = 0; k < block.size; ++k)
      jets[static_cast<std::size_t>(block.first + k)] = Jet(block.values[k], block.first + k);
  const Jet* const p[] = {jets.data(), jets.data() + kPose, jets.data() + kPose + kIntrinsics,
                          jets.data() + kPose + kIntrinsics + kDistortion};
  const auto free = freedom.indices();
  const auto n = static_cast<Eigen::Index>(free.size());
  const auto row = [&](const Jet& residual) {
    Eigen::VectorXd j(n);
    for (Eigen::Index k = 0; k < n; ++k)
      j[k] = residual.v[static_cast<Eigen::Index>(free[static_cast<std::size_t>(k)])];
    return j;
  };
  const auto frame = [&](const Vec3& point) {
    return Frame{parameters.rotation, parameters.aspect, point - parameters.centre_m};
  };
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(n, n), curvature = prior, scatter = prior;
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::size_t i = free[static_cast<std::size_t>(k)];
    names.push_back(parameter_names()[i]);
    if (std::isfinite(freedom.prior_u[i])) prior(k, k) = std::pow(freedom.prior_u[i], -2.0);
  }
  std::vector<Eigen::VectorXd> rows;
  for (const EdgeObservation& seen : observations.edges) {
    Jet residual;
    rows.push_back(across_edge(frame(seen.point_m), seen, p, &residual) ? row(residual)
                                                                        : Eigen::VectorXd::Zero(n));
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    curvature += rows[i] * rows[i].transpose();
    for (std::size_t lag = 1; lag <= along_edge.size() && i + lag < rows.size(); ++lag) {
      if (observations.edges[i].edge != observations.edges[i + lag].edge) break;
      const double weight = along_edge[lag - 1];
      const Eigen::MatrixXd cross = rows[i] * rows[i + lag].transpose();
      scatter += weight * (cross + cross.transpose());
    }
  }
  scatter += curvature;
  for (const PointObservation& seen : observations.points) {
    Jet residual[2];
    if (!from_point(frame(seen.point_m), seen, p, residual)) continue;
    for (const Jet& r : residual) {
      const Eigen::VectorXd j = row(r);
      curvature += j * j.transpose();
      scatter += j * j.transpose();
    }
  }
  // Correlations cut off at some lag may be those of no process: what is known least is then taken
  // as independent rather than as better than that.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scatter);
  if (n > 0 && eigen.eigenvalues()[0] < -1e-9 * eigen.eigenvalues()[n - 1])
    scatter = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
                  eigen.eigenvectors().transpose() +
              curvature;
  const NormalInverse inverse = invert_normal_matrix(curvature + prior, names);
  ParameterCovariance result;
  result.condition = inverse.condition;
  if (!inverse.inverse) {
    result.outcome = AlignmentOutcome::rank_deficient;
    result.null_direction = inverse.weakest;
    return result;
  }
  result.outcome = AlignmentOutcome::converged;
  result.covariance = *inverse.inverse * (scatter + prior) * *inverse.inverse;
  return result;
}

std::vector<double> correlation_along_edges(const std::vector<EdgeObservation>& edges,
                                            const std::vector<double>& standardised) {
  constexpr std::size_t kMostLags = 40;
  double variance = 0.0;
  for (double r : standardised) variance += r * r / static_cast<double>(standardised.size());
  std::vector<double> correlations;
  for (std::size_t lag = 1; lag <= kMostLags && variance > 0.0; ++lag) {
    double sum = 0.0, pairs = 0.0;
    for (std::size_t i = 0; i + lag < edges.size(); ++i) {
      if (edges[i].edge != edges[i + lag].edge) continue;
      sum += standardised[i] * standardised[i + lag];
      pairs += 1.0;
    }
    if (pairs < 10.0) break;
    const double rho = sum / pairs / variance;
    if (rho < 2.0 / std::sqrt(pairs)) break;
    correlations.push_back(rho);
  }
  return correlations;
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
