// SPDX-License-Identifier: BSD-3-Clause
#include "transport/shadow_cones.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "transport/many_targets.h"

namespace truebox {
namespace {

constexpr int kMostCorners = 12, kMostParts = 24;

// A convex polygon in fixed memory.
struct Part {
  std::array<Vec3, kMostCorners> corner;
  int count = 0;

  bool add(const Vec3& v) {
    if (count == kMostCorners) return false;
    corner[count++] = v;
    return true;
  }
  std::span<const Vec3> corners() const { return {corner.data(), static_cast<std::size_t>(count)}; }
};

struct Parts {
  std::array<Part, kMostParts> part;
  int count = 0;

  Part* add() { return count == kMostParts ? nullptr : &part[count++]; }
};

using Heights = std::array<double, kMostCorners>;

// Splits at height 0: `above` >= 0, `below` <= 0. False if memory is short.
bool split(const Part& part, const Heights& height, Part& above, Part& below) {
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

// The part behind a plane of the cone. False if memory is short.
bool keep_behind(const Part& part, const ShadowCone& cone, int plane, Part& kept) {
  kept.count = 0;
  const Vec3* previous = &part.corner[part.count - 1];
  double height_before = cone.distance_m(plane, *previous);
  for (int k = 0; k < part.count; ++k) {
    const Vec3& v = part.corner[k];
    const double height = cone.distance_m(plane, v);
    if (height_before * height < 0.0 &&
        !kept.add(*previous + height_before / (height_before - height) * (v - *previous)))
      return false;
    if (height <= 0.0 && !kept.add(v)) return false;
    previous = &v;
    height_before = height;
  }
  return true;
}

// cos cos / r^4 without the lengths of the normals.
double kernel_at(const Vec3& r, const Vec3& normal, const Vec3& source_normal) {
  const double r2 = r.squaredNorm();
  return normal.dot(r) * -source_normal.dot(r) / (r2 * r2);
}

// Area times the kernel at the centroid; the factors common to all parts are left out.
double kernel(const Part& part, const Vec3& point, const Vec3& normal, const Vec3& source_normal) {
  Vec3 moment = Vec3::Zero();
  double area = 0.0;
  for (int k = 2; k < part.count; ++k) {
    const Vec3 a = part.corner[k - 1] - part.corner[0], b = part.corner[k] - part.corner[0];
    const double twice = source_normal.dot(a.cross(b));
    moment += twice * (a + b);
    area += twice;
  }
  if (area <= 0.0) return 0.0;
  return 0.5 * area *
         kernel_at(part.corner[0] - point + moment / (3.0 * area), normal, source_normal);
}

double factor_of(const Parts& parts, const Vec3& point, const Vec3& normal) {
  double sum = 0.0;
  for (int k = 0; k < parts.count; ++k)
    sum += point_to_polygon(point, normal, parts.part[static_cast<std::size_t>(k)].corners());
  return sum;
}

}  // namespace

struct ShadowParts::Memory {
  Parts hidden;
  std::array<Parts, 2> pool;
  Parts *visible = &pool[0], *rest = &pool[1];
  std::array<Part, 2> below;
  Part above;

  // What the cone leaves of one visible part, into `rest`.
  bool subtract(const ShadowCone& cone, const Part& part) {
    std::array<Heights, ShadowCone::kMostPlanes> height;
    std::array<bool, ShadowCone::kMostPlanes> cuts{};
    for (int p = 0; p < cone.count; ++p) {
      bool behind = false;
      for (int k = 0; k < part.count; ++k) {
        height[p][k] = cone.distance_m(p, part.corner[k]);
        behind |= height[p][k] < 0.0;
        cuts[p] |= height[p][k] > 0.0;
      }
      if (!behind) return keep(*rest, part);
    }
    const Part* left = &part;
    for (int p = 0; p < cone.count; ++p) {
      if (!cuts[p]) continue;
      if (left != &part)
        for (int k = 0; k < left->count; ++k) height[p][k] = cone.distance_m(p, left->corner[k]);
      Part& next = left == &below[0] ? below[1] : below[0];
      if (!split(*left, height[p], above, next) || !keep(*rest, above)) return false;
      left = &next;
      if (left->count < 3) return true;
    }
    return keep(hidden, *left);
  }

  static bool keep(Parts& parts, const Part& part) {
    if (part.count < 3) return true;
    Part* place = parts.add();
    if (place) *place = part;
    return place != nullptr;
  }
};

ShadowParts::ShadowParts() : memory_(std::make_unique<Memory>()) {}
ShadowParts::ShadowParts(ShadowParts&&) noexcept = default;
ShadowParts::~ShadowParts() = default;

bool ShadowParts::cut(std::span<const Vec3> source, std::span<const ShadowCone* const> cones) {
  Memory& m = *memory_;
  if (source.size() > kMostCorners) return false;
  m.hidden.count = 0;
  m.visible->count = 1;
  m.visible->part[0].count = 0;
  for (const Vec3& v : source) m.visible->part[0].add(v);
  for (const ShadowCone* cone : cones) {
    m.rest->count = 0;
    for (int k = 0; k < m.visible->count; ++k)
      if (!m.subtract(*cone, m.visible->part[k])) return false;
    std::swap(m.visible, m.rest);
  }
  return true;
}

double ShadowParts::hidden_share(const PlanarPolygon& source, const ShadowCone& cone,
                                 std::uint32_t cuts, const Vec3& point, const Vec3& normal) {
  std::array<Part, 2>& part = memory_->below;
  if (source.vertices.size() > kMostCorners) return -1.0;
  int at = 0;
  part[0].count = 0;
  for (const Vec3& v : source.vertices) part[0].add(v);
  for (; cuts != 0; cuts &= cuts - 1) {
    if (!keep_behind(part[at], cone, std::countr_zero(cuts), part[1 - at])) return -1.0;
    at = 1 - at;
    if (part[at].count < 3) return 0.0;
  }
  const Vec3& source_normal = source.plane.normal;
  const double whole = source.area_m2 * kernel_at(source.centroid - point, normal, source_normal);
  return std::min(1.0, kernel(part[at], point, normal, source_normal) / whole);
}

double ShadowParts::hidden_share(const Vec3& point, const Vec3& normal,
                                 const Vec3& source_normal) const {
  double hidden = 0.0, visible = 0.0;
  for (int k = 0; k < memory_->hidden.count; ++k)
    hidden += kernel(memory_->hidden.part[k], point, normal, source_normal);
  if (hidden == 0.0) return 0.0;
  for (int k = 0; k < memory_->visible->count; ++k)
    visible += kernel(memory_->visible->part[k], point, normal, source_normal);
  return hidden / (hidden + visible);
}

double ShadowParts::visible_share(const PlanarPolygon& source,
                                  std::span<const ShadowCone* const> cones, std::uint32_t cuts,
                                  const Vec3& point, const Vec3& normal, bool near, double whole) {
  if (cones.size() == 1 && !near) {
    const double hidden = hidden_share(source, *cones[0], cuts, point, normal);
    if (hidden >= 0.0) return 1.0 - hidden;
  }
  if (!cut(source.vertices, cones)) return -1.0;
  if (!near) return 1.0 - hidden_share(point, normal, source.plane.normal);
  return whole > 0.0 ? visible_factor(point, normal) / whole : 0.0;
}

double ShadowParts::visible_factor(const Vec3& point, const Vec3& normal) const {
  return factor_of(*memory_->visible, point, normal);
}

double ShadowParts::hidden_factor(const Vec3& point, const Vec3& normal) const {
  return factor_of(memory_->hidden, point, normal);
}

ShadowCone::Hides ShadowCone::make(const Vec3& point, const Vec3& normal,
                                   const ConvexOccluder& solid, double tolerance_m,
                                   ShadowCone& cone) {
  constexpr std::size_t kMostFaces = 64;
  std::array<bool, kMostFaces> sees{};
  cone.count = 0;
  if (solid.faces.size() > kMostFaces) return Hides::region;
  bool any = false, looks_out = false;
  const auto add = [&](const Vec3& n, double offset) {
    const auto at = static_cast<std::size_t>(cone.count++);
    if (at >= kMostPlanes) return;
    cone.x[at] = n.x();
    cone.y[at] = n.y();
    cone.z[at] = n.z();
    cone.offset_m[at] = offset;
  };
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    const Plane& face = solid.faces[f];
    const double height = face.distance_m(point);
    sees[f] = height > tolerance_m;
    looks_out |= height >= -tolerance_m && normal.dot(face.normal) > 0.0;
    any |= sees[f];
  }
  if (!any) return looks_out ? Hides::nothing : Hides::all;
  for (const ConvexOccluder::Edge& edge : solid.edges) {
    if (sees[edge.left] == sees[edge.right]) continue;
    const Vec3 across = (edge.a - point).cross(edge.b - point);
    const double length = sees[edge.left] ? across.norm() : -across.norm();
    if (length != 0.0) add(across / length, across.dot(point) / length);
  }
  for (std::size_t f = 0; f < solid.faces.size(); ++f)
    if (sees[f]) add(solid.faces[f].normal, solid.faces[f].offset_m - tolerance_m);
  if (cone.count > kMostPlanes) cone.count = 0;
  const int planes = cone.count;
  while (cone.count % 4 != 0) add(Vec3::Zero(), std::numeric_limits<double>::max());
  cone.count = planes;
  return Hides::region;
}

namespace {

// Four doubles at once, in whatever registers the machine has.
using Four [[gnu::vector_size(32)]] = double;
using FourBits [[gnu::vector_size(32)]] = long long;

[[gnu::always_inline]] inline Four load(const std::array<double, ShadowCone::kMostPlanes>& values,
                                        int at) {
  Four four;
  __builtin_memcpy(&four, values.data() + at, sizeof(four));
  return four;
}

// One bit for each lane.
[[gnu::always_inline]] inline std::uint32_t bits_of(const FourBits& lanes) {
  return static_cast<std::uint32_t>((lanes[0] & 1) | (lanes[1] & 2) | (lanes[2] & 4) |
                                    (lanes[3] & 8));
}

}  // namespace

// A sphere about the polygon decides most cases.
TRUEBOX_MANY_TARGETS ShadowTest test_shadow(const ShadowCone& cone, const PlanarPolygon& polygon) {
  const Vec3& c = polygon.centroid;
  const double r = polygon.radius_m;
  FourBits beyond = {0, 0, 0, 0}, reached = {0, 0, 0, 0};
  for (int p = 0; p < cone.count; p += 4) {
    const Four height = load(cone.x, p) * c.x() + load(cone.y, p) * c.y() +
                        load(cone.z, p) * c.z() - load(cone.offset_m, p);
    beyond |= height >= r;
    reached |= height > -r;
  }
  if (bits_of(beyond)) return {ShadowSide::outside, 0};
  if (!bits_of(reached)) return {ShadowSide::inside, 0};
  ShadowTest result;
  for (int p = 0; p < cone.count; p += 4) {
    const Four x = load(cone.x, p), y = load(cone.y, p), z = load(cone.z, p);
    const Four offset = load(cone.offset_m, p);
    FourBits behind = {0, 0, 0, 0}, front = {0, 0, 0, 0};
    for (const Vec3& v : polygon.vertices) {
      const Four height = x * v.x() + y * v.y() + z * v.z() - offset;
      behind |= height < 0.0;
      front |= height > 0.0;
    }
    if (bits_of(behind) != 15u) return {ShadowSide::outside, 0};
    result.cuts |= bits_of(front) << p;
  }
  result.side = result.cuts ? ShadowSide::across : ShadowSide::inside;
  return result;
}

}  // namespace truebox
