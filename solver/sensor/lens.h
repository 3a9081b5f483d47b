// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "scene/camera_description.h"

namespace truebox {

/// A direction in normalised image coordinates: x = X / Z right, y = Y / Z down, in the camera's
/// frame; dimensionless.
template <class T>
struct NormalisedPointOf {
  T x{}, y{};
};
using NormalisedPoint = NormalisedPointOf<double>;

/// Where the lens images a direction, in the same coordinates. With r^2 = x^2 + y^2:
///   x'' = x g + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
///   y'' = y g + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4
///   g = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
/// The bare formula, also where the model folds over; any number type, so that an optimiser can
/// differentiate it. Source: OpenCV 4 documentation, module calib3d, "Detailed Description".
template <class T>
NormalisedPointOf<T> distorted(const LensDistortionOf<T>& c, const NormalisedPointOf<T>& p) {
  const T r2 = p.x * p.x + p.y * p.y, r4 = r2 * r2;
  const T g =
      (1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3))) / (1.0 + r2 * (c.k4 + r2 * (c.k5 + r2 * c.k6)));
  return {p.x * g + 2.0 * c.p1 * p.x * p.y + c.p2 * (r2 + 2.0 * p.x * p.x) + c.s1 * r2 + c.s2 * r4,
          p.y * g + c.p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * c.p2 * p.x * p.y + c.s3 * r2 + c.s4 * r4};
}

/// d(x'', y'') / d(x, y), row by row.
std::array<double, 4> distortion_jacobian(const LensDistortion& c, const NormalisedPoint& p);

enum class LensOutcome {
  not_run,
  ok,
  behind_camera,  ///< the point is not in front of the pinhole
  outside_field,  ///< no light arrives there: beyond the radius at which the model folds over
};

/// The lens model on the field where it can be inverted.
///
/// A polynomial distortion folds over far from the axis: two directions fall on one point of the
/// film. The field is the largest disc about the axis on which the symmetric part of the Jacobian
/// is positive definite; on a convex set that makes the map one-to-one (Ortega, Rheinboldt 1970,
/// theorem 5.4.3). For purely radial lenses this is exactly r up to the first extremum of r''(r).
/// The disc is found by a search over radius (0.1 deg) and, with p or s coefficients, azimuth
/// (5 deg; 0.1 % of the radius is given away for what lies between).
class Lens {
 public:
  explicit Lens(const LensDistortion& distortion);

  struct Result {
    LensOutcome outcome = LensOutcome::not_run;
    NormalisedPoint point;  ///< meaningless unless the outcome is ok
  };
  Result distort(const NormalisedPoint& direction) const;

  /// The inverse, to rounding: |distorted(point) - image| <= 1e-14 (1 + |image|), or a Newton step
  /// below 1e-15 |point| where the model is steep.
  Result undistort(const NormalisedPoint& image) const;

  /// Radius of the field, tangent of the angle to the axis; infinite without distortion.
  double field_radius() const { return field_radius_; }

 private:
  double radial_start(double image_radius) const;

  LensDistortion distortion_;
  bool identity_ = true, radial_ = true;
  double field_radius_;
};

}  // namespace truebox
