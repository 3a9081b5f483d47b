// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "transport/grid_difference.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kWhole = 1.0 - 1e-9;  // of an element's area: rounding of the clipping
constexpr int kDirectSplit = 4;        // parts of a triangle's edge where an element is cut

// What two convex polygons of one plane have in common.
Polygon common_part(const Polygon& a, const Polygon& b, const Vec3& normal, double tolerance_m) {
  Polygon part = a, kept;
  for (std::size_t k = 0; k < b.size() && part.size() > 2; ++k) {
    const Vec3& corner = b[k];
    const Vec3 inwards = normal.cross(b[(k + 1) % b.size()] - corner).normalized();
    clip(part, Plane{inwards, inwards.dot(corner)}, tolerance_m, kept);
    part.swap(kept);
  }
  if (part.size() < 3) part.clear();
  return part;
}

// Edge midpoints of a fan of triangles: exact for quadratics.
template <class Evaluate>
Eigen::VectorXd mean_over(const Polygon& part, Index bands, const Evaluate& evaluate) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(bands);
  double area = 0.0;
  for (std::size_t k = 2; k < part.size(); ++k) {
    const Vec3 &a = part[0], &b = part[k - 1], &c = part[k];
    const double weight = 0.5 * (b - a).cross(c - a).norm() / 3.0;
    for (const Vec3& x : {Vec3(0.5 * (a + b)), Vec3(0.5 * (b + c)), Vec3(0.5 * (c + a))})
      sum += weight * evaluate(x);
    area += 3.0 * weight;
  }
  return sum / area;
}

bool lies_in(const Piece& piece, const Plane& plane, double tolerance_m) {
  if (piece.plane.normal.dot(plane.normal) < 1.0 - 1e-9) return false;
  for (const Vec3& v : piece.polygon)
    if (std::abs(plane.distance_m(v)) > tolerance_m) return false;
  return true;
}

}  // namespace

// Indirect light over part of a piece: whole elements by their means, the rest by the smooth field,
// shifted so that it keeps its element's mean.
Eigen::VectorXd Prediction::indirect_mean(const Level& level, std::uint32_t piece_index,
                                          const Polygon& part) const {
  const PatchMesh& mesh = level.solution.mesh;
  const Piece& piece = mesh.pieces[piece_index];
  const Index bands = level.solution.indirect.cols();
  const double tolerance = 1e-9 * piece.diameter_m;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(bands);
  double area = 0.0;
  Eigen::AlignedBox3d box;
  for (const Vec3& v : part) box.extend(v);
  Polygon element;
  for (std::uint32_t i = piece.first_patch; i < piece.first_patch + piece.patch_count; ++i) {
    if (!level.solution.usable[i]) continue;
    mesh.polygon_of(mesh.patches[i], element);
    Eigen::AlignedBox3d own;
    for (const Vec3& v : element) own.extend(v);
    if (!own.intersects(box)) continue;
    const Polygon overlap = common_part(element, part, piece.plane.normal, tolerance);
    if (overlap.empty()) continue;
    const double overlap_m2 = area_vector(overlap).norm();
    const auto row = level.solution.indirect.row(i).transpose();
    area += overlap_m2;
    if (overlap_m2 >= kWhole * mesh.patches[i].area_m2) {
      sum += overlap_m2 * row;
      continue;
    }
    const auto field = [&](const Vec3& x) {
      Eigen::VectorXd value(bands);
      level.evaluate(i, x, value);
      return value;
    };
    sum += overlap_m2 * (mean_over(overlap, bands, field) + row - mean_over(element, bands, field));
  }
  return area > 0.0 ? Eigen::VectorXd(sum / area) : sum;
}

Eigen::VectorXd Prediction::direct_mean(std::uint32_t patch, const Polygon& part,
                                        bool is_whole) const {
  const Index bands = fine().direct.cols();
  if (is_whole) return fine().direct.row(patch).transpose();
  Gather::Scratch scratch;
  const Vec3& normal = fine().mesh.plane_of(fine().mesh.patches[patch]).normal;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(bands), value(bands);
  double area = 0.0;
  for (std::size_t k = 2; k < part.size(); ++k) {
    const Vec3 &a = part[0], u = (part[k - 1] - a) / kDirectSplit, v = (part[k] - a) / kDirectSplit;
    const double weight = u.cross(v).norm();
    for (int i = 0; i < kDirectSplit; ++i)
      for (int j = 0; i + j < kDirectSplit; ++j)
        for (const double third : {1.0 / 3.0, 2.0 / 3.0}) {
          if (third > 0.5 && i + j + 1 >= kDirectSplit) continue;
          value.setZero();
          levels_[0]->gather->add_direct(a + (i + third) * u + (j + third) * v, normal, value,
                                         scratch);
          sum += weight * value;
          area += weight;
        }
  }
  return sum / area;
}

std::optional<BoundedIrradiance> Prediction::mean_irradiance_over(const Polygon& polygon) const {
  const PatchMesh& mesh = fine().mesh;
  const Plane plane = plane_of(polygon);
  const double tolerance = 1e-6 * scene_->diameter_m();
  const Index bands = fine().direct.cols();
  Eigen::VectorXd value = Eigen::VectorXd::Zero(bands), bound = Eigen::VectorXd::Zero(bands);
  double area = 0.0;
  Eigen::AlignedBox3d box;
  for (const Vec3& v : polygon) box.extend(v);
  Polygon element;
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    if (scene_->surfaces[piece.surface].is_opening || !lies_in(piece, plane, tolerance)) continue;
    for (std::uint32_t i = piece.first_patch; i < piece.first_patch + piece.patch_count; ++i) {
      if (!fine().usable[i]) continue;
      mesh.polygon_of(mesh.patches[i], element);
      Eigen::AlignedBox3d own;
      for (const Vec3& v : element) own.extend(v);
      if (!own.intersects(box)) continue;
      const Polygon part = common_part(element, polygon, plane.normal, 1e-9 * piece.diameter_m);
      if (part.empty()) continue;
      const double part_m2 = area_vector(part).norm();
      const bool is_whole = part_m2 >= kWhole * mesh.patches[i].area_m2;
      area += part_m2;
      value += part_m2 * direct_mean(i, part, is_whole);
      if (!needs_.interreflection) continue;
      std::array<Eigen::VectorXd, 3> mean;
      for (std::size_t k = 0; k < 3; ++k) mean[k] = indirect_mean(*levels_[k], p, part);
      value += part_m2 * extrapolated(mean[0], mean[1]);
      bound += part_m2 * guarded_difference(mean[0], mean[1], mean[2], kGatheredOrder);
    }
  }
  if (area == 0.0) return std::nullopt;
  value /= area;
  bound = bound / area + kRounding * value;
  if (needs_.interreflection) bound += solver_bounds();
  return BoundedIrradiance{expand(value), expand(bound)};
}

}  // namespace truebox
