// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/edge_localisation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace truebox {
namespace {

struct Pixel {
  double d, value;
};

// Phi, its first and second integrals from minus infinity, of a normal distribution.
struct Integrals {
  double density, phi, once, twice;
};
Integrals integrals(double x, double sigma) {
  const double z = x / sigma;
  const double density = std::exp(-0.5 * z * z) / (sigma * std::sqrt(2.0 * std::numbers::pi));
  const double phi = 0.5 * std::erfc(-z / std::numbers::sqrt2);
  const double variance = sigma * sigma;
  return {density, phi, x * phi + variance * density,
          0.5 * ((x * x + variance) * phi + x * variance * density)};
}

std::vector<Pixel> pixels_in(const EdgePlanes& planes, const EdgeWindow& w,
                             const std::vector<double>& weights) {
  const double reach = std::hypot(w.half_length_px, w.half_width_px);
  const auto first = [](double v) { return std::max(0, static_cast<int>(std::floor(v))); };
  const int x1 = std::min(planes.width - 1, static_cast<int>(w.centre.x_px + reach));
  const int y1 = std::min(planes.height - 1, static_cast<int>(w.centre.y_px + reach));
  std::vector<Pixel> pixels;
  for (int y = first(w.centre.y_px - reach); y <= y1; ++y)
    for (int x = first(w.centre.x_px - reach); x <= x1; ++x) {
      const double dx = x + 0.5 - w.centre.x_px, dy = y + 0.5 - w.centre.y_px;
      const double across = dx * w.normal[0] + dy * w.normal[1];
      const double along = dy * w.normal[0] - dx * w.normal[1];
      if (std::abs(across) > w.half_width_px || std::abs(along) > w.half_length_px) continue;
      double value = 0.0;
      for (std::size_t c = 0; c < weights.size(); ++c)
        value += weights[c] * planes.linear[c][planes.index(x, y)];
      pixels.push_back({across, value});
    }
  return pixels;
}

// The combination of planes along which the two sides differ most.
std::vector<double> contrast_weights(const EdgePlanes& planes, const EdgeWindow& window) {
  std::vector<double> weights(planes.linear.size(), 0.0);
  double norm = 0.0;
  for (std::size_t c = 0; c < weights.size(); ++c) {
    std::vector<double> one(weights.size(), 0.0);
    one[c] = 1.0;
    double sums[2] = {0.0, 0.0}, counts[2] = {0.0, 0.0};
    for (const Pixel& p : pixels_in(planes, window, one)) {
      sums[p.d > 0.0] += p.value;
      counts[p.d > 0.0] += 1.0;
    }
    if (counts[0] < 4.0 || counts[1] < 4.0) return {};
    weights[c] = sums[1] / counts[1] - sums[0] / counts[0];
    norm = std::hypot(norm, weights[c]);
  }
  if (!(norm > 0.0)) return {};
  for (double& v : weights) v /= norm;
  return weights;
}

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Normal {
  Matrix6 h = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double sum = 0.0;
};

// p: a, b, c, e, s, sigma.
Normal normal_equations(const std::vector<Pixel>& pixels, const Vector6& p,
                        const std::array<double, 2>& n) {
  Normal eq;
  for (const Pixel& pixel : pixels) {
    const BlurredStep step = blurred_step(pixel.d - p[4], p[5], n);
    const double height = p[2] + p[3] * pixel.d;
    const double residual = p[0] + p[1] * pixel.d + height * step.value - pixel.value;
    Vector6 j;
    j << 1.0, pixel.d, step.value, pixel.d * step.value, -height * step.by_distance,
        height * step.by_sigma;
    eq.h.noalias() += j * j.transpose();
    eq.g += residual * j;
    eq.sum += residual * residual;
  }
  return eq;
}

constexpr double kLeastBlur = 0.02;

Vector6 starting_point(const std::vector<Pixel>& pixels, double half_width) {
  // The split with the largest difference of means, each side's counted by its root number.
  double best = -1.0;
  Vector6 p;
  p << 0.0, 0.0, 0.0, 0.0, 0.0, 0.6;
  for (double s = -0.6 * half_width; s <= 0.6 * half_width; s += 0.5) {
    double sums[2] = {0.0, 0.0}, counts[2] = {1e-9, 1e-9};
    for (const Pixel& pixel : pixels) {
      sums[pixel.d > s] += pixel.value;
      counts[pixel.d > s] += 1.0;
    }
    const double low = sums[0] / counts[0], high = sums[1] / counts[1];
    const double score = (high - low) * (high - low) * counts[0] * counts[1];
    if (score <= best) continue;
    best = score;
    p << low, 0.0, high - low, 0.0, s, 0.6;
  }
  return p;
}

}  // namespace

BlurredStep blurred_step(double d, double sigma, const std::array<double, 2>& normal) {
  // Half widths of the pixel's projections; a box narrower than this is as good as none.
  constexpr double kLeast = 1e-3;
  const double a = 0.5 * std::max(std::abs(normal[0]), std::abs(normal[1]));
  const double b = 0.5 * std::min(std::abs(normal[0]), std::abs(normal[1]));
  if (b < kLeast) {
    if (std::abs(d) > a + 7.0 * sigma) return {d > 0.0 ? 1.0 : 0.0, 0.0, 0.0};
    const Integrals high = integrals(d + a, sigma), low = integrals(d - a, sigma);
    return {(high.once - low.once) / (2.0 * a), (high.phi - low.phi) / (2.0 * a),
            sigma * (high.density - low.density) / (2.0 * a)};
  }
  if (std::abs(d) > a + b + 7.0 * sigma) return {d > 0.0 ? 1.0 : 0.0, 0.0, 0.0};
  // The heat equation: the derivative by sigma is sigma times the second derivative by d.
  BlurredStep step;
  for (const double i : {-1.0, 1.0})
    for (const double k : {-1.0, 1.0}) {
      const Integrals at = integrals(d + i * a + k * b, sigma);
      const double sign = i * k / (4.0 * a * b);
      step.value += sign * at.twice;
      step.by_distance += sign * at.once;
      step.by_sigma += sign * sigma * at.phi;
    }
  return step;
}

std::optional<LocalisedEdge> localised_edge(const EdgePlanes& planes, const EdgeWindow& window) {
  const auto weights = contrast_weights(planes, window);
  if (weights.empty()) return std::nullopt;
  const auto pixels = pixels_in(planes, window, weights);
  if (pixels.size() < 24) return std::nullopt;
  Vector6 p = starting_point(pixels, window.half_width_px);
  double damping = 1e-3;
  Normal eq = normal_equations(pixels, p, window.normal);
  for (int i = 0; i < 60 && damping < 1e8; ++i) {
    Matrix6 h = eq.h;
    for (int k = 0; k < 6; ++k) h(k, k) += damping * h(k, k) + 1e-12;
    Vector6 next = p - h.ldlt().solve(eq.g);
    next[5] = std::clamp(next[5], kLeastBlur, window.half_width_px);
    if (!next.allFinite() || std::abs(next[4]) > window.half_width_px) {
      damping *= 10.0;
      continue;
    }
    const Normal trial = normal_equations(pixels, next, window.normal);
    if (trial.sum > eq.sum) {
      damping *= 10.0;
      continue;
    }
    const bool done = std::abs(next[4] - p[4]) < 1e-6 && std::abs(next[5] - p[5]) < 1e-5;
    p = next;
    eq = trial;
    damping = std::max(damping * 0.2, 1e-9);
    if (done) break;
  }
  LocalisedEdge edge;
  edge.offset_px = p[4];
  edge.blur_px = p[5];
  edge.contrast = p[2] + p[3] * p[4];
  const double variance = eq.sum / (static_cast<double>(pixels.size()) - 6.0);
  edge.noise = std::sqrt(variance);
  // At the least blur, or where no pixel tells of it, sigma is no free parameter: its row must not
  // enter the covariance.
  const int free = p[5] > kLeastBlur && eq.h(5, 5) > 1e-9 * eq.h(4, 4) ? 6 : 5;
  const Eigen::MatrixXd h = eq.h.topLeftCorner(free, free);
  const Eigen::LDLT<Eigen::MatrixXd> factor(h);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return std::nullopt;
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(free, free));
  edge.u_px = std::sqrt(std::max(0.0, variance * covariance(4, 4)));
  const bool is_step =
      std::abs(edge.contrast) > 4.0 * edge.noise * std::sqrt(std::max(0.0, covariance(2, 2)));
  const bool inside = std::abs(edge.offset_px) + edge.blur_px < 0.8 * window.half_width_px;
  if (!is_step || !inside || !(edge.u_px < 1.0) || !std::isfinite(edge.u_px)) return std::nullopt;
  return edge;
}

}  // namespace truebox
