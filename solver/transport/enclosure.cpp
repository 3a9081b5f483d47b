// SPDX-License-Identifier: BSD-3-Clause
#include "transport/enclosure.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <optional>

#include "mesh/contact_lines.h"

namespace truebox {
namespace {

constexpr int kRaysOfBuried =
    512;  // an element that sees 1 % is taken for buried once in 170 times
constexpr double kNegligibleCover = 1e-3;  // below, what lacks may be the quadrature's error

// The underside of a block that stands on a floor: a surface of opposite normal at this point.
bool lies_on_a_back(const PatchMesh& mesh, const Scene& scene, std::size_t i, const Vec3& centre) {
  const double tolerance_m = 1e-9 * scene.diameter_m();
  const Vec3& normal = mesh.plane_of(mesh.patches[i]).normal;
  for (const Piece& piece : mesh.pieces) {
    if (std::abs(piece.plane.distance_m(centre)) > tolerance_m ||
        piece.plane.normal.dot(normal) > -1.0 + 1e-9 || scene.surfaces[piece.surface].is_opening)
      continue;
    bool inside = true;
    const std::size_t n = piece.polygon.size();
    for (std::size_t k = 0; k < n && inside; ++k) {
      const Vec3& a = piece.polygon[k];
      inside = piece.plane.normal.cross(piece.polygon[(k + 1) % n] - a).dot(centre - a) > 0.0;
    }
    if (inside) return true;
  }
  return false;
}

// Cosine-distributed rays from points spread evenly over an element.
class ElementRays {
 public:
  ElementRays(const PatchMesh& mesh, const Visibility& visibility, std::size_t patch,
              std::uint64_t seed)
      : visibility_(visibility),
        n_(mesh.plane_of(mesh.patches[patch]).normal),
        t_(n_.unitOrthogonal()),
        state_(hash(seed + 77 + patch)) {
    mesh.polygon_of(mesh.patches[patch], polygon_);
  }

  std::optional<Visibility::Hit> cast() {
    const double r2 = random(), phi = 2.0 * std::numbers::pi * random();
    const Vec3 direction = std::sqrt(r2) * (std::cos(phi) * t_ + std::sin(phi) * n_.cross(t_)) +
                           std::sqrt(1.0 - r2) * n_;
    const double u = random(), v = random();
    return visibility_.first_hit(sample_polygon(polygon_, u, v) + visibility_.offset_m() * n_,
                                 direction, true);
  }

 private:
  double random() {
    state_ = hash(state_);
    return unit_interval(state_);
  }

  const Visibility& visibility_;
  Vec3 n_, t_;
  std::uint64_t state_;
  Polygon polygon_;
};

}  // namespace

std::uint64_t hash(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

double unit_interval(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

Vec3 sample_polygon(const Polygon& p, double u, double v) {
  double total = 0.0;
  std::array<double, 16> area{};
  const std::size_t fan = std::min<std::size_t>(p.size() - 2, area.size());
  for (std::size_t i = 0; i < fan; ++i)
    total += area[i] = (p[i + 1] - p[0]).cross(p[i + 2] - p[0]).norm();
  double pick = u * total;
  std::size_t i = 0;
  while (i + 1 < fan && pick > area[i]) pick -= area[i++];
  const double s = std::sqrt(std::clamp(pick / area[i], 0.0, 1.0));
  return p[0] + s * ((1.0 - v) * (p[i + 1] - p[0]) + v * (p[i + 2] - p[0]));
}

bool is_buried(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
               std::size_t patch) {
  if (lies_on_a_back(mesh, scene, patch, mesh.patches[patch].centroid)) return true;
  // Inside a solid every ray meets a back; below a sheet, however dark it is there, some do not.
  ElementRays rays(mesh, visibility, patch, 0);
  for (int k = 0; k < kRaysOfBuried; ++k) {
    const auto hit = rays.cast();
    if (!hit || hit->front) return false;
  }
  return true;
}

bool is_free(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
             std::size_t patch, const Vec3& point) {
  constexpr int kRays = 16;  // the normal, and a cosine-distributed spiral
  constexpr double kGoldenAngle = 2.399963229728653;
  if (lies_on_a_back(mesh, scene, patch, point)) return false;
  const Vec3& normal = mesh.plane_of(mesh.patches[patch]).normal;
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  for (int k = 0; k < kRays; ++k) {
    const double sine2 = static_cast<double>(k) / kRays, angle = kGoldenAngle * k;
    const Vec3 direction = std::sqrt(1.0 - sine2) * normal +
                           std::sqrt(sine2) * (std::cos(angle) * u + std::sin(angle) * v);
    const auto hit = visibility.first_hit(point + visibility.offset_m() * normal, direction, true);
    if (hit && hit->front) return true;
  }
  return false;
}

bool is_partly_covered(const PatchMesh& mesh, const Scene& scene, std::size_t patch,
                       double row_sum) {
  if (!(row_sum < 1.0 - kNegligibleCover)) return false;
  Polygon element;
  mesh.polygon_of(mesh.patches[patch], element);
  return is_crossed(element, scene);
}

double free_area_in_open_m2(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                            std::size_t patch, double row_sum_m2) {
  constexpr int kPoints = 32;  // squared
  const double area_m2 = mesh.patches[patch].area_m2;
  Polygon element;
  mesh.polygon_of(mesh.patches[patch], element);
  if (!is_crossed(element, scene)) return area_m2;
  int free = 0;
  for (int k = 0; k < kPoints * kPoints; ++k)
    free += is_free(
        mesh, scene, visibility, patch,
        sample_polygon(element, (k / kPoints + 0.5) / kPoints, (k % kPoints + 0.5) / kPoints));
  if (free == 0) return area_m2;
  return std::clamp(area_m2 * free / (kPoints * kPoints), std::min(row_sum_m2, area_m2), area_m2);
}

std::vector<char> whole_patches(const PatchMesh& mesh, const Scene& scene,
                                const std::vector<char>& usable, const Eigen::VectorXd& row_sums) {
  std::vector<char> whole = usable;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const double row_sum = row_sums[static_cast<Eigen::Index>(i)];
    whole[i] = usable[i] && row_sum >= kEmptyRow && !is_partly_covered(mesh, scene, i, row_sum);
  }
  // A lone patch sees nothing: then all of them tell.
  return std::find(whole.begin(), whole.end(), 1) == whole.end() ? usable : whole;
}

ClosureTest test_closure(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                         const std::vector<char>& usable, std::uint64_t seed) {
  return test_closure(mesh, scene, visibility, usable, seed, 0, mesh.size());
}

ClosureTest test_closure(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                         const std::vector<char>& usable, std::uint64_t seed, std::size_t begin,
                         std::size_t end) {
  std::atomic<std::size_t> escaped{0}, cast{0};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 64), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      if (!usable[i] || scene.surfaces[mesh.surface_of(mesh.patches[i])].is_opening) continue;
      ElementRays rays(mesh, visibility, i, seed);
      for (int k = 0; k < 16; ++k, ++cast)
        if (!rays.cast()) ++escaped;
    }
  });
  return {cast > 0 && escaped == 0, cast};
}

std::vector<char> usable_patches(const PatchMesh& mesh, const Scene& scene,
                                 const Visibility& visibility, std::uint64_t seed) {
  std::vector<char> usable(mesh.size(), 1);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.size(), 64), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      ElementRays rays(mesh, visibility, i, seed);
      bool sees = false;
      for (int k = 0; k < 8 && !sees; ++k) {
        const auto hit = rays.cast();
        sees = hit && hit->front;
      }
      usable[i] = sees || !is_buried(mesh, scene, visibility, i) ? 1 : 0;
    }
  });
  return usable;
}

}  // namespace truebox
