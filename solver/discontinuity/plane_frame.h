// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "scene/polygon.h"

namespace truebox {

using Vec2 = Eigen::Vector2d;

/// A segment in the plane of a piece, m.
struct PlaneSegment {
  Vec2 from = Vec2::Zero(), to = Vec2::Zero();

  Vec2 direction() const { return (to - from).normalized(); }
  double length_m() const { return (to - from).norm(); }
};

inline double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Coordinates in the plane of a polygon, counter-clockwise as the polygon is.
class PlaneFrame {
 public:
  explicit PlaneFrame(const Polygon& polygon)
      : origin_(polygon[0]), normal_(plane_of(polygon).normal) {
    const Vec3 along = polygon[1] - polygon[0];
    u_ = (along - normal_.dot(along) * normal_).normalized();
    v_ = normal_.cross(u_);
  }

  Vec2 flat(const Vec3& x) const { return {u_.dot(x - origin_), v_.dot(x - origin_)}; }
  Vec3 in_space(const Vec2& x) const { return origin_ + x.x() * u_ + x.y() * v_; }
  const Vec3& normal() const { return normal_; }

 private:
  Vec3 origin_, normal_, u_, v_;
};

}  // namespace truebox
