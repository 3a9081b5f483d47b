// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/form_factor.h"

namespace truebox {

/// The elements of a mesh with their planes, one a patch.
std::vector<PlanarPolygon> planar_polygons(const PatchMesh& mesh);

/// Nodes of a product Gauss rule on a patch, `stride` numbers from one to the next; the weights sum
/// to its area, m^2.
struct PatchPoints {
  const double *x, *y, *z, *weight_m2;
  std::size_t stride;
  std::uint32_t count;

  Vec3 at(std::uint32_t k) const { return {x[k * stride], y[k * stride], z[k * stride]}; }
  double weight_at(std::uint32_t k) const { return weight_m2[k * stride]; }
};

/// The points of one patch after the other, memory reused.
class PatchPointBuffer {
 public:
  /// order x order points on a triangle or quad, as many again for each two corners more.
  PatchPoints fill(const PlanarPolygon& patch, int order);

 private:
  std::vector<double> x_, y_, z_, weight_;
};

/// Unoccluded exchange areas between the patches of a mesh, to a relative tolerance, fast where
/// that is easy: product Gauss rules of cos cos / (pi r^2) with 2, 3 or 4 points a direction on
/// either patch, where the pair is far enough for them, and exchange_area_m2 where it is not.
/// "Far enough" is the order that the Bernstein ellipse through the nearest point of the other
/// patch promises, as in exchange_area_m2. Source: Trefethen (2008), Gauss quadrature.
class PairKernel {
 public:
  /// `order` lists the patches as runs will come, neighbours next to each other; they outlive this.
  PairKernel(const std::vector<PlanarPolygon>& patches, std::span<const std::uint32_t> order,
             double relative_tolerance, double tolerance_m);

  /// Symmetric to the last bit.
  double exchange_area_m2(std::uint32_t i, std::uint32_t j) const;

  /// The same numbers to the last bit, for patch i and each of order[begin, begin + result.size()),
  /// eight at a time. All of these are above i, or all below. `face_wholly`: each is known to lie
  /// in front of patch i and the reverse.
  void exchange_areas_m2(std::uint32_t i, std::size_t begin, bool face_wholly,
                         std::span<double> result) const;

 private:
  static constexpr int kLeastOrder = 2, kOrders = 3;

  // Nodes of all patches for one order: all first points, then all second ones, in runs' order.
  struct Rule {
    double least_ratio = 0.0;  // distance to the nearest point over radius
    std::vector<double> x, y, z, weight;
  };

  PatchPoints points(int order, std::size_t position) const;
  // From the rules, whatever the patch: a run may hold some that are not simple.
  PatchPoints run_points(int order, std::size_t position) const;
  double product_rule(int order, std::uint32_t i, std::uint32_t j) const;
  int order_for(std::uint32_t i, std::uint32_t j) const;
  bool is_in_front(const PlanarPolygon& polygon, const Plane& plane) const;

  const std::vector<PlanarPolygon>& patches_;
  std::vector<std::uint32_t> order_, position_of_;
  double tolerance_, tolerance_m_;
  std::size_t stride_;
  std::vector<Rule> rules_;
  std::vector<char> is_simple_;  // a triangle or quad, by position
  // Of those that are not, by position and order; their points are not in the rules.
  std::vector<std::array<PatchPointBuffer, kOrders>> buffers_;
  std::vector<std::array<PatchPoints, kOrders>> buffered_;
  std::vector<std::uint32_t> buffer_of_;
  std::vector<double> centre_x_, centre_y_, centre_z_, radius_, normal_x_, normal_y_, normal_z_;
};

}  // namespace truebox
