// SPDX-License-Identifier: BSD-3-Clause
#include "difference/delta_e_itp.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

/// Inverse EOTF of BT.2100 (PQ), table 4.
double perceptual_quantiser(double cd_m2) {
  constexpr double kM1 = 2610.0 / 16384.0, kM2 = 2523.0 / 4096.0 * 128.0;
  constexpr double kC1 = 3424.0 / 4096.0, kC2 = 2413.0 / 4096.0 * 32.0,
                   kC3 = 2392.0 / 4096.0 * 32.0;
  const double y = std::pow(std::max(cd_m2, 0.0) / 10000.0, kM1);
  return std::pow((kC1 + kC2 * y) / (1.0 + kC3 * y), kM2);
}

}  // namespace

Ictcp ictcp(const LinearRgb& c) {
  const double l = perceptual_quantiser((1688.0 * c[0] + 2146.0 * c[1] + 262.0 * c[2]) / 4096.0);
  const double m = perceptual_quantiser((683.0 * c[0] + 2951.0 * c[1] + 462.0 * c[2]) / 4096.0);
  const double s = perceptual_quantiser((99.0 * c[0] + 309.0 * c[1] + 3688.0 * c[2]) / 4096.0);
  return {0.5 * (l + m), (6610.0 * l - 13613.0 * m + 7003.0 * s) / 4096.0,
          (17933.0 * l - 17390.0 * m - 543.0 * s) / 4096.0};
}

LinearRgb bt2020_from_bt709(const LinearRgb& c) {
  return {0.6274 * c[0] + 0.3293 * c[1] + 0.0433 * c[2],
          0.0691 * c[0] + 0.9195 * c[1] + 0.0114 * c[2],
          0.0164 * c[0] + 0.0880 * c[1] + 0.8956 * c[2]};
}

double delta_e_itp(const Ictcp& a, const Ictcp& b) {
  return 720.0 * std::hypot(a.I - b.I, 0.5 * (a.Ct - b.Ct), a.Cp - b.Cp);
}

}  // namespace truebox
