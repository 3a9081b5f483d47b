// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/parallel_for.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "mesh/cell_tree.h"
#include "mesh/edge_layers.h"
#include "transport/prediction.h"

namespace truebox {

/// A point of a lit surface, the area it stands for, and the irradiance there, W m^-2 nm^-1: direct
/// light, exact, and indirect light gathered from a finer solution.
struct MeasuredPlace {
  std::uint32_t piece = 0;
  Vec3 position_m = Vec3::Zero();
  double area_m2 = 0.0;
  Eigen::VectorXd direct, indirect;
};

inline Vec3 random_point(const Polygon& p, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  double rest_m2 = uniform(random) * area_vector(p).norm();
  std::size_t k = 2;
  for (; k + 1 < p.size(); ++k) {
    rest_m2 -= 0.5 * (p[k - 1] - p[0]).cross(p[k] - p[0]).norm();
    if (rest_m2 <= 0.0) break;
  }
  const double u = std::sqrt(uniform(random)), v = uniform(random);
  return (1.0 - u) * p[0] + u * (1.0 - v) * p[k - 1] + u * v * p[k];
}

/// A random point in each of many cells that get thinner where surfaces meet: errors there, large
/// on little area, count by the area they have, and with little noise. No mesh under test has these
/// cells.
inline std::vector<MeasuredPlace> places_on_surfaces(const Scene& scene, double edge_m) {
  PredictOptions options;
  options.form_factors.method = FormFactorMethod::exact_visibility;
  options.mesh_of_grid = [&](int grid) { return uniform_mesh(scene, grid < 2 ? 1.0 : edge_m); };
  const Prediction coarse(scene, options);
  const LayeredMesh layers = edge_layers(coarse.fine().mesh, scene, coarse.fine().usable, 6);
  std::mt19937_64 random(42);
  std::vector<MeasuredPlace> places;
  Polygon polygon;
  for (std::size_t c = 0; c < layers.mesh.size(); ++c) {
    const Patch& cell = layers.mesh.patches[c];
    if (!coarse.fine().usable[layers.parent[c]] ||
        scene.surfaces[layers.mesh.surface_of(cell)].is_opening)
      continue;
    layers.mesh.polygon_of(cell, polygon);
    places.push_back({cell.piece, random_point(polygon, random), cell.area_m2, {}, {}});
  }
  return places;
}

/// Elements for a truth: those of `edge_m`, each cut in four three times, to a 64th of its width
/// where surfaces meet.
inline std::unique_ptr<Prediction> solve_truth(const Scene& scene, double edge_m) {
  const CellTree cells(scene, edge_m);
  PredictOptions options;
  options.form_factors.method = FormFactorMethod::exact_visibility;
  options.near_sources = true;
  options.mesh_of_grid = [&](int grid) { return cells.mesh(grid + 1); };
  return std::make_unique<Prediction>(scene, options);
}

/// Fills in direct light and indirect light by exact visibility: an element longer than a quarter
/// of its distance is cut until its parts are not, and they send exact direct and interpolated
/// indirect light.
inline void gather_truth(const Prediction& fine, std::vector<MeasuredPlace>& places) {
  constexpr double kNearField = 0.25;
  const GridSolution& s = fine.fine();
  const Scene& scene = fine.scene();
  const SmoothField field(s.mesh, s.usable, s.indirect);
  const Gather gather(s.mesh, scene, fine.needs().occlusion);
  std::vector<std::uint32_t> all(s.mesh.pieces.size());
  for (std::uint32_t p = 0; p < all.size(); ++p) all[p] = p;
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    MeasuredPlace& place = places[i];
    const Vec3& normal = s.mesh.pieces[place.piece].plane.normal;
    Gather::Scratch scratch, source_scratch;
    place.direct = place.indirect = Eigen::VectorXd::Zero(s.reflected.cols());
    gather.add_direct(place.position_m, normal, place.direct, scratch);
    Eigen::VectorXd value(s.reflected.cols());
    Polygon polygon;
    for (std::uint32_t j = 0; j < s.mesh.size(); ++j) {
      const Patch& patch = s.mesh.patches[j];
      const Surface& surface = scene.surfaces[s.mesh.surface_of(patch)];
      if (surface.is_opening || patch.piece == place.piece) continue;
      s.mesh.polygon_of(patch, polygon);
      const auto& rho = scene.material_of(surface).reflectance.values;
      const Eigen::Map<const Eigen::VectorXd> reflectance(rho.data(), value.size());
      const auto add = [&](double factor, const Gather::Part& part) {
        field.evaluate(j, part.centre, value);
        gather.add_direct(part.centre, s.mesh.plane_of(patch).normal, value, source_scratch);
        place.indirect += factor * reflectance.cwiseProduct(value);
      };
      if (diameter_m(polygon) > kNearField * (patch.centroid - place.position_m).norm())
        gather.visit_parts(place.position_m, normal, polygon, patch.piece, kNearField, all, add,
                           scratch);
      else
        place.indirect +=
            gather.visible_factor(place.position_m, normal, polygon, patch.piece, scratch) *
            s.reflected.row(j).transpose();
    }
  });
}

/// Root mean squares over the area of all places and over the bands.
struct FieldError {
  double to_mean = 0.0;   ///< of error : mean irradiance
  double relative = 0.0;  ///< of error : irradiance of the place
};

/// `error_of(i)`: error at place i, one value a band.
template <class ErrorOf>
FieldError rms_error(const std::vector<MeasuredPlace>& places, const ErrorOf& error_of) {
  const Eigen::Index bands = places.front().direct.size();
  Eigen::VectorXd square = Eigen::VectorXd::Zero(bands), mean = square, relative = square;
  double area_m2 = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const MeasuredPlace& place = places[i];
    const Eigen::VectorXd exact = place.direct + place.indirect, off = error_of(i);
    square += place.area_m2 * off.cwiseAbs2();
    mean += place.area_m2 * exact;
    relative += place.area_m2 * off.cwiseQuotient(exact).cwiseAbs2();
    area_m2 += place.area_m2;
  }
  return {std::sqrt((square / area_m2).cwiseQuotient((mean / area_m2).cwiseAbs2()).mean()),
          std::sqrt((relative / area_m2).mean())};
}

/// Of a prediction's field, `irradiance_on`: what pictures show.
inline FieldError field_error(const Prediction& prediction,
                              const std::vector<MeasuredPlace>& places) {
  Gather::Scratch scratch;
  return rms_error(places, [&](std::size_t i) -> Eigen::VectorXd {
    const MeasuredPlace& p = places[i];
    return prediction.irradiance_on(p.piece, p.position_m, scratch).value - p.direct - p.indirect;
  });
}

}  // namespace truebox
