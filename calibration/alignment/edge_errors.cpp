// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/edge_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace truebox {
namespace {

constexpr double kLeast_px = 1e-6;  // below any measurement: keeps exact residuals finite

/// -2 ln L up to a constant.
class RestrictedLikelihood {
 public:
  explicit RestrictedLikelihood(const LinearisedFit& fit) : fit_(fit) {}

  double operator()(const EdgeErrors& errors) const {
    const Eigen::Index n = fit_.information.rows();
    Eigen::MatrixXd a = fit_.information;
    Eigen::VectorXd b = fit_.pull;
    double squares = 0.0, logs = 0.0;
    for (const EdgeChain& chain : fit_.edges) {
      const Eigen::MatrixXd white = whitened(chain, errors, logs);
      const auto rows = white.leftCols(n);
      const auto residual = white.col(n);
      a.noalias() += rows.transpose() * rows;
      b.noalias() += rows.transpose() * residual;
      squares += residual.squaredNorm();
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(a);
    if (n > 0 && factor.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    for (Eigen::Index k = 0; k < n; ++k) logs += 2.0 * std::log(factor.matrixLLT()(k, k));
    return logs + squares - (n > 0 ? b.dot(factor.solve(b)) : 0.0);
  }

 private:
  // Innovations over their standard deviations; the residual is the last column.
  static Eigen::MatrixXd whitened(const EdgeChain& chain, const EdgeErrors& e, double& logs) {
    const Eigen::Index pieces = chain.rows.rows(), n = chain.rows.cols();
    Eigen::MatrixXd white(pieces, n + 1);
    white << chain.rows, chain.residual_px;
    Eigen::RowVectorXd state = Eigen::RowVectorXd::Zero(n + 1);
    const double wave2 = e.wave_u_px * e.wave_u_px;
    double variance = wave2;
    for (Eigen::Index i = 0; i < pieces; ++i) {
      const double kept =
          i == 0 || !(wave2 > 0.0) ? 0.0 : std::exp(-chain.gap_px[i] / e.wave_length_px);
      state *= kept;
      variance = kept * kept * variance + (1.0 - kept * kept) * wave2;
      const double own =
          std::pow(chain.noise_u_px[i], 2) + e.white_u_px * e.white_u_px + kLeast_px * kLeast_px;
      const double total = variance + own;
      const Eigen::RowVectorXd innovation = white.row(i) - state;
      state += variance / total * innovation;
      white.row(i) = innovation / std::sqrt(total);
      variance *= own / total;
      logs += std::log(total);
    }
    return white;
  }

  const LinearisedFit& fit_;
};

/// A shape of errors at several sizes about the likeliest: posterior models, not yet normalised.
class SizesOfShape {
 public:
  SizesOfShape(const RestrictedLikelihood& likelihood, double white_share, double length_px,
               double typical_px)
      : likelihood_(likelihood),
        white_share_(white_share),
        length_px_(length_px),
        lowest_(std::log(1e-3 * typical_px)),
        highest_(std::log(30.0 * typical_px)) {}

  /// Probabilities are minus half the likelihood's -2 ln, plus ln of the step in ln size.
  void add_to(std::vector<WeightedErrors>& models) const {
    const double mode = likeliest();
    constexpr double kStep = 0.1;
    const double curvature =
        (minus_two_log(mode - kStep) - 2.0 * minus_two_log(mode) + minus_two_log(mode + kStep)) /
        (kStep * kStep);
    // Half of minus two logarithms curves as the inverse variance. Flat where noise explains all.
    const double spread = std::min(std::sqrt(2.0 / std::max(curvature, 2.0)), 1.0);
    for (int k = -3; k <= 4; ++k) {
      const double at = mode + k * spread;
      if (at < lowest_ - 1e-9) continue;
      models.push_back({at_size(at), -0.5 * minus_two_log(at) + std::log(spread)});
    }
  }

 private:
  EdgeErrors at_size(double logarithm) const {
    const double size = std::exp(logarithm);
    return {size * std::sqrt(white_share_), size * std::sqrt(1.0 - white_share_), length_px_};
  }
  double minus_two_log(double logarithm) const { return likelihood_(at_size(logarithm)); }

  double likeliest() const {  // golden section
    constexpr double kRatio = 0.6180339887498949;
    double low = lowest_, high = highest_;
    double a = high - kRatio * (high - low), b = low + kRatio * (high - low);
    double at_a = minus_two_log(a), at_b = minus_two_log(b);
    while (high - low > 0.1) {
      if (at_a < at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - kRatio * (high - low);
        at_a = minus_two_log(a);
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + kRatio * (high - low);
        at_b = minus_two_log(b);
      }
    }
    return 0.5 * (low + high);
  }

  const RestrictedLikelihood& likelihood_;
  double white_share_, length_px_, lowest_, highest_;
};

struct Scales {
  double residual_px = 0.0;                    // root mean square
  double shortest_px = 0.0, longest_px = 0.0;  // wave lengths worth asking for
};

Scales scales_of(const LinearisedFit& fit) {
  double squares = 0.0, pieces = 0.0, gaps = 0.0, gap_count = 0.0, longest = 0.0;
  for (const EdgeChain& chain : fit.edges) {
    squares += chain.residual_px.squaredNorm();
    pieces += static_cast<double>(chain.residual_px.size());
    double length = 0.0;
    for (Eigen::Index i = 1; i < chain.gap_px.size(); ++i) length += chain.gap_px[i];
    gaps += length;
    gap_count += static_cast<double>(chain.gap_px.size() - 1);
    longest = std::max(longest, length);
  }
  Scales scales;
  scales.residual_px = std::max(std::sqrt(squares / std::max(pieces, 1.0)), kLeast_px);
  scales.shortest_px = gap_count > 0.0 ? gaps / gap_count : 0.0;
  scales.longest_px = 20.0 * longest;  // the same all along an edge
  return scales;
}

}  // namespace

std::vector<WeightedErrors> edge_error_posterior(const LinearisedFit& fit) {
  constexpr std::array kWhiteShares = {0.8, 0.5, 0.2, 0.0};
  constexpr int kLengths = 6;
  const RestrictedLikelihood likelihood(fit);
  const Scales scales = scales_of(fit);
  std::vector<WeightedErrors> models;
  SizesOfShape(likelihood, 1.0, 1.0, scales.residual_px).add_to(models);
  // Waves or none: as likely beforehand.
  for (WeightedErrors& m : models)
    m.probability += std::log(static_cast<double>(kLengths * kWhiteShares.size()));
  if (scales.shortest_px > 0.0)
    for (int k = 0; k < kLengths; ++k) {
      const double length = scales.shortest_px *
                            std::pow(scales.longest_px / scales.shortest_px, k / (kLengths - 1.0));
      for (const double share : kWhiteShares)
        SizesOfShape(likelihood, share, length, scales.residual_px).add_to(models);
    }
  double best = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (const WeightedErrors& m : models) best = std::max(best, m.probability);
  for (WeightedErrors& m : models) sum += m.probability = std::exp(m.probability - best);
  for (WeightedErrors& m : models) m.probability /= sum;
  std::erase_if(models, [](const WeightedErrors& m) { return m.probability < 1e-6; });
  return models;
}

EdgeErrors mean_errors(const std::vector<WeightedErrors>& posterior) {
  double white2 = 0.0, wave2 = 0.0, logs = 0.0, weights = 0.0;
  for (const auto& [e, probability] : posterior) {
    white2 += probability * e.white_u_px * e.white_u_px;
    wave2 += probability * e.wave_u_px * e.wave_u_px;
    if (!(e.wave_u_px > 0.0)) continue;
    logs += probability * std::log(e.wave_length_px);
    weights += probability;
  }
  return {std::sqrt(white2), std::sqrt(wave2), weights > 0.0 ? std::exp(logs / weights) : 0.0};
}

Eigen::MatrixXd edge_scatter(const LinearisedFit& fit, const EdgeErrors& errors) {
  const Eigen::Index n = fit.information.rows();
  const double white2 = errors.white_u_px * errors.white_u_px;
  const double wave2 = errors.wave_u_px * errors.wave_u_px;
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(n, n);
  for (const EdgeChain& chain : fit.edges) {
    // What earlier pieces share with this one, summed on the way along the edge.
    Eigen::RowVectorXd carried = Eigen::RowVectorXd::Zero(n);
    for (Eigen::Index i = 0; i < chain.rows.rows(); ++i) {
      const Eigen::RowVectorXd row = chain.rows.row(i) / std::pow(chain.u_px[i], 2);
      if (i > 0 && wave2 > 0.0) carried *= std::exp(-chain.gap_px[i] / errors.wave_length_px);
      const double variance = std::pow(chain.noise_u_px[i], 2) + white2 + wave2;
      scatter += variance * row.transpose() * row;
      const Eigen::MatrixXd shared = wave2 * carried.transpose() * row;
      scatter += shared + shared.transpose();
      carried += row;
    }
  }
  return scatter;
}

}  // namespace truebox
