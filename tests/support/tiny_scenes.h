// SPDX-License-Identifier: BSD-3-Clause
// Scenes small enough to be checked by hand.
#pragma once

#include <string>

#include "scene/scene.h"

namespace truebox::tiny {

inline Scene grey_scene(double rho, double exitance = 0.0) {
  Scene scene;
  scene.bands = WavelengthGrid::from_centres({550.0});
  scene.materials = {{"grey", Reflectance(1, rho), RadiantExitance(1, exitance)}};
  return scene;
}

inline void add_surface(Scene& scene, std::string name, Polygon polygon, std::size_t material = 0,
                        bool is_opening = false) {
  scene.surfaces.push_back({std::move(name), material, {std::move(polygon)}, is_opening});
}

/// The six faces of the box [low, high]: seen from inside, or from outside.
inline void add_box(Scene& scene, const std::string& name, const Vec3& low, const Vec3& high,
                    bool from_inside, std::size_t material = 0) {
  const double x0 = low.x(), y0 = low.y(), z0 = low.z();
  const double x1 = high.x(), y1 = high.y(), z1 = high.z();
  const Polygon faces[6] = {
      {{x0, y0, z0}, {x1, y0, z0}, {x1, y1, z0}, {x0, y1, z0}},   // floor, normal +z
      {{x0, y0, z1}, {x0, y1, z1}, {x1, y1, z1}, {x1, y0, z1}},   // ceiling
      {{x0, y0, z0}, {x0, y0, z1}, {x1, y0, z1}, {x1, y0, z0}},   // y low
      {{x0, y1, z0}, {x1, y1, z0}, {x1, y1, z1}, {x0, y1, z1}},   // y high
      {{x0, y0, z0}, {x0, y1, z0}, {x0, y1, z1}, {x0, y0, z1}},   // x low
      {{x1, y0, z0}, {x1, y0, z1}, {x1, y1, z1}, {x1, y1, z0}}};  // x high
  for (int k = 0; k < 6; ++k) {
    Polygon face = faces[k];
    if (!from_inside) face = Polygon(face.rbegin(), face.rend());
    add_surface(scene, name + " " + std::to_string(k), std::move(face), material);
  }
}

/// Closed grey cube [0, edge]^3 seen from inside: floor 0, ceiling 1, walls 2 to 5.
inline Scene cube(double edge_m, double rho, double exitance = 0.0) {
  Scene scene = grey_scene(rho, exitance);
  add_box(scene, "cube", Vec3::Zero(), Vec3::Constant(edge_m), true);
  return scene;
}

/// The cube with a block that stands on its floor: occlusion, buried elements, contact lines.
inline Scene cube_with_block(double edge_m, double rho, double exitance = 0.0) {
  Scene scene = cube(edge_m, rho, exitance);
  add_box(scene, "block", edge_m * Vec3(0.31, 0.37, 0.0), edge_m * Vec3(0.58, 0.66, 0.43), false);
  return scene;
}

}  // namespace truebox::tiny
