// SPDX-License-Identifier: BSD-3-Clause
// A room with a block before a camera, none of which is where it is said to be.
#pragma once

#include <random>

#include "fit/scene_shape.h"
#include "support/tiny_scenes.h"

namespace truebox {

/// Floor and three walls of 1 m, each of its own material, a block on the floor (surfaces 4 to 9)
/// and a lamp where the ceiling would be. Camera "front" looks in through the open side.
inline Scene room_with_block() {
  Scene scene;
  scene.bands = WavelengthGrid::from_centres({550.0});
  const double rho[] = {.6, .25, .7, .4, .5, 0.0};
  const char* names[] = {"floor", "left", "back", "right", "block", "lamp"};
  for (int m = 0; m < 6; ++m)
    scene.materials.push_back(
        {names[m], Reflectance(1, rho[m]), RadiantExitance(1, m == 5 ? 10.0 : 0.0)});
  tiny::add_surface(scene, "floor", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0);
  tiny::add_surface(scene, "left", {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}}, 1);
  tiny::add_surface(scene, "back", {{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}}, 2);
  tiny::add_surface(scene, "right", {{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}}, 3);
  tiny::add_box(scene, "block", {.37, .43, 0}, {.63, .71, .32}, false, 4);
  tiny::add_surface(scene, "lamp", {{.3, .3, 1}, {.3, .6, 1}, {.7, .6, 1}, {.7, .3, 1}}, 5);
  CameraDescription camera;
  camera.position_m = {.52, -1.05, .57};
  camera.direction = {0.01, 1, -.08};
  camera.up = Vec3::UnitZ();
  camera.focal_length_m = 0.035;
  camera.film_m = {0.036, 0.036};
  camera.pixels = {64, 64};
  scene.cameras["front"] = camera;
  return scene;
}

inline ShapeUnknown block_offset(const std::string& what, const Vec3& move, const Vec3& stretch) {
  ShapeUnknown unknown;
  unknown.name = {"offset " + what, "offset " + what, "geometry offsets"};
  unknown.surfaces = {4, 5, 6, 7, 8, 9};
  unknown.move = move;
  unknown.stretch = stretch;
  unknown.pivot_m = {.5, .57, 0};
  return unknown;
}

/// The scene with its model and one view; the unknowns are free.
inline ShapedScene shaped_scene(const Scene& scene, std::vector<ShapeUnknown> unknowns,
                                double edge_m, int tile_px = 8) {
  ShapedScene shaped;
  shaped.original = scene;
  for (const ShapeUnknown& u : unknowns) shaped.values.push_back(u.known);
  shaped.unknowns = std::move(unknowns);
  shaped.views = {{"front", scene.cameras.at("front").pixels}};
  SceneModelOptions options;
  options.edge_m = edge_m;
  options.solver_bound = 1e-12;
  options.tile_px = tile_px;
  options.samples = 6;
  options.form_factors.method = FormFactorMethod::exact_visibility;
  shaped.scene = std::make_unique<Scene>(scene);
  shaped.model = std::make_unique<SceneModel>(*shaped.scene, options);
  shaped.model->add_view(shaped.camera(shaped.values, 0));
  return shaped;
}

/// One plane with free gain, all materials but the lamp free; readings as predicted where the
/// scene is now, u a share of each.
inline SceneFitProblem room_problem(const ShapedScene& shaped, double relative_u) {
  SceneFitProblem problem;
  problem.model = shaped.model.get();
  problem.reflectances.assign(shaped.original.materials.size(), ReflectanceChoice{});
  for (std::size_t m = 0; m + 1 < problem.reflectances.size(); ++m)
    problem.reflectances[m].hold = Hold::free;
  problem.emissions.assign(1, EmissionChoice{});
  PlaneReadings plane;
  plane.name = "band";
  plane.band_weights = Eigen::VectorXd::Ones(1);
  plane.gain = Hold::free;
  for (std::size_t i = 0; i < shaped.model->blocks().size(); ++i)
    plane.readings.push_back({i, 0.0, 1.0});
  problem.planes = {plane};
  const std::vector<double> exact = predicted_readings(problem);
  std::vector<BlockReading> lit;
  for (BlockReading r : problem.planes[0].readings) {
    r.value = exact[r.block];
    r.standard_uncertainty = relative_u * r.value;
    if (r.value > 0.0) lit.push_back(r);
  }
  problem.planes[0].readings = lit;
  return problem;
}

}  // namespace truebox
