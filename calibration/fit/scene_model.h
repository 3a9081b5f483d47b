// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "fit/view_blocks.h"
#include "mesh/patch_mesh.h"
#include "mesh/smooth_field.h"
#include "radiometry/progress.h"
#include "sensor/camera.h"
#include "transport/exchange_operator.h"
#include "transport/form_factors.h"
#include "transport/gather.h"
#include "transport/solve_radiosity.h"

namespace truebox {

/// One flat piece as a reading shows it, and how the elements' light makes its mean.
struct ViewPart {
  std::size_t surface = 0;  ///< into Scene::surfaces
  double share = 1.0;       ///< of the reading's pixels
  /// Mean irradiance straight from each luminaire at unit exitance; 1.
  Eigen::VectorXd direct;
  /// The mean indirect irradiance is the sum of weight times that of the element; they sum to 1.
  std::vector<std::pair<std::uint32_t, double>> weights;
  /// Standard uncertainty of `direct` that comes from its sample points, relative to it.
  double sampling_u = 0.0;
  /// Radiosity by which each luminaire at unit exitance would be seen in a gloss of strength 1:
  /// see GlossLobe; empty where none is asked for.
  Eigen::VectorXd gloss;
};

/// The pixels of one reading and what they show: one piece, or several where an edge runs through.
struct ViewBlock {
  std::size_t view = 0;               ///< which camera, in the order they were added
  std::uint32_t element = 0;          ///< into SceneModel::mesh().patches; of the largest part
  std::size_t surface = 0;            ///< into Scene::surfaces; likewise
  std::vector<std::uint32_t> pixels;  ///< y * width + x; empty for blocks that are no pixels'
  std::vector<ViewPart> parts;        ///< what is black is not among them
  bool is_mixed = false;

  double sampling_u() const;  ///< of all parts together
};

/// What may vary: rho of each material and the exitance (W m^-2 nm^-1) of each luminaire.
struct SceneState {
  BandMatrix reflectance;  ///< materials x bands, 0 <= rho < 1
  BandMatrix exitance;     ///< luminous materials (SceneModel::lamps()) x bands
  Eigen::VectorXd gloss;   ///< strength of each material's lobe, the same in all bands; 0: none
  bool interreflection = true;
};

/// Which derivatives are asked for: each costs a solve.
struct WantedDerivatives {
  std::vector<char> reflectance;  ///< one a material
  bool exitance = false;
  bool gloss = false;  ///< of all materials; costs nothing
};

/// Radiosity (W m^-2 nm^-1) of each block and its exact derivatives; blocks x bands.
struct BlockRadiosity {
  BandMatrix value;
  std::vector<BandMatrix> by_reflectance;  ///< one a material: d value / d rho of the same band;
                                           ///< empty where it was not asked for
  std::vector<BandMatrix> by_exitance;     ///< one a luminaire: d value / d exitance
  std::vector<BandMatrix> by_gloss;        ///< one a material: d value / d strength of its gloss
  SolveOutcome outcome = SolveOutcome::not_run;
};

struct SceneModelOptions {
  std::size_t elements = 1500;  ///< about
  double edge_m = 0.0;          ///< of the elements; above 0 it takes the place of `elements`
  FormFactorOptions form_factors;
  int margin_px = 1;  ///< pixels left out along every edge of a surface
  int tile_px = 0;    ///< side of the squares of pixels that hold edges; 0: edges are left out
  int samples = 16;   ///< points of a block at which direct light is found
  std::vector<double> roughness;  ///< GGX alpha of each material's gloss; 0 or missing: none
  double solver_bound = 1e-9;
  Progress progress;
};

/// Irradiance of the elements after one reflection or more from each luminaire at unit exitance,
/// elements x bands; 1.
struct ElementLight {
  std::vector<BandMatrix> indirect;  ///< one a luminaire
  SolveOutcome outcome = SolveOutcome::not_run;
};

/// A scene of fixed geometry as a function of its reflectances and exitances:
///   B(x) = M + rho (D(x) + I(x)) + k S(x),     I = F B,
/// direct light D by exact visibility at the pixels, indirect light I of the elements, a plane
/// through neighbouring elements inside each; k S is the lamps' gloss as this camera sees it (see
/// GlossLobe), which lights nothing else. Meshing, form factors, visibility, direct light and the
/// way from elements to pixels are found once; afterwards an answer costs one solve a luminaire,
/// its derivatives one more a material.
/// Derivatives: reflectance_sensitivity (Marks et al. 1990); B is linear in exitances and gloss.
class SceneModel {
 public:
  /// The scene must outlive the model. InputError if a surface is not Lambertian.
  SceneModel(const Scene& scene, const SceneModelOptions& options);

  /// Adds the blocks of a camera; returns the view's number. `uses`: see PixelWindowOptions.
  std::size_t add_view(const CameraDescription& camera,
                       const std::function<bool(int x, int y)>& uses = {});
  /// The blocks of windows that were found before, one each, as this camera sees them.
  std::vector<ViewBlock> see(const CameraDescription& camera, std::size_t view,
                             const std::vector<PixelWindow>& windows) const;
  /// Adds a view of such windows: the same readings of a moved camera or scene.
  std::size_t add_windows(const CameraDescription& camera, PixelWindows windows);
  void clear_views();
  /// The same views as other cameras see them, one each; all or nothing if progress throws.
  void move_views(const std::vector<CameraDescription>& cameras);
  void set_progress(Progress progress) { options_.progress = std::move(progress); }
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
  /// What was added as a camera's view; no windows for views without one.
  const PixelWindows& windows(std::size_t view) const { return windows_[view]; }
  const SceneModelOptions& options() const { return options_; }

  SceneState state() const;  ///< as the scene file has it
  /// `wanted` may be null: no derivatives.
  BlockRadiosity radiosity(const SceneState& state, const WantedDerivatives* wanted) const;

  /// The solve alone, and what blocks of `see` make of it: value and, of `by_exitance` and
  /// `by_gloss`, what is wanted.
  ElementLight element_light(const SceneState& state) const;
  BlockRadiosity radiosity_of(const std::vector<ViewBlock>& blocks, const SceneState& state,
                              const ElementLight& light, const WantedDerivatives* wanted) const;

 private:
  std::vector<std::pair<std::uint32_t, double>> plane_weights(std::uint32_t element,
                                                              const Vec3& at) const;
  std::vector<std::pair<std::uint32_t, double>> field_weights(std::uint32_t piece,
                                                              const Vec3& at) const;
  ViewPart part_of(const PixelBlock& pixels, Gather::Scratch& scratch) const;
  BandMatrix element_reflectance(const SceneState& state) const;
  BandMatrix by_reflectance(std::size_t material, const SceneState& state,
                            const ElementLight& light, SolveOutcome& outcome) const;
  std::size_t material_of(const ViewPart& part) const {
    return scene_->surfaces[part.surface].material;
  }

  const Scene* scene_;
  SceneModelOptions options_;
  std::vector<std::size_t> lamps_;
  Scene lamp_scene_;  // one band a luminaire, in which it alone emits 1
  PatchMesh mesh_;
  FormFactors factors_;
  BandMatrix direct_;  // elements x luminaires, at unit exitance
  std::unique_ptr<Gather> gather_;
  std::unique_ptr<SmoothField> finder_;  // of a point's element
  std::vector<std::vector<std::uint32_t>> neighbours_;
  std::vector<std::vector<std::uint32_t>> elements_of_corner_;  // usable ones, of each vertex
  std::vector<ViewBlock> blocks_;
  std::vector<PixelWindows> windows_;
  std::vector<std::vector<std::size_t>> pixels_of_surface_;
};

}  // namespace truebox
