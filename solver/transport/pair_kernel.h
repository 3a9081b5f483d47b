// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/form_factor.h"

namespace truebox {

/// The elements of a mesh with their planes, one a patch.
std::vector<PlanarPolygon> planar_polygons(const PatchMesh& mesh);

/// Unoccluded exchange areas between the patches of a mesh, to a relative tolerance, fast where
/// that is easy: product Gauss rules of cos cos / (pi r^2) with 2, 3 or 4 points a direction on
/// either patch, where the pair is far enough for them, and exchange_area_m2 where it is not.
/// "Far enough" is the order that the Bernstein ellipse through the nearest point of the other
/// patch promises, as in exchange_area_m2. Source: Trefethen (2008), Gauss quadrature.
class PairKernel {
 public:
  PairKernel(const std::vector<PlanarPolygon>& patches, double relative_tolerance);

  /// Both patches wholly in front of each other or not; symmetric to the last bit.
  double exchange_area_m2(std::uint32_t i, std::uint32_t j) const;

  /// Nodes of the order x order rule of a patch, order 2, 3 or 4; weights sum to its area, m^2.
  struct Points {
    const double *x, *y, *z, *weight_m2;
    std::uint32_t count;
  };
  Points points(std::uint32_t patch, int order) const {
    return rules_[static_cast<std::size_t>(order - 2)].points(patch);
  }

 private:
  // Nodes of all patches for one order, coordinate by coordinate.
  struct Rule {
    double least_ratio = 0.0;  // distance to the nearest point over radius
    std::vector<double> x, y, z, weight;
    std::vector<std::uint32_t> first;

    void add(const PlanarPolygon& patch, int order);
    Points points(std::uint32_t patch) const {
      const std::uint32_t at = first[patch];
      return {&x[at], &y[at], &z[at], &weight[at], first[patch + 1] - at};
    }
  };

  static double product_rule(const Points& i, const Vec3& normal_i, const Points& j,
                             const Vec3& normal_j);
  bool face_wholly(std::uint32_t i, std::uint32_t j) const;

  const std::vector<PlanarPolygon>& patches_;
  double tolerance_;
  std::vector<Rule> rules_;  // orders 2, 3, 4
};

}  // namespace truebox
