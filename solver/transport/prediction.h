// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "mesh/smooth_field.h"
#include "mesh/vertex_radiosity.h"
#include "scene/requirements.h"
#include "transport/form_factors.h"
#include "transport/found_exchange.h"
#include "transport/gather.h"
#include "transport/refined_field.h"
#include "transport/solve_radiosity.h"
#include "transport/visibility.h"

namespace truebox {

struct GridSolution;

/// One grid's system: `source` is rho times direct light, elements x bands, W m^-2 nm^-1.
struct GridTask {
  const Scene& scene;  ///< in the bands that need solving
  const BandMatrix& rho;
  const BandMatrix& source;
  const FormFactorOptions& form_factors;
  const SolveOptions& solve;
  /// To be told what is free of each element, m^2, before `source` is used: direct light of those
  /// that are partly covered becomes that of their free part.
  std::function<void(const Eigen::VectorXd& free_area_m2)> take_free_areas;
  /// What element means lack because near elements are not of one brightness, elements x bands,
  /// from a first solution; empty if that is not wanted. See near_source_correction.
  std::function<BandMatrix(const GridSolution& first)> near_sources;
};

/// Finds form factors and solution of one grid: fills all of it but mesh and direct light.
using SolveGrid = std::function<void(const GridTask& task, GridSolution& grid)>;

/// For whoever solves a grid: calls `solve(source, options)`, which fills reflected, indirect and
/// summary, and, where near sources count, once more with what they add to the source.
void solve_with_near_sources(
    const GridTask& task, GridSolution& grid,
    const std::function<void(const BandMatrix& source, const SolveOptions& options)>& solve);

/// How element means become values at points.
enum class Reconstruction {
  smooth,        ///< quadratics on each piece of surface: SmoothField
  constant,      ///< the mean itself
  averaged,      ///< vertices: mean of the elements around, extrapolated at borders
  least_squares  ///< vertices: the plane through the elements around; both VertexRadiosity
};

struct PredictOptions {
  std::size_t elements = 6000;  ///< of the fine grid, about
  FormFactorOptions form_factors;
  FindExchange find_exchange;  ///< instead of the full matrix of form factors; may be empty
  SolveOptions solve;
  /// Meshes of the three grids, 0 the coarsest, each finer than the one before; uniform if empty
  /// (then `elements` counts). See adapt_mesh.
  std::function<PatchMesh(int grid)> mesh_of_grid;
  /// Correct element means for near elements that are not of one brightness, never with links.
  /// Nothing said: where the finest grid is too coarse to extrapolate (bound_is_reliable);
  /// elsewhere extrapolation takes the same error off, and more.
  std::optional<bool> near_sources;
  /// Up to this many elements of the fine grid `irradiance_on` takes the gathered field, which
  /// follows the light into edges and whose cost grows with the square of that number; beyond, and
  /// with links, the smooth field.
  std::size_t gathered_up_to = 0;
  /// Of the indirect irradiance, where it is asked for at points of surfaces. Direct light is
  /// exact.
  Reconstruction reconstruction = Reconstruction::smooth;
  bool error_shares = false;   ///< solve the middle grid twice, to tell what part is the factors'
  bool sensitivities = false;  ///< of the fine grid to each material's reflectance
  SolveGrid solve_grid;        ///< instead of a matrix or links in this process; may be empty
  /// Told the finest grid's mesh and source, returns its SolveOptions::on_progress; may be empty.
  std::function<std::function<void(double, const BandMatrix&)>(const PatchMesh& mesh,
                                                               const BandMatrix& source)>
      watch_finest;
  Progress progress;
};

/// Where the error comes from: area-weighted means over all surfaces, relative to the mean
/// irradiance, of the worst band. They are not added: grids differ by their form factors as well.
struct ErrorShares {
  double discretisation = 0.0;  ///< |I_h - I_2h|, element by element of the next grid
  /// Of two samplings of the next grid, by other rays or from more points; the finest has more.
  double form_factors = 0.0;
  double solver = 0.0;  ///< its bound, of all three grids
};

/// One grid's solution; matrices are elements x bands, W m^-2 nm^-1.
struct GridSolution {
  PatchMesh mesh;
  std::vector<char> usable;
  Eigen::VectorXd free_area_m2;  ///< of each element: less where another surface covers a part
  BandMatrix direct;             ///< mean irradiance straight from the luminaires
  BandMatrix indirect;           ///< mean irradiance after one reflection or more
  BandMatrix reflected;          ///< rho (direct + indirect); radiosity is this plus own exitance
  FormFactorSummary form_factors;
  std::optional<LinkSummary> links;  ///< where the exchange is hierarchical
  SolveSummary solve;
  /// d (mean radiosity of each surface) / d rho of each material: surfaces x bands a material.
  std::vector<BandMatrix> radiosity_by_reflectance;
};

/// Irradiance (W m^-2 nm^-1) in each band and what it can be wrong by.
struct BoundedIrradiance {
  Eigen::VectorXd value;
  Eigen::VectorXd error_bound;
};

/// Mean irradiance of each surface (W m^-2 nm^-1) and what it can be wrong by, surfaces x bands.
struct SurfaceMeans {
  Eigen::VectorXd area_m2;  ///< of its usable elements; 0: buried, or nothing is there
  BandMatrix irradiance;
  BandMatrix error_bound;
  /// What the bound would be if the grids converged as they are expected to: what bounds of finer
  /// grids are foretold from. Never more than `error_bound`.
  BandMatrix bound_in_order;
};

/// Radiosity of a scene on three nested grids (element edges h, 2h, 4h), and irradiance anywhere:
///   direct light by exact visibility + sum_j F_xj B_j of the reflected radiosity, finest grid.
///
/// The error bound is a posteriori. Direct light carries rounding only. Indirect light is wrong by
/// the grid, the sampled visibility and the solver. The first two differ between the grids; with an
/// order of convergence p, |e_h| <= |I_h - I_2h| / (2^p - 1). Gathered irradiance takes p = 1
/// (measured: 1.7 to 2), surface by surface and without sign, so that differences cannot cancel;
/// values at a point of a surface, or of a cell of the gathered field, take p = lambda, the
/// exponent of the edge singularity, and the largest difference in the element or cell. Two grids
/// that agree by chance are found out by the third: I_h - I_2h counts for no less than (I_2h -
/// I_4h) / 2^p of the expected order. The solver's own bound is added. Neither grid's sampled
/// visibility knows the others'. Where all three grids are too coarse to see a feature the bound
/// cannot know of it: corner tips, and solves of a few hundred elements. Source: grid convergence
/// index, Roache (1994), safety factor 3 for p = 2.
class Prediction {
 public:
  /// Solves. Check `outcome()` before using the answer. The scene must outlive the prediction.
  /// InputError if a surface is not Lambertian.
  Prediction(const Scene& scene, const PredictOptions& options);

  const Scene& scene() const { return *scene_; }
  const Requirements& needs() const { return needs_; }
  const GridSolution& fine() const { return levels_[0]->solution; }
  const GridSolution& coarse() const { return levels_[1]->solution; }
  const GridSolution& coarsest() const { return levels_[2]->solution; }
  const Visibility& visibility() const { return *visibility_; }
  SolveOutcome outcome() const;
  /// Nothing unless options.error_shares.
  const std::optional<ErrorShares>& error_shares() const { return error_shares_; }
  /// d (mean radiosity of each surface) / d rho_m, W m^-2 nm^-1, surfaces x bands of the scene, one
  /// a material; empty unless options.sensitivities. Own and direct light held, as they must be.
  std::vector<BandMatrix> radiosity_by_reflectance() const;
  /// Whether the grids are fine enough for the bound to mean what it says: on average
  /// kPatchesAPiece elements a piece or more. Below, it was seen to miss up to 10 % of test points.
  /// Never with links: three times their estimate is in the bound, which is an estimate then.
  bool bound_is_reliable() const;
  static constexpr double kPatchesAPiece = 40.0;

  /// Irradiance of a surface element anywhere in the scene by gathering; bands of the scene.
  BoundedIrradiance irradiance_at(const Vec3& point, const Vec3& normal) const;

  /// Irradiance at a point of a surface: direct light exact, indirect light from the gathered
  /// field, extrapolated from two grids like gathered values (or the smooth field:
  /// `gathered_up_to`). The first call builds the fields of all grids.
  BoundedIrradiance irradiance_on(std::uint32_t piece, const Vec3& point,
                                  Gather::Scratch& scratch) const;

  /// Mean irradiance of the part of a convex polygon that lies on surfaces facing along its normal;
  /// elements that lie wholly inside count by their own means, which converge faster than values at
  /// points. The bound takes p = 1, element by element of the next grid, without sign. Empty if no
  /// lit surface is there.
  std::optional<BoundedIrradiance> mean_irradiance_over(const Polygon& polygon) const;

  /// Radiosity of each element of the fine grid and its bound, elements x bands of the scene.
  BandMatrix radiosity() const;
  BandMatrix radiosity_bound() const;
  /// Mean irradiance of each element, elements x bands of the scene.
  BandMatrix irradiance() const;
  /// Bound of the mean over a surface of `irradiance()`, surfaces x bands: means converge faster
  /// than values at points. Differences between the grids are taken element by element (those of
  /// the next grid), p = 1, and added without sign.
  BandMatrix surface_irradiance_bound() const;

  /// Better means: extrapolated by a third of the difference between the grids, where the bound is
  /// reliable. On uniform grids their bound is a grid convergence index of three grids: D the
  /// larger of the differences as above, d_1 and d_2 / 2^1.5, the order p observed, log2(d_2 /
  /// d_1), though taken as no less than 1 and no more than 1.5; then
  ///   |e| <= 1.25 D max(1 / (2^p - 1) - 1/3, 1/3),
  /// 1/3 where grids converge faster than the extrapolation takes them to. Meshes of another kind
  /// have no third grid to see an order by: |e| <= d_1. Source: Roache (1998), safety factor 1.25
  /// of three grids.
  SurfaceMeans surface_means() const;

 private:
  struct Level {
    GridSolution solution;
    int split = 0;  // halvings of the coarsest elements
    Reconstruction reconstruction = Reconstruction::smooth;
    std::unique_ptr<Gather> gather;

    /// Built when first asked for: means need none.
    const SmoothField& smooth() const;
    /// Indirect irradiance at a point of an element, as `reconstruction` has it.
    void evaluate(std::uint32_t patch, const Vec3& point, Eigen::Ref<Eigen::VectorXd> value) const;
    const GatheredField& gathered(const Scene& scene, bool occlusion) const;

   private:
    mutable std::once_flag smooth_once, vertices_once, gathered_once;
    mutable std::unique_ptr<VertexRadiosity> vertices;
    mutable std::unique_ptr<SmoothField> smooth_field;
    mutable std::unique_ptr<GatheredField> gathered_field;
  };

  PatchMesh mesh_of(double edge_m, int split, const PredictOptions& options) const;
  static bool is_resolved(const PatchMesh& finest);
  std::unique_ptr<Level> solve_level(double edge_m, int split, const PredictOptions& options) const;
  void differentiate(const ExchangeOperator& exchange, const GridTask& task, const Gather& gather,
                     GridSolution& grid) const;
  ErrorShares find_error_shares(const Level& resampled) const;
  /// Bound of the indirect irradiance within each element, found when first asked for.
  const BandMatrix& indirect_bound() const;
  void compare_grids() const;
  /// The gathered field of three grids, and its bound in each cell, found when first asked for.
  const RefinedField& gathered_field() const;
  void refine_gathered() const;
  Eigen::VectorXd extrapolated(const Eigen::VectorXd& fine, const Eigen::VectorXd& coarse) const;
  Eigen::VectorXd indirect_mean(const Level& level, std::uint32_t piece, const Polygon& part) const;
  Eigen::VectorXd direct_mean(std::uint32_t patch, const Polygon& part, bool is_whole) const;
  BandMatrix indirect_from_surfaces(const Level& level, const Vec3& point, const Vec3& normal,
                                    bool is_secondary) const;
  Eigen::VectorXd expand(const Eigen::VectorXd& distinct) const;
  BandMatrix expand_rows(const BandMatrix& distinct) const;
  /// Between two grids, of each surface's mean indirect irradiance: (mean of a coarser element's
  /// children) - (that element), surfaces x distinct bands.
  struct SurfaceDifferences {
    BandMatrix with_sign, without_sign;
  };
  SurfaceDifferences surface_differences(std::size_t finer, std::size_t coarser) const;
  BandMatrix surface_means_of_finest(Eigen::VectorXd& area_m2) const;
  BandMatrix bound_factors(const BandMatrix& finer, const BandMatrix& coarser) const;
  Eigen::VectorXd solver_bounds() const;

  const Scene* scene_;
  Scene distinct_scene_;  // only the bands that need solving
  Requirements needs_;
  std::array<std::unique_ptr<Level>, 3> levels_;  // finest first
  std::unique_ptr<Visibility> visibility_;
  std::optional<ErrorShares> error_shares_;
  bool gathers_field_ = false, is_uniform_ = false;
  mutable std::once_flag compared_, refined_;
  mutable BandMatrix indirect_bound_;  // elements of the finest grid x distinct bands
  mutable std::unique_ptr<RefinedField> gathered_field_;
  mutable BandMatrix gathered_bound_;  // cells of that field x distinct bands
};

}  // namespace truebox
