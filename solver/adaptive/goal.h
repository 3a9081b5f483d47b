// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <string>
#include <vector>

#include "mesh/smooth_field.h"
#include "sensor/camera.h"

namespace truebox {

/// What the mesh is to be accurate for.
struct Goal {
  enum class Kind {
    everywhere,  ///< relative irradiance of all lit surfaces, by area
    image,       ///< relative irradiance of what a camera sees, by pixels
    surface      ///< mean irradiance of one surface: what a target value or a fit depends on
  };
  /// A place that counts, on a piece of the scene's surfaces (all pieces in their order).
  struct Point {
    std::uint32_t piece = 0;
    Vec3 position_m = Vec3::Zero();
  };

  Kind kind = Kind::everywhere;
  std::vector<Point> points;  ///< of an image
  std::size_t surface = 0;    ///< into Scene::surfaces

  /// Whether weights are random signs, of which many are needed.
  bool is_random() const { return kind != Kind::surface; }
};

/// What a camera sees at about `rays` places of its film.
Goal image_goal(const Scene& scene, const Camera& camera, int rays = 4096);

/// "everywhere", "camera:NAME" or "surface:NAME"; std::invalid_argument that lists what there is.
Goal goal_of_name(const std::string& name, const Scene& scene);

/// What the relative error of each element's field counts for: shares of the mean square that sum
/// to 1; all 0 for the mean of a surface, which no field between elements can change.
Eigen::VectorXd field_weights(const Goal& goal, const PatchMesh& mesh,
                              const std::vector<char>& counts, const SmoothField& places);

/// The source q of the dual system, elements x bands, 1 / (W m^-2 nm^-1): the error of the goal is
///   J = sum_i A_i q_i dE_i
/// for errors dE_i of mean irradiance. `counts`: one flag an element, 0 where buried or an opening.
/// A surface: J is the relative error of its mean. Otherwise every element, or every point, has a
/// random sign, and the mean of J^2 over them is the mean square of the relative error (Hutchinson
/// 1990).
BandMatrix dual_source(const Goal& goal, const PatchMesh& mesh, const std::vector<char>& counts,
                       const BandMatrix& irradiance, const SmoothField& places,
                       std::mt19937_64& random);

/// 1 / irradiance of an element, not more than if it had 1 % of the scene's mean: relative errors
/// of what is darker count less.
BandMatrix inverse_irradiance(const PatchMesh& mesh, const std::vector<char>& counts,
                              const BandMatrix& irradiance);

}  // namespace truebox
