// SPDX-License-Identifier: BSD-3-Clause
#include "planning/field_error.h"

#include <algorithm>
#include <cmath>

#include "mesh/smooth_field.h"
#include "transport/enclosure.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kLeastOrder = 1.2, kMostOrder = 1.5;  // in the edge of an element
constexpr std::uint64_t kPlacesOfAnElement = 4;

struct Field {
  const GridSolution& grid;
  SmoothField values;
  explicit Field(const GridSolution& g) : grid(g), values(g.mesh, g.usable, g.indirect) {}
};

// Calls visit(piece, point, area) at places all over the elements.
template <class Visit>
void visit_places(const GridSolution& grid, const Visit& visit) {
  Polygon polygon;
  for (std::uint32_t i = 0; i < grid.mesh.size(); ++i) {
    if (!grid.usable[i]) continue;
    const Patch& patch = grid.mesh.patches[i];
    grid.mesh.polygon_of(patch, polygon);
    for (std::uint64_t k = 0; k < kPlacesOfAnElement; ++k) {
      const std::uint64_t seed = hash(kPlacesOfAnElement * i + k);
      visit(patch.piece, sample_polygon(polygon, unit_interval(seed), unit_interval(hash(seed))),
            patch.area_m2 / static_cast<double>(kPlacesOfAnElement));
    }
  }
}

// Integrals of the squared difference, one a band.
Eigen::VectorXd squared_difference(const Field& fine, const Field& coarse) {
  const Index bands = fine.grid.indirect.cols();
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(bands), a(bands), b(bands);
  visit_places(fine.grid, [&](std::uint32_t piece, const Vec3& at, double area_m2) {
    fine.values.evaluate(fine.values.find_patch(piece, at), at, a);
    coarse.values.evaluate(coarse.values.find_patch(piece, at), at, b);
    squares += area_m2 * (a - b).cwiseAbs2();
  });
  return squares;
}

}  // namespace

double field_error(const Prediction& prediction) {
  const Field fine(prediction.fine()), coarse(prediction.coarse()), coarsest(prediction.coarsest());
  const GridSolution& grid = fine.grid;
  const Eigen::VectorXd last = squared_difference(fine, coarse),
                        before = squared_difference(coarse, coarsest);
  const Eigen::VectorXd mean =
      (grid.free_area_m2.transpose() * (grid.direct + grid.indirect)).transpose();
  const double area_m2 = grid.free_area_m2.sum();
  double sum = 0.0, sum_before = 0.0, lit = 0.0;
  for (Index k = 0; k < mean.size(); ++k) {
    if (!(mean[k] > 0.0)) continue;
    sum += last[k] * area_m2 / (mean[k] * mean[k]);
    sum_before += before[k] * area_m2 / (mean[k] * mean[k]);
    lit += 1.0;
  }
  if (!(sum > 0.0)) return 0.0;
  const double growth = std::clamp(std::sqrt(sum_before / sum), std::pow(2.0, kLeastOrder),
                                   std::pow(2.0, kMostOrder));
  return std::sqrt(sum / lit) / (growth - 1.0);
}

}  // namespace truebox
