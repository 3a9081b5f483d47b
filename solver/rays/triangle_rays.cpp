// SPDX-License-Identifier: BSD-3-Clause
#include "rays/triangle_rays.h"

#include <embree3/rtcore.h>

#include <limits>
#include <stdexcept>

namespace truebox {

struct TriangleRays::Implementation {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Vec3 centre = Vec3::Zero();
  double scale = 1.0;
  double diagonal_m = 0.0;

  ~Implementation() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  Vec3 unit(const Vec3& point) const { return scale * (point - centre); }

  void add(const TriangleGroup& group, unsigned id) {
    if (group.triangles.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               3 * group.triangles.size()));
    auto* index = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), group.triangles.size()));
    unsigned next = 0;
    for (const Triangle& triangle : group.triangles)
      for (const Vec3& corner : triangle) {
        const Vec3 at = unit(corner);
        for (int k = 0; k < 3; ++k) *vertex++ = static_cast<float>(at[k]);
        *index++ = next++;
      }
    rtcSetGeometryMask(geometry, group.mask);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }

  static void set(RTCRay& ray, const Vec3& origin, const Vec3& direction, std::uint32_t mask) {
    ray.org_x = static_cast<float>(origin.x());
    ray.org_y = static_cast<float>(origin.y());
    ray.org_z = static_cast<float>(origin.z());
    ray.dir_x = static_cast<float>(direction.x());
    ray.dir_y = static_cast<float>(direction.y());
    ray.dir_z = static_cast<float>(direction.z());
    ray.tnear = 0.0f;
    ray.mask = mask;
  }
};

TriangleRays::TriangleRays(const std::vector<TriangleGroup>& groups)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  Eigen::AlignedBox3d box;
  for (const TriangleGroup& group : groups)
    for (const Triangle& triangle : group.triangles)
      for (const Vec3& v : triangle) box.extend(v);
  if (box.isEmpty()) throw std::invalid_argument("a scene without surfaces");
  self.centre = box.center();
  self.diagonal_m = box.diagonal().norm();
  self.scale = 2.0 / self.diagonal_m;
  self.device = rtcNewDevice(nullptr);
  if (!self.device) throw std::runtime_error("Embree cannot start");
  self.scene = rtcNewScene(self.device);
  rtcSetSceneFlags(self.scene, RTC_SCENE_FLAG_ROBUST);
  for (unsigned id = 0; id < groups.size(); ++id) self.add(groups[id], id);
  rtcCommitScene(self.scene);
}

TriangleRays::~TriangleRays() = default;
TriangleRays::TriangleRays(TriangleRays&&) noexcept = default;
TriangleRays& TriangleRays::operator=(TriangleRays&&) noexcept = default;

double TriangleRays::diagonal_m() const { return implementation_->diagonal_m; }

std::optional<TriangleRays::Hit> TriangleRays::first_hit(const Vec3& origin, const Vec3& direction,
                                                         std::uint32_t mask) const {
  const Implementation& self = *implementation_;
  RTCRayHit query{};
  Implementation::set(query.ray, self.unit(origin), direction, mask);
  query.ray.tfar = std::numeric_limits<float>::infinity();
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(self.scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{query.hit.geomID, query.hit.primID, query.ray.tfar / self.scale};
}

bool TriangleRays::occluded(const Vec3& from, const Vec3& to, std::uint32_t mask) const {
  const Implementation& self = *implementation_;
  const Vec3 a = self.unit(from);
  RTCRay ray{};
  Implementation::set(ray, a, self.unit(to) - a, mask);
  ray.tfar = 1.0f;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(self.scene, &context, &ray);
  return ray.tfar < 0.0f;
}

std::vector<Triangle> fan(const Polygon& polygon) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    triangles.push_back({polygon[0], polygon[i - 1], polygon[i]});
  return triangles;
}

}  // namespace truebox
