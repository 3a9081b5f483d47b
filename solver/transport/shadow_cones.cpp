// SPDX-License-Identifier: BSD-3-Clause
#include "transport/shadow_cones.h"

#include <cmath>

namespace truebox {
namespace {

constexpr int kMostCorners = 12, kMostParts = 24;

// A convex polygon relative to the point, in fixed memory.
struct Part {
  std::array<Vec3, kMostCorners> corner;
  int count = 0;

  bool add(const Vec3& v) {
    if (count == kMostCorners) return false;
    corner[count++] = v;
    return true;
  }
};

struct Parts {
  std::array<Part, kMostParts> part;
  int count = 0;
};

// Splits at height 0: `above` >= 0, `below` <= 0. False if memory is short.
bool split(const Part& part, const std::array<double, kMostCorners>& height, Part& above,
           Part& below) {
  above.count = below.count = 0;
  bool fits = true;
  for (int k = 0; k < part.count; ++k) {
    const int next = k + 1 == part.count ? 0 : k + 1;
    if (height[k] >= 0.0) fits &= above.add(part.corner[k]);
    if (height[k] <= 0.0) fits &= below.add(part.corner[k]);
    if (height[k] * height[next] < 0.0) {
      const Vec3 x = part.corner[k] +
                     height[k] / (height[k] - height[next]) * (part.corner[next] - part.corner[k]);
      fits &= above.add(x) && below.add(x);
    }
  }
  return fits;
}

// Area times cos cos / r^4 at the centroid; the factors common to all parts are left out.
double kernel(const Part& part, const Vec3& normal, const Vec3& source_normal) {
  Vec3 moment = Vec3::Zero();
  double area = 0.0;
  for (int k = 2; k < part.count; ++k) {
    const Vec3 a = part.corner[k - 1] - part.corner[0], b = part.corner[k] - part.corner[0];
    const double twice = source_normal.dot(a.cross(b));
    moment += twice * (a + b);
    area += twice;
  }
  if (area <= 0.0) return 0.0;
  const Vec3 centre = part.corner[0] + moment / (3.0 * area);
  const double r2 = centre.squaredNorm();
  return area * normal.dot(centre) * -source_normal.dot(centre) / (r2 * r2);
}

class Subtraction {
 public:
  Subtraction(const Vec3& normal, const Vec3& source_normal)
      : normal_(normal), source_normal_(source_normal) {
    visible_->count = 1;
    visible_->part[0].count = 0;
  }

  Part& whole() { return visible_->part[0]; }

  bool subtract(const ShadowCone& cone) {
    rest_->count = 0;
    for (int k = 0; k < visible_->count; ++k)
      if (!subtract(cone, visible_->part[k], visible_->count == 1)) return false;
    if (!untouched_) std::swap(visible_, rest_);
    return true;
  }

  // Hidden over all, by the parts' own kernels: nothing visible is exactly 1.
  double share() const {
    double visible = 0.0;
    if (hidden_ == 0.0) return 0.0;
    for (int k = 0; k < visible_->count; ++k)
      visible += kernel(visible_->part[k], normal_, source_normal_);
    return hidden_ / (hidden_ + visible);
  }

 private:
  using Heights = std::array<double, kMostCorners>;

  bool keep(const Part& part) {
    if (part.count < 3) return true;
    if (rest_->count == kMostParts) return false;
    rest_->part[rest_->count++] = part;
    return true;
  }

  bool subtract(const ShadowCone& cone, const Part& part, bool is_only_part) {
    std::array<Heights, ShadowCone::kMostEdges + 1> height;
    std::array<bool, ShadowCone::kMostEdges + 1> cuts{};
    untouched_ = false;
    for (int e = 0; e <= cone.edges; ++e) {
      bool inside = false;
      for (int k = 0; k < part.count; ++k) {
        height[e][k] = height_of(cone, e, part.corner[k]);
        inside |= height[e][k] < 0.0;
        cuts[e] |= height[e][k] > 0.0;
      }
      if (inside) continue;
      untouched_ = is_only_part;  // beside the shadow, or before the blocker
      return untouched_ || keep(part);
    }
    const Part* left = &part;
    for (int e = 0; e <= cone.edges; ++e) {
      if (!cuts[e]) continue;
      if (left != &part)
        for (int k = 0; k < left->count; ++k) height[e][k] = height_of(cone, e, left->corner[k]);
      Part& below = left == &below_[0] ? below_[1] : below_[0];
      if (!split(*left, height[e], above_, below) || !keep(above_)) return false;
      left = &below;
      if (left->count < 3) return true;
    }
    hidden_ += kernel(*left, normal_, source_normal_);
    return true;
  }

  // Negative inside the shadow; edge cone.edges is the blocker's own plane.
  static double height_of(const ShadowCone& cone, int edge, const Vec3& v) {
    return edge < cone.edges ? cone.outward[edge].dot(v)
                             : cone.near_normal.dot(v) + cone.distance_m;
  }

  const Vec3& normal_;
  const Vec3& source_normal_;
  std::array<Parts, 2> memory_;
  Parts *visible_ = &memory_[0], *rest_ = &memory_[1];
  std::array<Part, 2> below_;
  Part above_;
  double hidden_ = 0.0;
  bool untouched_ = false;
};

}  // namespace

bool ShadowCone::make(const Vec3& point, const Blocker& blocker, ShadowCone& cone) {
  const double distance = blocker.plane.distance_m(point), side = distance > 0.0 ? 1.0 : -1.0;
  cone.edges = static_cast<int>(blocker.polygon.size());
  if (cone.edges > kMostEdges) return false;
  cone.distance_m = std::abs(distance);
  cone.near_normal = side * blocker.plane.normal;
  Vec3 a = blocker.polygon.back() - point;
  for (int k = 0; k < cone.edges; ++k) {
    const Vec3 b = blocker.polygon[static_cast<std::size_t>(k)] - point;
    cone.outward[k] = side * a.cross(b);
    a = b;
  }
  return distance != 0.0;
}

double hidden_share(const Vec3& point, const Vec3& normal, const PlanarPolygon& source,
                    std::span<const ShadowCone* const> cones) {
  if (source.vertices.size() > kMostCorners) return -1.0;
  Subtraction work(normal, source.plane.normal);
  for (const Vec3& v : source.vertices) work.whole().add(v - point);
  for (const ShadowCone* cone : cones)
    if (!work.subtract(*cone)) return -1.0;
  return work.share();
}

}  // namespace truebox
