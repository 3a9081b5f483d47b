// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/group_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace truebox {
namespace {

constexpr int kN = kGroupSamples;

struct Sums {
  float by_a[kN], by_b[kN], squares;
};

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
__attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#endif
void
add_pairs(const GroupSamples& a, const GroupSamples& b, float dx, float dy, float dz, Sums& sums) {
  float bx[kN], by[kN], bz[kN];
  for (int j = 0; j < kN; ++j) {
    bx[j] = b.x[j] + dx;
    by[j] = b.y[j] + dy;
    bz[j] = b.z[j] + dz;
    sums.by_b[j] = 0.0f;
  }
  float squares = 0.0f;
  for (int i = 0; i < kN; ++i) {
    const float ax = a.x[i], ay = a.y[i], az = a.z[i], nx = a.nx[i], ny = a.ny[i], nz = a.nz[i];
    float row = 0.0f;
    for (int j = 0; j < kN; ++j) {
      const float rx = bx[j] - ax, ry = by[j] - ay, rz = bz[j] - az;
      const float ca = nx * rx + ny * ry + nz * rz;
      const float cb = -(b.nx[j] * rx + b.ny[j] * ry + b.nz[j] * rz);
      const float r2 = rx * rx + ry * ry + rz * rz + 1e-30f;
      const float k = (ca > 0.0f ? ca : 0.0f) * (cb > 0.0f ? cb : 0.0f) / (r2 * r2);
      const float weighted = b.weight[j] * k;
      row += weighted;
      sums.by_b[j] += a.weight[i] * k;
      squares += a.weight[i] * weighted * k;
    }
    sums.by_a[i] = row;
  }
  sums.squares = squares;
}

double deviation(const float* values, const float* weights, double mean) {
  double sum = 0.0;
  for (int k = 0; k < kN; ++k) sum += weights[k] * (values[k] - mean) * (values[k] - mean);
  return std::sqrt(std::max(0.0, sum));
}

}  // namespace

KernelStatistics kernel_statistics(const GroupSamples& a, const GroupSamples& b,
                                   const Vec3& offset_m) {
  Sums sums;
  add_pairs(a, b, static_cast<float>(offset_m.x()), static_cast<float>(offset_m.y()),
            static_cast<float>(offset_m.z()), sums);
  double mean = 0.0;
  for (int k = 0; k < kN; ++k) mean += static_cast<double>(a.weight[k]) * sums.by_a[k];
  KernelStatistics result;
  result.mean = mean / std::numbers::pi;
  result.spread_a = deviation(sums.by_a, a.weight, mean) / std::numbers::pi;
  result.spread_b = deviation(sums.by_b, b.weight, mean) / std::numbers::pi;
  result.spread = std::sqrt(std::max(0.0, sums.squares - mean * mean)) / std::numbers::pi;
  return result;
}

}  // namespace truebox
