// SPDX-License-Identifier: BSD-3-Clause
// Scenes of the closed forms. Internal to this folder.
#pragma once

#include "scene/scene.h"

namespace truebox {

/// Surfaces of box_scene, in their order; the other walls follow.
inline constexpr std::size_t kBoxFloor = 0, kBoxCeiling = 1, kBoxWall = 2;

/// Closed box [0, size] with z up, grey, one band, reflectance 0 and no light.
Scene box_scene(const Vec3& size_m);

/// Two facing squares of the given edge and gap.
Scene plates_scene(double edge_m, double gap_m);

/// A scene of one horizontal luminous rectangle at height z facing down.
Scene downlight_scene(const Vec3& low_corner_m, double edge_m, double exitance);

/// A scene of one horizontal rectangle [0, edge]^2 facing up that sends `exitance`.
Scene bright_floor_scene(double edge_m, double exitance);

}  // namespace truebox
