// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/point_spread.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <numeric>
#include <stdexcept>

namespace truebox {
namespace {

// Mirror images of 0 .. size-1 beyond the edges, each edge pixel doubled.
std::size_t mirrored(long index, long size) {
  const long period = 2 * size;
  const long folded = ((index % period) + period) % period;
  return static_cast<std::size_t>(folded < size ? folded : period - 1 - folded);
}

// Convolves `lines` runs of `count` values: value i of line k is at k * line_stride + i * stride.
void convolve(std::vector<double>& values, int lines, int line_stride, int count, int stride,
              const std::vector<double>& weights) {
  if (weights.size() == 1) return;
  tbb::parallel_for(tbb::blocked_range<int>(0, lines), [&](const auto& range) {
    std::vector<double> line(static_cast<std::size_t>(count));
    for (int k = range.begin(); k < range.end(); ++k) {
      const auto at = [&](int i) -> double& {
        return values[static_cast<std::size_t>(k) * static_cast<std::size_t>(line_stride) +
                      static_cast<std::size_t>(i) * static_cast<std::size_t>(stride)];
      };
      for (int i = 0; i < count; ++i) line[static_cast<std::size_t>(i)] = at(i);
      for (int i = 0; i < count; ++i) {
        double sum = weights[0] * line[static_cast<std::size_t>(i)];
        for (std::size_t n = 1; n < weights.size(); ++n) {
          const long reach = static_cast<long>(n);
          sum += weights[n] * (line[mirrored(i - reach, count)] + line[mirrored(i + reach, count)]);
        }
        at(i) = sum;
      }
    }
  });
}

}  // namespace

std::vector<double> discrete_gaussian(double sigma_px) {
  if (!(sigma_px >= 0.0) || sigma_px > 1000.0)
    throw std::invalid_argument("a point spread is 0 to 1000 px wide");
  const double t = sigma_px * sigma_px;
  if (t == 0.0) return {1.0};
  // I_{n-1} = I_{n+1} + (2 n / t) I_n, downwards from far out where I_n vanishes: stable (Miller).
  const std::size_t far = 60 + static_cast<std::size_t>(14.0 * sigma_px);
  std::vector<double> weights(far + 2, 0.0);
  weights[far] = 1e-290;
  for (std::size_t n = far; n >= 1; --n) {
    weights[n - 1] = weights[n + 1] + 2.0 * static_cast<double>(n) / t * weights[n];
    if (weights[n - 1] > 1e200)
      for (double& w : weights) w *= 1e-200;
  }
  while (weights.size() > 1 && weights.back() < 1e-17 * weights[0]) weights.pop_back();
  const double sum = 2.0 * std::accumulate(weights.rbegin(), weights.rend(), 0.0) - weights[0];
  for (double& w : weights) w /= sum;
  return weights;
}

void spread(LightPlane& plane, std::array<double, 2> sigma_px) {
  convolve(plane.values, plane.height, plane.width, plane.width, 1, discrete_gaussian(sigma_px[0]));
  convolve(plane.values, plane.width, 1, plane.height, plane.width, discrete_gaussian(sigma_px[1]));
}

void add_veiling_glare(LightPlane& plane, double share) {
  if (share == 0.0 || plane.values.empty()) return;
  const double mean = std::accumulate(plane.values.begin(), plane.values.end(), 0.0) /
                      static_cast<double>(plane.values.size());
  for (double& value : plane.values) value += share * (mean - value);
}

}  // namespace truebox
