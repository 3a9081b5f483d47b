// SPDX-License-Identifier: BSD-3-Clause
#include "difference/ciede2000.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace truebox {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

double cielab_response(double ratio) {
  constexpr double kDelta = 6.0 / 29.0;
  if (ratio > kDelta * kDelta * kDelta) return std::cbrt(ratio);
  return ratio / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
}

double hue_rad(double a, double b) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double angle = std::atan2(b, a);
  return angle < 0.0 ? angle + 2.0 * std::numbers::pi : angle;
}

/// Eq (10): the signed way round the hue circle that is not longer than half of it.
double hue_step_rad(double from, double to, bool achromatic) {
  if (achromatic) return 0.0;
  const double step = to - from;
  if (step > std::numbers::pi) return step - 2.0 * std::numbers::pi;
  if (step < -std::numbers::pi) return step + 2.0 * std::numbers::pi;
  return step;
}

/// Eq (14).
double mean_hue_rad(double h1, double h2, bool achromatic) {
  if (achromatic) return h1 + h2;
  if (std::abs(h1 - h2) <= std::numbers::pi) return (h1 + h2) / 2.0;
  const double turn = h1 + h2 < 2.0 * std::numbers::pi ? 1.0 : -1.0;
  return (h1 + h2) / 2.0 + turn * std::numbers::pi;
}

double chroma_weight(double chroma) {  // sqrt(C^7 / (C^7 + 25^7))
  const double c7 = std::pow(chroma, 7);
  return std::sqrt(c7 / (c7 + std::pow(25.0, 7)));
}

}  // namespace

Lab cielab(const Tristimulus& stimulus, const Tristimulus& white) {
  if (!(white.X > 0.0 && white.Y > 0.0 && white.Z > 0.0))
    throw std::invalid_argument("the white of CIELAB must be positive in X, Y and Z");
  const double x = cielab_response(stimulus.X / white.X);
  const double y = cielab_response(stimulus.Y / white.Y);
  const double z = cielab_response(stimulus.Z / white.Z);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

double ciede2000(const Lab& first, const Lab& second) {
  const double mean_chroma = (std::hypot(first.a, first.b) + std::hypot(second.a, second.b)) / 2.0;
  const double stretch = 1.5 - 0.5 * chroma_weight(mean_chroma);  // 1 + G, eqs (4), (5)
  const double a1 = stretch * first.a, a2 = stretch * second.a;
  const double c1 = std::hypot(a1, first.b), c2 = std::hypot(a2, second.b);
  const double h1 = hue_rad(a1, first.b), h2 = hue_rad(a2, second.b);
  const bool achromatic = c1 * c2 == 0.0;

  const double d_lightness = second.L - first.L;
  const double d_chroma = c2 - c1;
  const double d_hue = 2.0 * std::sqrt(c1 * c2) * std::sin(hue_step_rad(h1, h2, achromatic) / 2.0);

  const double c = (c1 + c2) / 2.0;
  const double h = mean_hue_rad(h1, h2, achromatic);
  const double t = 1.0 - 0.17 * std::cos(h - 30 * kDegree) + 0.24 * std::cos(2 * h) +
                   0.32 * std::cos(3 * h + 6 * kDegree) - 0.20 * std::cos(4 * h - 63 * kDegree);
  const double off = (first.L + second.L) / 2.0 - 50.0;
  const double s_l = 1.0 + 0.015 * off * off / std::sqrt(20.0 + off * off);
  const double s_c = 1.0 + 0.045 * c;
  const double s_h = 1.0 + 0.015 * c * t;
  const double blue = (h / kDegree - 275.0) / 25.0;
  const double rotation =
      -std::sin(60 * kDegree * std::exp(-blue * blue)) * 2.0 * chroma_weight(c);  // eqs (16)-(18)
  const double l = d_lightness / s_l, ch = d_chroma / s_c, hu = d_hue / s_h;
  return std::sqrt(l * l + ch * ch + hu * hu + rotation * ch * hu);
}

}  // namespace truebox
