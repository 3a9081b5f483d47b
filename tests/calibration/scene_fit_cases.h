// SPDX-License-Identifier: BSD-3-Clause
// The cube of albedo_crlb.csv and readings of it.
#pragma once

#include <array>
#include <random>

#include "fit/scene_fit.h"
#include "support/tiny_scenes.h"

namespace truebox {

/// Unit cube, the middle quarter of each ceiling side a light; faces x0 x1 y0 y1 z0 z1 have their
/// own materials 0 to 5, the lamp is material 6. One band unless more albedos are given.
inline Scene lit_cube(const std::vector<std::array<double, 6>>& albedos, double exitance = 1.0) {
  Scene scene;
  std::vector<double> centres;
  for (std::size_t b = 0; b < albedos.size(); ++b)
    centres.push_back(450.0 + 50.0 * static_cast<double>(b));
  scene.bands = WavelengthGrid::from_centres(centres);
  const char* names[6] = {"green", "red", "back", "front", "floor", "ceiling"};
  for (std::size_t f = 0; f < 7; ++f) {
    std::vector<double> rho;
    for (const auto& a : albedos) rho.push_back(a[std::min<std::size_t>(f, 5)]);
    scene.materials.push_back({f < 6 ? names[f] : "lamp", Reflectance(rho),
                               RadiantExitance(albedos.size(), f < 6 ? 0.0 : exitance)});
  }
  const auto face = [&](const char* name, std::size_t material, Polygon polygon) {
    tiny::add_surface(scene, name, std::move(polygon), material);
  };
  face("x0", 0, {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}});
  face("x1", 1, {{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}});
  face("y0", 2, {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}});
  face("y1", 3, {{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}});
  face("z0", 4, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const auto ceiling = [&](const char* name, std::size_t material, double x0, double x1, double y0,
                           double y1) {
    face(name, material, {{x0, y0, 1}, {x0, y1, 1}, {x1, y1, 1}, {x1, y0, 1}});
  };
  ceiling("ceiling left", 5, 0, .375, 0, 1);
  ceiling("ceiling right", 5, .625, 1, 0, 1);
  ceiling("ceiling near", 5, .375, .625, 0, .375);
  ceiling("ceiling far", 5, .375, .625, .625, 1);
  ceiling("lamp", 6, .375, .625, .375, .625);
  return scene;
}

inline SceneModelOptions cube_grid(double edge_m) {
  SceneModelOptions options;
  options.edge_m = edge_m;
  options.solver_bound = 1e-12;
  return options;
}

/// All faces free (the lamp's albedo is the ceiling's), the emission known, one plane a band over
/// every block of view 0, read as the model has it, each with u = `relative_noise` of its value.
inline SceneFitProblem cube_problem(const SceneModel& model, double relative_noise) {
  SceneFitProblem problem;
  problem.model = &model;
  problem.reflectances.assign(7, ReflectanceChoice{});
  for (std::size_t f = 0; f < 6; ++f) problem.reflectances[f].hold = Hold::free;
  problem.reflectances[6].same_as = 5;
  problem.emissions.assign(1, EmissionChoice{});
  const auto bands = static_cast<Eigen::Index>(model.scene().bands.size());
  for (Eigen::Index b = 0; b < bands; ++b) {
    PlaneReadings plane;
    plane.name = "band " + std::to_string(b + 1);
    plane.band_weights = Eigen::VectorXd::Unit(bands, b);
    for (std::size_t i = 0; i < model.blocks().size(); ++i) plane.readings.push_back({i, 0.0, 1.0});
    problem.planes.push_back(std::move(plane));
  }
  const std::vector<double> exact = predicted_readings(problem);
  std::size_t row = 0;
  for (PlaneReadings& plane : problem.planes)
    for (BlockReading& r : plane.readings) {
      r.value = exact[row++];
      r.standard_uncertainty = relative_noise * r.value;
    }
  return problem;
}

inline void add_noise(SceneFitProblem& problem, std::mt19937& random) {
  std::normal_distribution<double> normal;
  for (PlaneReadings& plane : problem.planes)
    for (BlockReading& r : plane.readings) r.value += r.standard_uncertainty * normal(random);
}

}  // namespace truebox
