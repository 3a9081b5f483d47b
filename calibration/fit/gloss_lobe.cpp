// SPDX-License-Identifier: BSD-3-Clause
#include "fit/gloss_lobe.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace truebox {

using std::numbers::pi;

double GlossLobe::roughness() const { return std::sqrt(alpha2_); }

double GlossLobe::value(const Vec3& normal, const Vec3& outgoing, const Vec3& incoming) const {
  const double o = normal.dot(outgoing), i = normal.dot(incoming);
  if (!(o > 0.0) || !(i > 0.0)) return 0.0;
  const double m = normal.dot((outgoing + incoming).normalized());
  const double d = 1.0 + m * m * (alpha2_ - 1.0);
  const auto lambda = [&](double cosine) {
    return 0.5 * (std::sqrt(1.0 + alpha2_ * (1.0 / (cosine * cosine) - 1.0)) - 1.0);
  };
  return alpha2_ / (pi * d * d) / (4.0 * o * i * (1.0 + lambda(o) + lambda(i)));
}

namespace {

constexpr double kCellOfLobe = 0.25;  // a cell's width as seen, over the roughness
constexpr int kMostCells = 24;        // along one side of a lamp's piece

/// A convex polygon as n x n cells: of a quadrilateral, or of each triangle of its fan.
template <class Visit>
void for_each_cell(const Polygon& p, int n, const Visit& visit) {
  const bool is_quad = p.size() == 4;
  for (std::size_t t = 2; t < (is_quad ? 3 : p.size()); ++t) {
    const Vec3 &a = p[0], &b = p[t - 1], &c = p[t], &d = is_quad ? p[3] : p[0];
    const auto at = [&](int i, int j) -> Vec3 {
      const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
      return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c);
    };
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        Polygon cell{at(i, j), at(i + 1, j), at(i + 1, j + 1)};
        if (is_quad || i > 0) cell.push_back(at(i, j + 1));
        visit(cell);
      }
  }
}

}  // namespace

Eigen::VectorXd gloss_of(const PixelBlock& block, const GlossLobe& lobe, const PatchMesh& mesh,
                         const Scene& lamp_scene, const Gather& gather, Gather::Scratch& scratch) {
  const Vec3& normal = mesh.pieces[block.piece].plane.normal;
  const auto lamps = static_cast<Eigen::Index>(lamp_scene.bands.size());
  const auto n = static_cast<Eigen::Index>(block.points.size());
  Eigen::MatrixXd at_points = Eigen::MatrixXd::Zero(n, lamps);
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    const Material& material = lamp_scene.material_of(lamp_scene.surfaces[piece.surface]);
    if (lamp_scene.surfaces[piece.surface].is_opening || !material.emits()) continue;
    const double distance = (centroid(piece.polygon) - block.centre).norm();
    const int cells = std::clamp(
        static_cast<int>(std::ceil(piece.diameter_m / (kCellOfLobe * lobe.roughness() * distance))),
        1, kMostCells);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vec3& x = block.points[static_cast<std::size_t>(k)];
      const Vec3 outgoing = (block.eye - x).normalized();
      double seen = 0.0;
      for_each_cell(piece.polygon, cells, [&](const Polygon& cell) {
        const double factor = gather.visible_factor(x, normal, cell, p, scratch);
        if (factor > 0.0)
          seen += pi * factor * lobe.value(normal, outgoing, (centroid(cell) - x).normalized());
      });
      for (Eigen::Index l = 0; l < lamps; ++l)
        at_points(k, l) += seen * material.exitance[static_cast<std::size_t>(l)];
    }
  }
  Eigen::VectorXd mean(lamps);
  for (Eigen::Index l = 0; l < lamps; ++l) mean[l] = mean_over_block(block, at_points.col(l)).value;
  return mean;
}

}  // namespace truebox
