// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/block_scatter.h"

#include <Eigen/Dense>
#include <cmath>
#include <map>

namespace truebox {
namespace {

// psi(r) = r / (1 + r^2 / c^2) and its derivative: Cauchy's loss.
constexpr double kC2 = RadianceFit::kCauchy * RadianceFit::kCauchy;
double psi(double r) { return r / (1.0 + r * r / kC2); }
double psi_slope(double r) {
  const double q = r * r / kC2;
  return (1.0 - q) / ((1.0 + q) * (1.0 + q));
}

/// Adds w j j^T; j is the camera's derivatives and, further down, those of one gain.
void add_square(const RadianceRow& row, double weight, Eigen::MatrixXd& sum) {
  const Eigen::Index n = row.by_camera.size();
  const Eigen::Index g = n + 2 * static_cast<Eigen::Index>(row.group);
  const Eigen::Vector2d gain(row.by_gain[0], row.by_gain[1]);
  sum.topLeftCorner(n, n) += weight * row.by_camera * row.by_camera.transpose();
  const Eigen::MatrixXd cross = weight * row.by_camera * gain.transpose();
  sum.block(0, g, n, 2) += cross;
  sum.block(g, 0, 2, n) += cross.transpose();
  sum.block(g, g, 2, 2) += weight * gain * gain.transpose();
}

class Scatter {
 public:
  Scatter(const std::vector<RadianceRow>& rows, const std::vector<RadianceSample>& samples,
          std::size_t groups, const Eigen::MatrixXd& known, double dispersion)
      : rows_(rows), samples_(samples), dispersion_(dispersion), camera_(known.rows()) {
    size_ = camera_ + 2 * static_cast<Eigen::Index>(groups);
    curvature_ = Eigen::MatrixXd::Zero(size_, size_);
    squares_ = curvature_;
    for (const RadianceRow& row : rows) {
      add_square(row, psi_slope(row.residual) / dispersion, curvature_);
      add_square(row, std::pow(psi(row.residual) / dispersion, 2), squares_);
    }
    // Groups without pixels, and the last of what no pixel tells, stay where they are.
    for (Eigen::Index k = camera_; k < size_; ++k)
      curvature_(k, k) += 1e-9 * std::max(curvature_(k, k), 1.0);
    total_ = curvature_;
    total_.topLeftCorner(camera_, camera_) += known;
    inverse_ = total_.ldlt().solve(Eigen::MatrixXd::Identity(size_, size_));
  }

  BlockScatter of(int block_px) const {
    std::map<std::pair<int, int>, ScoreBlock> blocks;
    for (const RadianceRow& row : rows_) {
      const RadianceSample& s = samples_[row.sample];
      auto [found, is_new] = blocks.try_emplace({s.x / block_px, s.y / block_px});
      ScoreBlock& block = found->second;
      if (is_new) {
        block.score = Eigen::VectorXd::Zero(size_);
        block.curvature = Eigen::MatrixXd::Zero(size_, size_);
      }
      const double p = psi(row.residual) / dispersion_;
      block.score.head(camera_) += p * row.by_camera;
      const Eigen::Index g = camera_ + 2 * static_cast<Eigen::Index>(row.group);
      block.score[g] += p * row.by_gain[0];
      block.score[g + 1] += p * row.by_gain[1];
      add_square(row, psi_slope(row.residual) / dispersion_, block.curvature);
    }
    BlockScatter result;
    result.block_px = block_px;
    result.blocks = blocks.size();
    result.covariance = Eigen::MatrixXd::Zero(size_, size_);
    for (const auto& [at, block] : blocks) {
      const Eigen::VectorXd off = (total_ - block.curvature).ldlt().solve(block.score);
      result.covariance += off * off.transpose();
    }
    const auto count = static_cast<double>(blocks.size());
    result.covariance *= (count - 1.0) / count;
    const Eigen::MatrixXd independent = inverse_ * squares_ * inverse_;
    double sum = 0.0;
    for (Eigen::Index k = 0; k < camera_; ++k)
      sum += result.covariance(k, k) / independent(k, k) / static_cast<double>(camera_);
    result.dispersion = sum;
    return result;
  }

  void fill(BlockScatter& result) const {
    const Eigen::Index gains = size_ - camera_;
    result.inverse_curvature = inverse_;
    result.information = curvature_.topLeftCorner(camera_, camera_) -
                         curvature_.topRightCorner(camera_, gains) *
                             curvature_.bottomRightCorner(gains, gains)
                                 .ldlt()
                                 .solve(curvature_.bottomLeftCorner(gains, camera_));
  }

 private:
  const std::vector<RadianceRow>& rows_;
  const std::vector<RadianceSample>& samples_;
  double dispersion_;
  Eigen::Index camera_, size_ = 0;
  Eigen::MatrixXd curvature_, squares_, total_, inverse_;
};

}  // namespace

BlockScatter block_scatter(const std::vector<RadianceRow>& rows,
                           const std::vector<RadianceSample>& samples, std::size_t groups,
                           const Eigen::MatrixXd& known_information, double dispersion) {
  constexpr std::size_t kFewest = 40;
  const Scatter scatter(rows, samples, groups, known_information, dispersion);
  std::vector<BlockScatter> sides;
  for (int side = 8;; side *= 2) {
    BlockScatter next = scatter.of(side);
    if (next.blocks < kFewest && !sides.empty()) break;
    sides.push_back(std::move(next));
    if (sides.back().blocks < kFewest) break;
  }
  double most = 0.0;
  for (const BlockScatter& s : sides) most = std::max(most, s.dispersion);
  for (BlockScatter& s : sides)
    if (s.dispersion >= 0.9 * most) {
      scatter.fill(s);
      return std::move(s);
    }
  return {};
}

}  // namespace truebox
