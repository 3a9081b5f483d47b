// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/patch_mesh.h"
#include "radiometry/progress.h"
#include "sensor/camera.h"
#include "transport/exchange_operator.h"
#include "transport/form_factors.h"
#include "transport/solve_radiosity.h"

namespace truebox {

/// Pixels of one camera that show the same element, and how the element's light makes their mean.
struct ViewBlock {
  std::size_t view = 0;               ///< which camera, in the order they were added
  std::uint32_t element = 0;          ///< into SceneModel::mesh().patches
  std::size_t surface = 0;            ///< into Scene::surfaces
  std::vector<std::uint32_t> pixels;  ///< y * width + x; empty for blocks that are no pixels'
  /// Mean irradiance straight from each luminaire at unit exitance, over the pixels; 1.
  Eigen::VectorXd direct;
  /// The mean indirect irradiance is the sum of weight times that of the element; they sum to 1.
  std::vector<std::pair<std::uint32_t, double>> weights;
  /// Standard uncertainty of `direct` that comes from its sample points, relative to it.
  double sampling_u = 0.0;
};

/// What may vary: rho of each material and the exitance (W m^-2 nm^-1) of each luminaire.
struct SceneState {
  BandMatrix reflectance;  ///< materials x bands, 0 <= rho < 1
  BandMatrix exitance;     ///< luminous materials (SceneModel::lamps()) x bands
  bool interreflection = true;
};

/// Which derivatives are asked for: each costs a solve.
struct WantedDerivatives {
  std::vector<char> reflectance;  ///< one a material
  bool exitance = false;
};

/// Radiosity (W m^-2 nm^-1) of each block and its exact derivatives; blocks x bands.
struct BlockRadiosity {
  BandMatrix value;
  std::vector<BandMatrix> by_reflectance;  ///< one a material: d value / d rho of the same band;
                                           ///< empty where it was not asked for
  std::vector<BandMatrix> by_exitance;     ///< one a luminaire: d value / d exitance
  SolveOutcome outcome = SolveOutcome::not_run;
};

struct SceneModelOptions {
  std::size_t elements = 1500;  ///< about
  double edge_m = 0.0;          ///< of the elements; above 0 it takes the place of `elements`
  FormFactorOptions form_factors;
  int margin_px = 1;  ///< pixels left out along every edge of a surface
  int samples = 16;   ///< points of a block at which direct light is found
  double solver_bound = 1e-9;
  Progress progress;
};

/// A scene of fixed geometry as a function of its reflectances and exitances:
///   B(x) = M + rho (D(x) + I(x)),     I = F B,
/// direct light D by exact visibility at the pixels, indirect light I of the elements, a plane
/// through neighbouring elements inside each. Meshing, form factors, visibility, direct light and
/// the way from elements to pixels are found once; afterwards an answer costs one solve a
/// luminaire, its derivatives one more a material.
/// Derivatives: reflectance_sensitivity (Marks et al. 1990); B is linear in the exitances.
class SceneModel {
 public:
  /// The scene must outlive the model. InputError if a surface is not Lambertian.
  SceneModel(const Scene& scene, const SceneModelOptions& options);

  /// Adds the blocks of a camera; returns the view's number.
  std::size_t add_view(const CameraDescription& camera);
  /// Adds one block an element (elements of luminaires and openings left out): what a reader
  /// without a camera would see. Returns the view's number.
  std::size_t add_elements();
  /// Adds one block that reads the mean of a surface's elements, for a spot meter.
  std::size_t add_surface_means();

  const Scene& scene() const { return *scene_; }
  const PatchMesh& mesh() const { return mesh_; }
  const FormFactors& factors() const { return factors_; }
  const std::vector<ViewBlock>& blocks() const { return blocks_; }
  /// Materials that emit, into Scene::materials.
  const std::vector<std::size_t>& lamps() const { return lamps_; }
  /// Per surface and camera pixel: how many pixels of a view showed it before any were left out.
  const std::vector<std::size_t>& pixels_of_surface(std::size_t view) const {
    return pixels_of_surface_[view];
  }
  std::size_t views() const { return pixels_of_surface_.size(); }

  SceneState state() const;  ///< as the scene file has it
  /// `wanted` may be null: no derivatives.
  BlockRadiosity radiosity(const SceneState& state, const WantedDerivatives* wanted) const;

 private:
  std::vector<std::pair<std::uint32_t, double>> plane_weights(std::uint32_t element,
                                                              const Vec3& at) const;
  BandMatrix element_reflectance(const SceneState& state) const;
  BandMatrix at_blocks(const BandMatrix& elements) const;

  const Scene* scene_;
  SceneModelOptions options_;
  std::vector<std::size_t> lamps_;
  Scene lamp_scene_;  // one band a luminaire, in which it alone emits 1
  PatchMesh mesh_;
  FormFactors factors_;
  BandMatrix direct_;  // elements x luminaires, at unit exitance
  std::vector<std::vector<std::uint32_t>> neighbours_;
  std::vector<ViewBlock> blocks_;
  std::vector<std::vector<std::size_t>> pixels_of_surface_;
};

}  // namespace truebox
