// SPDX-License-Identifier: BSD-3-Clause
#include "planning/line_pilot.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "adaptive/adapt_mesh.h"
#include "discontinuity/discontinuity_mesh.h"
#include "mesh/wachspress.h"
#include "transport/gather.h"
#include "transport/polygon_rule.h"

namespace truebox {
namespace {

constexpr double kInside = 1e-3;  // of the way to the centroid: corners lie on edges
constexpr int kRulePoints = 2;    // a side, where interpolation is looked at

// All bands together, W m^-2 nm^-1.
double direct_light(const Gather& gather, const Vec3& point, const Vec3& normal, std::size_t bands,
                    Gather::Scratch& scratch) {
  Eigen::VectorXd value = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bands));
  gather.add_direct(point, normal, value, scratch);
  return value.sum();
}

double interpolation_error(const PatchMesh& mesh, const Scene& scene) {
  const Gather gather(mesh, scene, true);
  std::vector<double> square(mesh.size(), 0.0), sum(mesh.size(), 0.0);
  tbb::parallel_for(std::size_t{0}, mesh.size(), [&](std::size_t i) {
    const Patch& patch = mesh.patches[i];
    if (scene.surfaces[mesh.surface_of(patch)].is_opening) return;
    const Vec3& normal = mesh.plane_of(patch).normal;
    Gather::Scratch scratch;
    Polygon polygon;
    mesh.polygon_of(patch, polygon);
    std::vector<double> at_corner;
    for (const Vec3& v : polygon)
      at_corner.push_back(direct_light(gather, v + kInside * (patch.centroid - v), normal,
                                       scene.bands.size(), scratch));
    for_each_gauss_point(polygon, kRulePoints, [&](const Vec3& point, double weight) {
      const double exact = direct_light(gather, point, normal, scene.bands.size(), scratch);
      WachspressWeights lambda;
      const std::size_t count = wachspress_weights(mesh, patch, point, lambda);
      double off = -exact;
      for (std::size_t k = 0; k < count; ++k) off += lambda[k] * at_corner[k];
      square[i] += weight * patch.area_m2 * off * off;
      sum[i] += weight * patch.area_m2 * exact;
    });
  });
  double all_square = 0.0, all = 0.0, area_m2 = 0.0;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (scene.surfaces[mesh.surface_of(mesh.patches[i])].is_opening) continue;
    all_square += square[i], all += sum[i], area_m2 += mesh.patches[i].area_m2;
  }
  return all > 0.0 ? std::sqrt(all_square / area_m2) / (all / area_m2) : 0.0;
}

}  // namespace

LinePilot fly_line_pilot(const Scene& scene, std::size_t elements, const Goal* adapted_to) {
  LinePilot pilot;
  FollowedLines followed;
  PatchMesh plain, along;
  if (adapted_to) {
    AdaptOptions options;
    options.cells = std::max<std::size_t>(1, elements / 4);
    options.goal = *adapted_to;
    plain = adapt_mesh(scene, options).fine.mesh(1);
    options.discontinuities = true;
    const AdaptedMesh mesh = adapt_mesh(scene, options);
    along = mesh.fine.mesh(1);
    followed = mesh.lines;
  } else {
    DiscontinuityOptions options;
    options.cells = std::max<std::size_t>(1, elements / 16);
    along = discontinuity_cells(scene, options, &followed).mesh(2);
    plain = uniform_mesh(scene, edge_for_count(scene, options.cells), 2);
  }
  pilot.elements = plain.size();
  pilot.elements_along = along.size();
  pilot.error = interpolation_error(plain, scene);
  pilot.error_along = interpolation_error(along, scene);
  pilot.lines = followed.of_order[1] + followed.of_order[2];
  return pilot;
}

}  // namespace truebox
