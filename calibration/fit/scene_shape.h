// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "fit/scene_fit.h"

namespace truebox {

/// What of a camera may be unknown: turned about its own axes (right, down, forward; rad), moved
/// along them (mm), its focal length (mm) and principal point (px of the scene's camera), and
/// coefficients of its lens (1). Turns and moves count from where the scene file has the camera.
enum class CameraTerm {
  tilt,
  pan,
  roll,
  right,
  down,
  forward,
  focal_length,
  principal_point_x,
  principal_point_y,
  k1,
  k2,
  p1,
  p2,
  k3,
};
std::string to_string(CameraTerm term);
const char* unit_of(CameraTerm term);

/// An unknown of a camera, or of the place or size of surfaces that move together.
struct ShapeUnknown {
  ParameterName name;
  Hold hold = Hold::free;
  double known = 0.0, standard_uncertainty = 0.0;  ///< if `prior`; `known` is the start as well
  std::string camera;                              ///< empty: surfaces
  CameraTerm term = CameraTerm::tilt;
  std::vector<std::size_t> surfaces;  ///< of the scene
  Vec3 move = Vec3::Zero();           ///< direction; the value is in mm along it
  Vec3 stretch = Vec3::Zero();        ///< or: X += value * stretch o (X - pivot); the value is 1
  Vec3 pivot_m = Vec3::Zero();

  bool moves_surfaces() const { return camera.empty(); }
  const char* unit() const;
};

ShapeUnknown camera_unknown(const Scene& scene, const std::string& camera, CameraTerm term);

/// A scene whose cameras and surfaces are not known exactly, with the model of where they are now.
struct ShapedScene {
  /// One of the model's views.
  struct View {
    std::string camera;
    std::array<int, 2> pixels{};
  };
  Scene original;  ///< at value 0 of turns, moves and stretches
  std::vector<ShapeUnknown> unknowns;
  std::vector<double> values;  ///< one an unknown
  std::vector<View> views;
  std::unique_ptr<Scene> scene;
  std::unique_ptr<SceneModel> model;

  /// The scene moves its surfaces (or some unknown may), so that its solutions must not carry the
  /// noise of sampled form factors.
  bool moves_surfaces() const;
  /// About how far anything moves in the pictures between two sets of values, at most; px.
  double motion_px(const std::vector<double>& from, const std::vector<double>& to) const;
  CameraDescription camera(const std::vector<double>& at, std::size_t view) const;
  Scene scene_at(const std::vector<double>& at) const;
  /// Moves scene, model and views there; the windows of the views stay what they are. All or
  /// nothing if progress throws.
  void move_to(const std::vector<double>& at);
  /// Of unknowns that are not held: d ln B / d value of every block, by central differences of the
  /// whole prediction: cameras are moved by 0.02 px and look at the same radiosity again; surfaces
  /// by 5e-4 of the scene's diagonal, and everything is found anew.
  std::vector<ShapeTerm> linearised(const SceneState& state) const;

  /// How much of an unknown moves something by 1 px or so: a hundredth of the scene for surfaces.
  double size_of(std::size_t unknown) const;

 private:
  BandMatrix light(const SceneModel& in, const std::vector<double>& at, std::size_t view,
                   const SceneState& state, const ElementLight& elements) const;
};

struct ShapeFitOptions : SceneFitOptions {
  int most_rounds = 12;
  /// Ends when no unknown moves by more than this share of its u.
  double tolerance = 1e-3;
};

/// fit_scene where cameras and surfaces are unknown too: linearised where they are, fitted, moved
/// there, until they stay (Gauss-Newton in what moves, the full fit in all else). `problem.model`
/// and `problem.shape` follow. The readings' windows stay the same: what moves by more than their
/// margin needs new ones (see fit_measurement). Without such unknowns it is fit_scene.
SceneFit fit_shaped_scene(SceneFitProblem& problem, ShapedScene& shaped,
                          const ShapeFitOptions& options);

}  // namespace truebox
