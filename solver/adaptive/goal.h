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
    irradiance,  ///< irradiance of all lit surfaces relative to its mean, by area: rms irradiance
    image,       ///< relative irradiance of what a camera sees, by pixels
    surface,     ///< mean irradiance of one surface: what a target value or a fit depends on
    parameter    ///< a material's reflectance as a fit finds it from what is seen of the scene
  };
  /// A place that counts, on a piece of the scene's surfaces (all pieces in their order).
  struct Point {
    std::uint32_t piece = 0;
    Vec3 position_m = Vec3::Zero();
  };

  Kind kind = Kind::everywhere;
  std::vector<Point> points;  ///< of an image; of a parameter seen by a camera
  std::size_t surface = 0;    ///< into Scene::surfaces
  std::size_t material = 0;   ///< into Scene::materials, of a parameter

  /// Whether weights are random signs, of which many are needed.
  bool is_random() const { return kind != Kind::surface && kind != Kind::parameter; }
};

/// What a camera sees at about `rays` places of its film.
Goal image_goal(const Scene& scene, const Camera& camera, int rays = 4096);

/// "everywhere", "irradiance", "camera:NAME" or "surface:NAME"; std::invalid_argument that lists
/// what there is.
Goal goal_of_name(const std::string& name, const Scene& scene);

/// What the relative error of each element's field counts for: shares of the mean square that sum
/// to 1; all 0 for the mean of a surface and for a parameter, in which a field's errors between
/// elements cancel.
Eigen::VectorXd field_weights(const Goal& goal, const PatchMesh& mesh,
                              const std::vector<char>& counts, const SmoothField& places);

/// The source q of the dual system, elements x bands, 1 / (W m^-2 nm^-1): the error of the goal is
///   J = sum_i A_i q_i dE_i
/// for errors dE_i of mean irradiance. `counts`: one flag an element, 0 where buried or an opening.
/// A surface: J is the relative error of its mean. A parameter: J is the relative error of rho_m
/// that least squares finds, band by band, from radiosities whose relative errors count alike,
///   J = sum_i w_i s_i (dE_i / E_i) / sum_i w_i s_i^2,   s_i = d ln B_i / d ln rho_m,
/// w_i the area or the pixels of an element, all else known. `sensitivity` is dB / d ln rho_m
/// divided by rho_i, elements x bands; only a parameter asks for it. Otherwise every element, or
/// every point, has a random sign, and the mean of J^2 over them is the mean square of the relative
/// error (Hutchinson 1990).
BandMatrix dual_source(const Goal& goal, const PatchMesh& mesh, const std::vector<char>& counts,
                       const BandMatrix& irradiance, const SmoothField& places,
                       const BandMatrix& sensitivity, std::mt19937_64& random);

/// What an error of an element's irradiance is relative to, inverted: to that irradiance, though
/// not to less than 1 % of the scene's mean, so that errors of what is darker count less; of
/// Goal::Kind::irradiance, to that mean everywhere.
BandMatrix inverse_irradiance(const Goal& goal, const PatchMesh& mesh,
                              const std::vector<char>& counts, const BandMatrix& irradiance);

}  // namespace truebox
