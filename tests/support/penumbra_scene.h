// SPDX-License-Identifier: BSD-3-Clause
// A square lamp, a square blocker below it and a floor: shadows whose borders are known.
#pragma once

#include <cmath>

#include "support/tiny_scenes.h"

namespace truebox::tiny {

struct PenumbraScene {
  double lamp_m = 0.2;     ///< half edge
  double height_m = 2.0;   ///< of the lamp
  double blocker_m = 0.4;  ///< half edge
  double gap_m = 0.8;      ///< blocker above the floor
  double turn_rad = 0.0;   ///< of the blocker about the vertical

  Polygon blocker() const {
    Polygon square;
    for (int k = 0; k < 4; ++k) {
      const double angle_rad = turn_rad + M_PI_4 + k * M_PI_2;
      square.push_back({M_SQRT2 * blocker_m * std::cos(angle_rad),
                        M_SQRT2 * blocker_m * std::sin(angle_rad), gap_m});
    }
    return square;
  }
  Polygon lamp() const {
    return {{-lamp_m, -lamp_m, height_m},
            {-lamp_m, lamp_m, height_m},
            {lamp_m, lamp_m, height_m},
            {lamp_m, -lamp_m, height_m}};
  }

  /// Floor 0, lamp 1, blocker 2, whose lit side is up.
  Scene scene() const {
    Scene scene = grey_scene(0.5);
    scene.materials.push_back({"lamp", Reflectance(1, 0.0), RadiantExitance(1, 1.0)});
    add_surface(scene, "floor", {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}});
    add_surface(scene, "lamp", lamp(), 1);
    add_surface(scene, "blocker", blocker());
    return scene;
  }

  /// Where the shadow of the blocker's edge x = blocker_m begins and ends, seen from the lamp's
  /// edges at +lamp_m (the umbra) and -lamp_m (the penumbra), m.
  double umbra_m() const { return blocker_m + (blocker_m - lamp_m) * gap_m / (height_m - gap_m); }
  double penumbra_m() const {
    return blocker_m + (blocker_m + lamp_m) * gap_m / (height_m - gap_m);
  }
};

}  // namespace truebox::tiny
