// SPDX-License-Identifier: BSD-3-Clause
#include "verification/box_scene.h"

namespace truebox {
namespace {

Scene empty_scene(double exitance) {
  Scene scene;
  scene.bands = WavelengthGrid::from_centres({550.0});
  scene.materials = {{"grey", Reflectance(1, 0.0), RadiantExitance(1, exitance)}};
  return scene;
}

void add(Scene& scene, const char* name, Polygon polygon) {
  scene.surfaces.push_back({name, 0, {std::move(polygon)}, false});
}

}  // namespace

Scene box_scene(const Vec3& s) {
  Scene scene = empty_scene(0.0);
  const double x = s.x(), y = s.y(), z = s.z();
  add(scene, "floor", {{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}});
  add(scene, "ceiling", {{0, 0, z}, {0, y, z}, {x, y, z}, {x, 0, z}});
  add(scene, "wall y=0", {{0, 0, 0}, {0, 0, z}, {x, 0, z}, {x, 0, 0}});
  add(scene, "wall y=1", {{0, y, 0}, {x, y, 0}, {x, y, z}, {0, y, z}});
  add(scene, "wall x=0", {{0, 0, 0}, {0, y, 0}, {0, y, z}, {0, 0, z}});
  add(scene, "wall x=1", {{x, 0, 0}, {x, 0, z}, {x, y, z}, {x, y, 0}});
  return scene;
}

Scene plates_scene(double edge_m, double gap_m) {
  Scene scene = empty_scene(0.0);
  const double a = edge_m, g = gap_m;
  add(scene, "lower", {{0, 0, 0}, {a, 0, 0}, {a, a, 0}, {0, a, 0}});
  add(scene, "upper", {{0, 0, g}, {0, a, g}, {a, a, g}, {a, 0, g}});
  return scene;
}

Scene downlight_scene(const Vec3& c, double a, double exitance) {
  Scene scene = empty_scene(exitance);
  add(scene, "light",
      {{c.x(), c.y(), c.z()},
       {c.x(), c.y() + a, c.z()},
       {c.x() + a, c.y() + a, c.z()},
       {c.x() + a, c.y(), c.z()}});
  return scene;
}

Scene bright_floor_scene(double a, double exitance) {
  Scene scene = empty_scene(exitance);
  add(scene, "floor", {{0, 0, 0}, {a, 0, 0}, {a, a, 0}, {0, a, 0}});
  return scene;
}

}  // namespace truebox
