// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/lens.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace truebox {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kWidestAngle = 89.9 * kDegree;  // a plane image cannot reach 90 degrees
constexpr double kAngleStep = 0.1 * kDegree;
constexpr int kAzimuths = 72;

double denominator(const LensDistortion& c, double r2) {
  return 1.0 + r2 * (c.k4 + r2 * (c.k5 + r2 * c.k6));
}

// Smaller eigenvalue of the Jacobian's symmetric part; negative where the model has a pole.
double least_stretch(const LensDistortion& c, const NormalisedPoint& p) {
  if (!(denominator(c, p.x * p.x + p.y * p.y) > 0.0)) return -1.0;
  const auto j = distortion_jacobian(c, p);
  return 0.5 * (j[0] + j[3]) - std::hypot(0.5 * (j[0] - j[3]), 0.5 * (j[1] + j[2]));
}

// The radius at which the least stretch first vanishes along one azimuth, at most `limit`.
double fold_radius(const LensDistortion& c, double azimuth, double limit) {
  const double cosine = std::cos(azimuth), sine = std::sin(azimuth);
  const auto folded = [&](double r) { return !(least_stretch(c, {r * cosine, r * sine}) > 0.0); };
  double low = 0.0;
  for (int step = 1; low < limit; ++step) {
    double high = std::min(std::tan(std::min(step * kAngleStep, kWidestAngle)), limit);
    if (folded(high)) {
      while (high - low > 2e-16 * high) {
        const double middle = 0.5 * (low + high);
        if (middle == low || middle == high) break;
        (folded(middle) ? high : low) = middle;
      }
      return low;
    }
    low = high;
  }
  return limit;
}

NormalisedPoint difference(const NormalisedPoint& a, const NormalisedPoint& b) {
  return {a.x - b.x, a.y - b.y};
}

double length(const NormalisedPoint& p) { return std::hypot(p.x, p.y); }

}  // namespace

std::array<double, 4> distortion_jacobian(const LensDistortion& c, const NormalisedPoint& p) {
  const double x = p.x, y = p.y, r2 = x * x + y * y;
  const double a = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3)), b = denominator(c, r2);
  const double da = c.k1 + r2 * (2.0 * c.k2 + r2 * 3.0 * c.k3);
  const double db = c.k4 + r2 * (2.0 * c.k5 + r2 * 3.0 * c.k6);
  const double g = a / b, dg = (da * b - a * db) / (b * b);  // dg / d(r^2)
  const double cross = 2.0 * x * y * dg + 2.0 * c.p1 * x + 2.0 * c.p2 * y;
  const double prism_x = 2.0 * (c.s1 + 2.0 * c.s2 * r2), prism_y = 2.0 * (c.s3 + 2.0 * c.s4 * r2);
  return {g + 2.0 * x * x * dg + 2.0 * c.p1 * y + 6.0 * c.p2 * x + prism_x * x, cross + prism_x * y,
          cross + prism_y * x,
          g + 2.0 * y * y * dg + 6.0 * c.p1 * y + 2.0 * c.p2 * x + prism_y * y};
}

Lens::Lens(const LensDistortion& c)
    : distortion_(c), field_radius_(std::numeric_limits<double>::infinity()) {
  for (double v : {c.p1, c.p2, c.s1, c.s2, c.s3, c.s4}) radial_ &= v == 0.0;
  identity_ = radial_;
  for (double v : {c.k1, c.k2, c.k3, c.k4, c.k5, c.k6}) identity_ &= v == 0.0;
  if (identity_) return;
  field_radius_ = std::tan(kWidestAngle);
  const int azimuths = radial_ ? 1 : kAzimuths;
  for (int k = 0; k < azimuths; ++k)
    field_radius_ = fold_radius(c, 2.0 * std::numbers::pi * k / azimuths, field_radius_);
  if (!radial_) field_radius_ *= 0.999;
}

Lens::Result Lens::distort(const NormalisedPoint& direction) const {
  if (!(length(direction) <= field_radius_)) return {LensOutcome::outside_field, {}};
  return {LensOutcome::ok, distorted(distortion_, direction)};
}

// Solves r'' = image_radius for the radial part alone, which rises all over the field: its Jacobian
// is the mean of the whole lens' over opposite directions.
double Lens::radial_start(double image_radius) const {
  LensDistortion radial = distortion_;
  radial.p1 = radial.p2 = radial.s1 = radial.s2 = radial.s3 = radial.s4 = 0.0;
  double low = 0.0, high = field_radius_, r = std::min(image_radius, high);
  for (int i = 0; i < 200 && high - low > 4e-16 * high; ++i) {
    const double excess = distorted(radial, {r, 0.0}).x - image_radius;
    if (excess == 0.0) break;
    (excess > 0.0 ? high : low) = r;
    const double next = r - excess / distortion_jacobian(radial, {r, 0.0})[0];
    if (std::abs(next - r) <= 1e-16 * r) break;
    r = next > low && next < high ? next : 0.5 * (low + high);
  }
  return r;
}

Lens::Result Lens::undistort(const NormalisedPoint& image) const {
  if (identity_) return {LensOutcome::ok, image};
  const double image_radius = length(image);
  if (!std::isfinite(image_radius)) return {LensOutcome::outside_field, {}};
  if (image_radius == 0.0) return {LensOutcome::ok, image};  // every term vanishes on the axis
  const double start = radial_start(image_radius) / image_radius;
  NormalisedPoint p{start * image.x, start * image.y};
  NormalisedPoint error = difference(distorted(distortion_, p), image);
  double step_length = std::numeric_limits<double>::infinity();
  // Damped Newton: a step is halved until it stays in the field and brings the point nearer.
  for (int i = 0; i < 100; ++i) {
    const auto j = distortion_jacobian(distortion_, p);
    const double determinant = j[0] * j[3] - j[1] * j[2];
    const NormalisedPoint step{(j[3] * error.x - j[1] * error.y) / determinant,
                               (j[0] * error.y - j[2] * error.x) / determinant};
    step_length = length(step);
    bool nearer = false;
    for (double share = 1.0; !nearer && share > 1e-12; share *= 0.5) {
      const NormalisedPoint next{p.x - share * step.x, p.y - share * step.y};
      if (!(length(next) <= field_radius_)) continue;
      const NormalisedPoint next_error = difference(distorted(distortion_, next), image);
      if (!(length(next_error) < length(error))) continue;
      p = next;
      error = next_error;
      nearer = true;
    }
    if (!nearer) break;  // at rounding, or at the border of the field
  }
  const bool found =
      length(error) <= 1e-14 * (1.0 + image_radius) || step_length <= 1e-15 * length(p);
  if (!found) return {LensOutcome::outside_field, {}};
  return {LensOutcome::ok, p};
}

}  // namespace truebox
