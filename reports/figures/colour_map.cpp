// SPDX-License-Identifier: BSD-3-Clause
#include "figures/colour_map.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

std::uint8_t to_byte(double v) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0, 1.0) * 255.0));
}

// Moreland (2009), table 1: both ends of the cool-warm map in Msh, and its white point.
constexpr double kEndMagnitude = 80.0, kEndSaturation = 1.08;
constexpr double kCoolHue = -1.1, kWarmHue = 0.5;
constexpr double kMiddleMagnitude = 88.0;

/// The hue that the unsaturated end must have so that the path does not bend (his AdjustHue).
double unsaturated_hue(double hue) {
  const double spin =
      kEndSaturation *
      std::sqrt(kMiddleMagnitude * kMiddleMagnitude - kEndMagnitude * kEndMagnitude) /
      (kEndMagnitude * std::sin(kEndSaturation));
  return hue > -1.0471975511965976 ? hue + spin : hue - spin;
}

double lab_to_ratio(double f) {
  constexpr double kDelta = 6.0 / 29.0;
  return f > kDelta ? f * f * f : 3.0 * kDelta * kDelta * (f - 4.0 / 29.0);
}

double srgb_encode(double v) {
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

Rgb8 lab_to_srgb(double l, double a, double b) {
  const double fy = (l + 16.0) / 116.0;
  const double x = 0.95047 * lab_to_ratio(fy + a / 500.0);
  const double y = lab_to_ratio(fy);
  const double z = 1.08883 * lab_to_ratio(fy - b / 200.0);
  const double r = 3.2404542 * x - 1.5371385 * y - 0.4985314 * z;
  const double g = -0.9692660 * x + 1.8760108 * y + 0.0415560 * z;
  const double bl = 0.0556434 * x - 0.2040259 * y + 1.0572252 * z;
  return {to_byte(srgb_encode(r)), to_byte(srgb_encode(g)), to_byte(srgb_encode(bl))};
}

}  // namespace

Rgb8 sequential_colour(double t) {
  if (!std::isfinite(t)) t = t > 0.0 ? 1.0 : 0.0;
  t = std::clamp(t, 0.0, 1.0);
  constexpr double kFit[7][3] = {{0.2777273272234177, 0.005407344544966578, 0.3340998053353061},
                                 {0.1050930431085774, 1.404613529898575, 1.384590162594685},
                                 {-0.3308618287255563, 0.214847559468213, 0.09509516302823659},
                                 {-4.634230498983486, -5.799100973351585, -19.33244095627987},
                                 {6.228269936347081, 14.17993336680509, 56.69055260068105},
                                 {4.776384997670288, -13.74514537774601, -65.35303263337234},
                                 {-5.435455855934631, 4.645852612178535, 26.3124352495832}};
  Rgb8 colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    double v = 0.0;
    for (int degree = 6; degree >= 0; --degree) v = v * t + kFit[degree][c];
    colour[c] = to_byte(v);
  }
  return colour;
}

Rgb8 diverging_colour(double t) {
  t = std::clamp(t, -1.0, 1.0);
  const double away = std::abs(t);
  const double end_hue = t < 0.0 ? kCoolHue : kWarmHue;
  const double magnitude = kMiddleMagnitude + away * (kEndMagnitude - kMiddleMagnitude);
  const double saturation = away * kEndSaturation;
  const double hue = unsaturated_hue(end_hue) * (1.0 - away) + end_hue * away;
  return lab_to_srgb(magnitude * std::cos(saturation),
                     magnitude * std::sin(saturation) * std::cos(hue),
                     magnitude * std::sin(saturation) * std::sin(hue));
}

}  // namespace truebox
