// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/radiance_fit.h"

#include <ceres/ceres.h>
#include <ceres/cubic_interpolation.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "alignment/projection.h"

namespace truebox {
namespace {

using Grid = ceres::Grid2D<float, 1>;
using Interpolator = ceres::BiCubicInterpolator<Grid>;
constexpr double kLeastScale = 1e-6;  // of white: exact predictions of exact pictures

struct RadianceCost {
  const Interpolator* light;
  Frame frame;
  const RadianceSample* sample;
  double value, scale;

  template <class T>
  bool operator()(const T* pose, const T* intrinsics, const T* distortion, const T* stretch,
                  const T* gain, T* residual) const {
    T px[2];
    if (!project_point(frame.rotation, frame.aspect, frame.offset_m, pose, intrinsics, distortion,
                       stretch, px))
      return false;
    // The point moves by d; its pixel then shows what lay d before it.
    const T dx = px[0] - sample->seen.x_px, dy = px[1] - sample->seen.y_px;
    const Eigen::Matrix2d& a = sample->render_from_photo;
    const T column = sample->render.x_px - a(0, 0) * dx - a(0, 1) * dy - 0.5;
    const T row = sample->render.y_px - a(1, 0) * dx - a(1, 1) * dy - 0.5;
    T predicted;
    light->Evaluate(row, column, &predicted);
    residual[0] = (gain[0] * predicted + gain[1] - value) / scale;
    return true;
  }
};

using AutoDiff =
    ceres::AutoDiffCostFunction<RadianceCost, 1, kPose, kIntrinsics, kDistortion, kStretch, 2>;

/// W (parameters - mean) of what is known.
class KnownCost : public ceres::CostFunction {
 public:
  explicit KnownCost(const KnownCamera& known) : known_(known), whitening_(known.whitening()) {
    set_num_residuals(static_cast<int>(known.indices.size()));
    *mutable_parameter_block_sizes() = {kPose, kIntrinsics, kDistortion, kStretch};
  }
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const auto n = static_cast<Eigen::Index>(known_.indices.size());
    Eigen::VectorXd off(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto [block, at] = place(k);
      off[k] = blocks[block][at] - known_.mean[k];
    }
    Eigen::Map<Eigen::VectorXd>(residuals, n) = whitening_ * off;
    if (!jacobians) return true;
    for (int b = 0; b < 4; ++b)
      if (jacobians[b])
        std::fill_n(jacobians[b], n * parameter_block_sizes()[static_cast<std::size_t>(b)], 0.0);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto [block, at] = place(k);
      if (!jacobians[block]) continue;
      const int size = parameter_block_sizes()[static_cast<std::size_t>(block)];
      for (Eigen::Index i = 0; i < n; ++i) jacobians[block][i * size + at] = whitening_(i, k);
    }
    return true;
  }

 private:
  std::pair<int, int> place(Eigen::Index k) const {
    int at = static_cast<int>(known_.indices[static_cast<std::size_t>(k)]), block = 0;
    for (const int size : parameter_block_sizes()) {
      if (at < size) break;
      at -= size;
      ++block;
    }
    return {block, at};
  }
  const KnownCamera& known_;
  Eigen::MatrixXd whitening_;
};

void hold_what_is_not_free(ceres::Problem& problem, CameraParameters& p,
                           const std::vector<std::size_t>& free) {
  for (const Block& block : blocks_of(p)) {
    std::vector<int> fixed;
    for (int k = 0; k < block.size; ++k)
      if (std::find(free.begin(), free.end(), static_cast<std::size_t>(block.first + k)) ==
          free.end())
        fixed.push_back(k);
    if (static_cast<int>(fixed.size()) == block.size)
      problem.SetParameterBlockConstant(block.values);
    else if (!fixed.empty())
      problem.SetManifold(block.values, new ceres::SubsetManifold(block.size, fixed));
  }
}

double robust_deviation(std::vector<double> residuals) {
  if (residuals.empty()) return kLeastScale;
  for (double& r : residuals) r = std::abs(r);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return std::max(1.4826 * *middle, kLeastScale);
}

}  // namespace

struct RadianceFit::Light {
  Light(const std::vector<float>& plane, int width, int height)
      : grid(plane.data(), 0, height, 0, width), interpolator(grid) {}
  Grid grid;
  Interpolator interpolator;
};

Eigen::MatrixXd KnownCamera::whitening() const {
  // By correlations, so that units do not matter.
  const Eigen::VectorXd u = covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd correlation =
      u.cwiseInverse().asDiagonal() * covariance * u.cwiseInverse().asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> factor(correlation);
  Eigen::MatrixXd w = u.cwiseInverse().asDiagonal();
  factor.matrixL().solveInPlace(w);
  return w;
}

RadianceFit::RadianceFit(const BandPairs& bands, int render_width, int render_height,
                         bool gain_per_surface)
    : bands_(bands), per_surface_(gain_per_surface), scales_(bands.bands.size(), 0.0) {
  for (const BandPair& band : bands.bands)
    light_.push_back(std::make_unique<Light>(band.render, render_width, render_height));
}

RadianceFit::~RadianceFit() = default;

std::size_t RadianceFit::group_of(std::size_t band, int surface) const {
  const auto found = std::lower_bound(surfaces_.begin(), surfaces_.end(), surface);
  return band * surfaces_.size() +
         (per_surface_ ? static_cast<std::size_t>(found - surfaces_.begin()) : 0);
}

double RadianceFit::value(const RadianceSample& sample, std::size_t band) const {
  return bands_.bands[band]
      .photograph[static_cast<std::size_t>(sample.y * bands_.width + sample.x)];
}

void RadianceFit::set_samples(std::vector<RadianceSample> samples, const CameraParameters& at) {
  samples_ = std::move(samples);
  if (!gains_.empty()) {
    if (per_surface_)  // a surface that has come into view since has no gain
      std::erase_if(samples_, [&](const RadianceSample& s) {
        return !std::binary_search(surfaces_.begin(), surfaces_.end(), s.surface);
      });
    return;
  }
  surfaces_ = {0};
  if (per_surface_) {
    surfaces_.clear();
    for (const RadianceSample& s : samples_) surfaces_.push_back(s.surface);
    std::sort(surfaces_.begin(), surfaces_.end());
    surfaces_.erase(std::unique(surfaces_.begin(), surfaces_.end()), surfaces_.end());
  }
  start_gains();
  update_scales(at);
}

// Least squares of photograph on prediction, group by group.
void RadianceFit::start_gains() {
  struct Sums {
    double n = 0.0, l = 0.0, v = 0.0, ll = 0.0, lv = 0.0;
  };
  std::vector<Sums> sums(bands_.bands.size() * surfaces_.size());
  for (std::size_t b = 0; b < bands_.bands.size(); ++b)
    for (const RadianceSample& s : samples_) {
      const double v = value(s, b);
      if (!std::isfinite(v)) continue;
      double l;
      light_[b]->interpolator.Evaluate(s.render.y_px - 0.5, s.render.x_px - 0.5, &l);
      Sums& sum = sums[group_of(b, s.surface)];
      sum.n += 1.0;
      sum.l += l;
      sum.v += v;
      sum.ll += l * l;
      sum.lv += l * v;
    }
  for (const Sums& s : sums) {
    const double spread = s.n * s.ll - s.l * s.l;
    const double gain = spread > 1e-12 * s.n * s.ll ? (s.n * s.lv - s.l * s.v) / spread : 1.0;
    gains_.push_back({gain, s.n > 0.0 ? (s.v - gain * s.l) / s.n : 0.0});
  }
}

void RadianceFit::update_scales(const CameraParameters& parameters) {
  std::vector<std::vector<double>> residuals(bands_.bands.size());
  std::fill(scales_.begin(), scales_.end(), 1.0);
  for (const RadianceRow& row : rows(parameters, {})) residuals[row.band].push_back(row.residual);
  for (std::size_t b = 0; b < scales_.size(); ++b) scales_[b] = robust_deviation(residuals[b]);
}

bool RadianceFit::solve(CameraParameters& p, const KnownCamera& known, double dispersion) {
  ceres::Problem::Options shared;  // one loss for all
  shared.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(shared);
  const auto blocks = blocks_of(p);
  problem.AddResidualBlock(new KnownCost(known), nullptr, blocks[0].values, blocks[1].values,
                           blocks[2].values, blocks[3].values);
  ceres::CauchyLoss cauchy(kCauchy);
  ceres::ScaledLoss loss(&cauchy, 1.0 / dispersion, ceres::DO_NOT_TAKE_OWNERSHIP);
  for (std::size_t b = 0; b < bands_.bands.size(); ++b)
    for (const RadianceSample& s : samples_) {
      const double v = value(s, b);
      if (!std::isfinite(v)) continue;
      problem.AddResidualBlock(
          new AutoDiff(new RadianceCost{&light_[b]->interpolator, frame_of(p, s.point_m), &s, v,
                                        scales_[b]}),
          &loss, blocks[0].values, blocks[1].values, blocks[2].values, blocks[3].values,
          gains_[group_of(b, s.surface)].data());
    }
  hold_what_is_not_free(problem, p, known.indices);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 30;
  options.function_tolerance = 1e-9;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.termination_type == ceres::CONVERGENCE;
}

std::vector<RadianceRow> RadianceFit::rows(const CameraParameters& parameters,
                                           const std::vector<std::size_t>& free) const {
  CameraParameters p = parameters;
  const auto blocks = blocks_of(p);
  double pose[kPose], intrinsics[kIntrinsics], distortion[kDistortion], stretch[kStretch], gain[2];
  double* jacobians[] = {pose, intrinsics, distortion, stretch, gain};
  std::array<double, kCameraParameters> all{};
  std::vector<RadianceRow> rows;
  for (std::size_t b = 0; b < bands_.bands.size(); ++b)
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const RadianceSample& s = samples_[i];
      const double v = value(s, b);
      if (!std::isfinite(v)) continue;
      RadianceRow row{i, b, group_of(b, s.surface), 0.0, {}, {}};
      const AutoDiff cost(
          new RadianceCost{&light_[b]->interpolator, frame_of(p, s.point_m), &s, v, scales_[b]});
      const double* const values[] = {blocks[0].values, blocks[1].values, blocks[2].values,
                                      blocks[3].values, gains_[row.group].data()};
      if (!cost.Evaluate(values, &row.residual, free.empty() ? nullptr : jacobians)) continue;
      if (!free.empty()) {
        for (const Block& block : blocks)
          std::copy_n(jacobians[&block - blocks.data()], block.size, all.begin() + block.first);
        row.by_camera.resize(static_cast<Eigen::Index>(free.size()));
        for (std::size_t k = 0; k < free.size(); ++k)
          row.by_camera[static_cast<Eigen::Index>(k)] = all[free[k]];
        row.by_gain = {gain[0], gain[1]};
      }
      rows.push_back(std::move(row));
    }
  return rows;
}

}  // namespace truebox
