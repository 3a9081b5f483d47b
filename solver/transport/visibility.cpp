// SPDX-License-Identifier: BSD-3-Clause
#include "transport/visibility.h"

#include <embree3/rtcore.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace truebox {

namespace {
constexpr unsigned kSurfaceMask = 1, kOpeningMask = 2;
}

struct Visibility::Implementation {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const PatchMesh* mesh = nullptr;
  Vec3 centre = Vec3::Zero();
  double scale = 1.0;
  double offset_m = 0.0;
  std::vector<std::uint32_t> piece_of[2];  // triangle -> piece: surfaces, openings
  std::vector<std::uint32_t> back_of;      // piece -> the piece on its back, or itself

  // The two sides of a surface are one sheet: rays meet the front, `back_of` names the other.
  void pair_sides(const Scene& truebox_scene) {
    back_of.resize(mesh->pieces.size());
    for (std::uint32_t p = 0; p < back_of.size(); ++p) back_of[p] = p;
    for (std::uint32_t first = 0; first < back_of.size();) {
      const std::size_t s = mesh->pieces[first].surface;
      const auto count = static_cast<std::uint32_t>(truebox_scene.surfaces[s].pieces.size());
      if (truebox_scene.surfaces[s].two_sided)
        for (std::uint32_t k = 0; k < count / 2; ++k) {
          back_of[first + k] = first + k + count / 2;
          back_of[first + k + count / 2] = first + k;
        }
      first += count;
    }
  }

  ~Implementation() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  Vec3 unit(const Vec3& point) const { return scale * (point - centre); }

  void add(const Scene& truebox_scene, bool openings) {
    std::vector<float> vertices;
    std::vector<unsigned> triangles;
    auto& pieces = piece_of[openings ? 1 : 0];
    for (std::uint32_t p = 0; p < mesh->pieces.size(); ++p) {
      const Piece& piece = mesh->pieces[p];
      if (truebox_scene.surfaces[piece.surface].is_opening != openings) continue;
      if (back_of[p] < p) continue;  // the front stands for both
      const auto first = static_cast<unsigned>(vertices.size() / 3);
      for (const Vec3& v : piece.polygon)
        for (int k = 0; k < 3; ++k) vertices.push_back(static_cast<float>(unit(v)[k]));
      for (unsigned i = 2; i < piece.polygon.size(); ++i) {
        triangles.insert(triangles.end(), {first, first + i - 1, first + i});
        pieces.push_back(p);
      }
    }
    if (triangles.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                          RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                          vertices.size() / 3));
    auto* t = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                             RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                                             triangles.size() / 3));
    std::copy(vertices.begin(), vertices.end(), v);
    std::copy(triangles.begin(), triangles.end(), t);
    rtcSetGeometryMask(geometry, openings ? kOpeningMask : kSurfaceMask);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, openings ? 1 : 0);
    rtcReleaseGeometry(geometry);
  }
};

Visibility::Visibility(const PatchMesh& mesh, const Scene& scene)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.mesh = &mesh;
  Eigen::AlignedBox3d box;
  for (const Piece& piece : mesh.pieces)
    for (const Vec3& v : piece.polygon) box.extend(v);
  if (box.isEmpty()) throw std::invalid_argument("a scene without surfaces");
  self.centre = box.center();
  self.scale = 2.0 / box.diagonal().norm();
  self.offset_m = 4e-6 * box.diagonal().norm();
  self.device = rtcNewDevice(nullptr);
  if (!self.device) throw std::runtime_error("Embree cannot start");
  self.scene = rtcNewScene(self.device);
  rtcSetSceneFlags(self.scene, RTC_SCENE_FLAG_ROBUST);
  self.pair_sides(scene);
  self.add(scene, false);
  self.add(scene, true);
  rtcCommitScene(self.scene);
}

Visibility::~Visibility() = default;
Visibility::Visibility(Visibility&&) noexcept = default;

double Visibility::offset_m() const { return implementation_->offset_m; }

bool Visibility::occluded(const Vec3& from, const Vec3& from_normal, const Vec3& to,
                          const Vec3& to_normal) const {
  const Implementation& self = *implementation_;
  const Vec3 a = self.unit(from + self.offset_m * from_normal);
  const Vec3 d = self.unit(to + self.offset_m * to_normal) - a;
  RTCRay ray{};
  ray.org_x = static_cast<float>(a.x());
  ray.org_y = static_cast<float>(a.y());
  ray.org_z = static_cast<float>(a.z());
  ray.dir_x = static_cast<float>(d.x());
  ray.dir_y = static_cast<float>(d.y());
  ray.dir_z = static_cast<float>(d.z());
  ray.tnear = 0.0f;
  ray.tfar = 1.0f;
  ray.mask = kSurfaceMask;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(self.scene, &context, &ray);
  return ray.tfar < 0.0f;
}

std::optional<Visibility::Hit> Visibility::first_hit(const Vec3& origin, const Vec3& direction,
                                                     bool with_openings) const {
  const Implementation& self = *implementation_;
  const Vec3 a = self.unit(origin);
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(a.x());
  query.ray.org_y = static_cast<float>(a.y());
  query.ray.org_z = static_cast<float>(a.z());
  query.ray.dir_x = static_cast<float>(direction.x());
  query.ray.dir_y = static_cast<float>(direction.y());
  query.ray.dir_z = static_cast<float>(direction.z());
  query.ray.tnear = 0.0f;
  query.ray.tfar = std::numeric_limits<float>::infinity();
  query.ray.mask = with_openings ? kSurfaceMask | kOpeningMask : kSurfaceMask;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(self.scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  Hit hit;
  hit.piece = self.piece_of[query.hit.geomID][query.hit.primID];
  if (self.mesh->pieces[hit.piece].plane.normal.dot(direction) > 0.0)
    hit.piece = self.back_of[hit.piece];
  const Plane& plane = self.mesh->pieces[hit.piece].plane;
  const double cosine = plane.normal.dot(direction);
  hit.front = cosine < 0.0;
  hit.distance_m = query.ray.tfar / self.scale;
  // Away from grazing rays the plane's own equation is far better than float.
  if (std::abs(cosine) > 1e-3) hit.distance_m = -plane.distance_m(origin) / cosine;
  hit.point = origin + hit.distance_m * direction;
  return hit;
}

}  // namespace truebox
