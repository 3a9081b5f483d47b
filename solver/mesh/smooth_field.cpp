// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/smooth_field.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "mesh/patch_topology.h"
#include "mesh/wachspress.h"

namespace truebox {
namespace {

using Monomials = Eigen::Matrix<double, 1, 6>;

Monomials monomials(double u, double v) {
  Monomials m;
  m << 1.0, u, v, u * u, u * v, v * v;
  return m;
}

// Mean of the monomials over an element: edge midpoints of a triangle integrate degree 2 exactly.
template <class ToPlane>
Monomials mean_monomials(const PatchMesh& mesh, const Patch& patch, const ToPlane& to_plane) {
  const auto corners = mesh.corners_of(patch);
  Monomials sum = Monomials::Zero();
  double area = 0.0;
  const Eigen::Vector2d a = to_plane(mesh.vertices[corners[0]]);
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Eigen::Vector2d b = to_plane(mesh.vertices[corners[i - 1]]);
    const Eigen::Vector2d c = to_plane(mesh.vertices[corners[i]]);
    const Eigen::Vector2d e = b - a, f = c - a;
    const double part = 0.5 * (e.x() * f.y() - e.y() * f.x());
    for (const Eigen::Vector2d& m : {Eigen::Vector2d(0.5 * (a + b)), Eigen::Vector2d(0.5 * (b + c)),
                                     Eigen::Vector2d(0.5 * (c + a))})
      sum += part / 3.0 * monomials(m.x(), m.y());
    area += part;
  }
  return sum / area;
}

}  // namespace

void SmoothField::fit_corner(const PatchMesh& mesh, const std::vector<std::uint32_t>& neighbours,
                             const BandMatrix& means, Corner& corner) {
  const auto k = static_cast<Eigen::Index>(neighbours.size());
  Eigen::MatrixXd basis(k, 6);
  Eigen::VectorXd weight(k);
  BandMatrix values(k, means.cols());
  const auto to_plane = [&](const Vec3& p) {
    return Eigen::Vector2d((p - corner.origin).dot(corner.axis_u) / corner.size_m,
                           (p - corner.origin).dot(corner.axis_v) / corner.size_m);
  };
  double largest = 0.0;
  for (std::uint32_t p : neighbours) largest = std::max(largest, mesh.patches[p].area_m2);
  for (Eigen::Index i = 0; i < k; ++i) {
    const Patch& patch = mesh.patches[neighbours[static_cast<std::size_t>(i)]];
    basis.row(i) = mean_monomials(mesh, patch, to_plane);
    const double distance = to_plane(patch.centroid).norm();
    weight[i] = std::sqrt(patch.area_m2 / largest) / (0.25 + distance * distance);
    values.row(i) = means.row(neighbours[static_cast<std::size_t>(i)]);
  }
  corner.coefficients = BandMatrix::Zero(6, means.cols());
  for (const Eigen::Index terms : {6, 3, 1}) {
    if (k < terms + (terms > 1 ? 1 : 0)) continue;
    const Eigen::MatrixXd weighted = weight.asDiagonal() * basis.leftCols(terms);
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(weighted);
    qr.setThreshold(1e-3);  // elements in one row say nothing of the slope across it
    if (qr.rank() < terms) continue;
    corner.coefficients.topRows(terms) = qr.solve(Eigen::MatrixXd(weight.asDiagonal() * values));
    return;
  }
}

// The quadratic of `corner` in the coordinates of another corner of the same piece.
BandMatrix SmoothField::seen_from(const Corner& corner, const Corner& place) {
  const BandMatrix& c = corner.coefficients;
  const Vec3 d = (place.origin - corner.origin) / corner.size_m;
  const double u = d.dot(corner.axis_u), v = d.dot(corner.axis_v);
  const double r = place.size_m / corner.size_m;
  BandMatrix moved(6, c.cols());
  moved.row(0) = monomials(u, v) * c;
  moved.row(1) = r * (c.row(1) + 2.0 * u * c.row(3) + v * c.row(4));
  moved.row(2) = r * (c.row(2) + u * c.row(4) + 2.0 * v * c.row(5));
  moved.bottomRows(3) = r * r * c.bottomRows(3);
  return moved;
}

SmoothField::SmoothField(const PatchMesh& mesh, const std::vector<char>& usable,
                         const BandMatrix& means)
    : mesh_(&mesh), corner_of_(mesh.corners.size(), 0) {
  const PatchTopology topology(mesh);
  std::map<std::pair<std::uint32_t, std::vector<std::uint32_t>>, std::uint32_t> known;
  for (std::uint32_t p = 0; p < mesh.size(); ++p) {
    const Patch& patch = mesh.patches[p];
    for (std::uint32_t k = 0; k < patch.corner_count; ++k) {
      const std::uint32_t vertex = mesh.corners[patch.first_corner + k];
      auto neighbours = topology.reachable(usable, p, vertex, 2);
      if (neighbours.size() < 10) neighbours = topology.reachable(usable, p, vertex, 3);
      const auto [it, is_new] =
          known.try_emplace({vertex, neighbours}, static_cast<std::uint32_t>(corners_.size()));
      corner_of_[patch.first_corner + k] = it->second;
      if (!is_new) continue;
      const Vec3& normal = mesh.plane_of(patch).normal;
      Corner corner;
      corner.origin = mesh.vertices[vertex];
      corner.axis_u = normal.unitOrthogonal();
      corner.axis_v = normal.cross(corner.axis_u);
      corner.size_m = std::sqrt(patch.area_m2);
      fit_corner(mesh, neighbours, means, corner);
      corners_.push_back(std::move(corner));
    }
  }
  for (const PatchTopology::Constraint& c : topology.constraints(usable)) {
    Corner& hanging = corners_[corner_of_[c.corner]];
    hanging.coefficients = (1.0 - c.share) * seen_from(corners_[corner_of_[c.from]], hanging) +
                           c.share * seen_from(corners_[corner_of_[c.to]], hanging);
  }
  for (const Piece& piece : mesh.pieces) {
    Bins bins;
    bins.axis_u = (piece.polygon[1] - piece.polygon[0]).normalized();
    bins.axis_v = piece.plane.normal.cross(bins.axis_u);
    Eigen::AlignedBox2d box;
    const auto flat = [&](const Vec3& p) {
      return Eigen::Vector2d(p.dot(bins.axis_u), p.dot(bins.axis_v));
    };
    for (const Vec3& v : piece.polygon) box.extend(flat(v));
    const double area = area_vector(piece.polygon).norm();
    bins.cell_m = std::sqrt(area / std::max(1u, piece.patch_count));
    bins.origin = box.min().x() * bins.axis_u + box.min().y() * bins.axis_v;
    bins.columns = 1 + static_cast<int>(box.sizes().x() / bins.cell_m);
    bins.rows = 1 + static_cast<int>(box.sizes().y() / bins.cell_m);
    bins.patches.resize(static_cast<std::size_t>(bins.columns) * bins.rows);
    for (std::uint32_t p = piece.first_patch; p < piece.first_patch + piece.patch_count; ++p) {
      Eigen::AlignedBox2d extent;
      for (std::uint32_t v : mesh.corners_of(mesh.patches[p]))
        extent.extend(flat(mesh.vertices[v]));
      const auto bin = [&](double value, double low, int count) {
        return std::clamp(static_cast<int>((value - low) / bins.cell_m), 0, count - 1);
      };
      for (int r = bin(extent.min().y(), box.min().y(), bins.rows);
           r <= bin(extent.max().y(), box.min().y(), bins.rows); ++r)
        for (int c = bin(extent.min().x(), box.min().x(), bins.columns);
             c <= bin(extent.max().x(), box.min().x(), bins.columns); ++c)
          bins.patches[static_cast<std::size_t>(r) * bins.columns + c].push_back(p);
    }
    bins_.push_back(std::move(bins));
  }
}

std::uint32_t SmoothField::find_patch(std::uint32_t piece, const Vec3& point) const {
  const Bins& bins = bins_[piece];
  const Vec3 d = point - bins.origin;
  const int c = std::clamp(static_cast<int>(d.dot(bins.axis_u) / bins.cell_m), 0, bins.columns - 1);
  const int r = std::clamp(static_cast<int>(d.dot(bins.axis_v) / bins.cell_m), 0, bins.rows - 1);
  std::uint32_t nearest = mesh_->pieces[piece].first_patch;
  double best = -std::numeric_limits<double>::infinity();
  for (std::uint32_t p : bins.patches[static_cast<std::size_t>(r) * bins.columns + c]) {
    const auto corners = mesh_->corners_of(mesh_->patches[p]);
    double depth = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Vec3& a = mesh_->vertices[corners[k]];
      const Vec3& b = mesh_->vertices[corners[(k + 1) % corners.size()]];
      depth = std::min(depth,
                       mesh_->pieces[piece].plane.normal.cross(b - a).normalized().dot(point - a));
    }
    if (depth > best) best = depth, nearest = p;
    if (depth >= 0.0) break;
  }
  return nearest;
}

void SmoothField::evaluate(std::uint32_t patch_index, const Vec3& point,
                           Eigen::Ref<Eigen::VectorXd> values) const {
  const Patch& patch = mesh_->patches[patch_index];
  WachspressWeights lambda;
  const std::size_t count = wachspress_weights(*mesh_, patch, point, lambda);
  values.setZero();
  for (std::size_t k = 0; k < count; ++k) {
    if (lambda[k] == 0.0) continue;
    const Corner& corner = corners_[corner_of_[patch.first_corner + k]];
    const Vec3 d = (point - corner.origin) / corner.size_m;
    values.noalias() +=
        lambda[k] *
        (monomials(d.dot(corner.axis_u), d.dot(corner.axis_v)) * corner.coefficients).transpose();
  }
  values = values.cwiseMax(0.0);
}

}  // namespace truebox
