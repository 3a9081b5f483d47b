// SPDX-License-Identifier: BSD-3-Clause
#include "transport/prediction.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "transport/direct_light.h"
#include "transport/grid_difference.h"
#include "transport/near_sources.h"
#include "transport/sensitivity.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kFinestSplit = 2;  // halvings of the coarsest of three grids

constexpr int kGatherAgainDepth = 3;  // receivers within about half an element of the fine grid

BandMatrix reflectance_of(const PatchMesh& mesh, const Scene& scene) {
  BandMatrix rho(static_cast<Index>(mesh.size()), static_cast<Index>(scene.bands.size()));
  for (Index i = 0; i < rho.rows(); ++i) {
    const auto& values =
        scene.material_of(scene.surfaces[mesh.surface_of(mesh.patches[i])]).reflectance.values;
    rho.row(i) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), rho.cols());
  }
  return rho;
}

Eigen::VectorXd areas_of(const PatchMesh& mesh) {
  Eigen::VectorXd area_m2(static_cast<Index>(mesh.size()));
  for (Index i = 0; i < area_m2.size(); ++i)
    area_m2[i] = mesh.patches[static_cast<std::size_t>(i)].area_m2;
  return area_m2;
}

FoundExchange full_matrix(const ExchangeRequest& request) {
  auto factors = std::make_unique<FormFactors>(
      form_factors(request.mesh, request.scene, request.visibility, request.options));
  FoundExchange found;
  found.usable = factors->usable;
  found.summary = factors->summary;
  found.exchange = std::make_unique<DenseExchange>(std::move(factors));
  return found;
}

}  // namespace

Prediction::Prediction(const Scene& scene, const PredictOptions& options)
    : scene_(&scene), needs_(requirements(scene)) {
  require_lambertian(scene);
  is_uniform_ = !options.mesh_of_grid;
  distinct_scene_ = in_bands(scene, needs_.distinct_bands);
  const double edge_m = edge_for_count(scene, std::max<std::size_t>(1, options.elements / 16));
  PredictOptions chosen = options;
  if (needs_.interreflection) {
    const PatchMesh finest = mesh_of(edge_m, kFinestSplit, options);
    // The finest grid decides; better told before the others are solved.
    if (!options.find_exchange && !options.solve_grid)
      require_memory(finest.size(), options.form_factors);
    if (!options.near_sources) chosen.near_sources = !is_resolved(finest);
  }
  for (int k = 2; k >= 0; --k) levels_[k] = solve_level(edge_m, kFinestSplit - k, chosen);
  if (options.error_shares && needs_.interreflection) {
    PredictOptions again = chosen;
    again.form_factors.seed += 1000;
    again.form_factors.outline_points = options.form_factors.outline_points == 4 ? 3 : 4;
    again.sensitivities = false;
    error_shares_ = find_error_shares(*solve_level(edge_m, 1, again));
  }
  visibility_ = std::make_unique<Visibility>(fine().mesh, scene);
  gathers_field_ =
      needs_.interreflection && !fine().links && fine().mesh.size() <= options.gathered_up_to;
}

PatchMesh Prediction::mesh_of(double edge_m, int split, const PredictOptions& options) const {
  return options.mesh_of_grid ? options.mesh_of_grid(split)
                              : uniform_mesh(distinct_scene_, edge_m, split);
}

std::unique_ptr<Prediction::Level> Prediction::solve_level(double edge_m, int split,
                                                           const PredictOptions& options) const {
  auto level = std::make_unique<Level>();
  level->split = split;
  level->reconstruction = options.reconstruction;
  GridSolution& grid = level->solution;
  grid.mesh = mesh_of(edge_m, split, options);
  const auto bands = static_cast<Index>(distinct_scene_.bands.size());
  level->gather = std::make_unique<Gather>(grid.mesh, distinct_scene_, needs_.occlusion);
  const ElementTree tree = element_tree(grid.mesh);
  const ShaftCulling culling(grid.mesh, distinct_scene_, needs_.occlusion);
  grid.direct =
      mean_direct(grid.mesh, distinct_scene_, *level->gather, tree, culling, options.progress);
  const BandMatrix rho = reflectance_of(grid.mesh, distinct_scene_);
  BandMatrix source = rho.cwiseProduct(grid.direct);
  grid.free_area_m2 = areas_of(grid.mesh);
  if (!needs_.interreflection) {
    grid.usable.assign(grid.mesh.size(), 1);
    grid.indirect = BandMatrix::Zero(rho.rows(), bands);
    grid.reflected = source;
    grid.solve.outcome = SolveOutcome::converged;
    grid.solve.error_bound = Eigen::VectorXd::Zero(bands);
    return level;
  }
  FormFactorOptions factor_options = options.form_factors;
  factor_options.occlusion = needs_.occlusion;
  factor_options.seed = options.form_factors.seed + static_cast<std::uint64_t>(split);
  factor_options.progress = options.progress;
  const Visibility visibility(grid.mesh, distinct_scene_);
  GridTask task{distinct_scene_, rho, source, factor_options, options.solve, {}, {}};
  task.take_free_areas = [&](const Eigen::VectorXd& free_area_m2) {
    for (Index i = 0; i < free_area_m2.size(); ++i) {
      if (free_area_m2[i] == grid.free_area_m2[i]) continue;
      grid.direct.row(i) = mean_direct_of_free_part(grid.mesh, distinct_scene_, *level->gather,
                                                    visibility, static_cast<std::uint32_t>(i));
      source.row(i) = rho.row(i).cwiseProduct(grid.direct.row(i));
    }
    grid.free_area_m2 = free_area_m2;
  };
  if (options.near_sources.value_or(false))
    task.near_sources = [&](const GridSolution& first) {
      return near_source_correction(first.mesh, distinct_scene_, *level->gather, first.usable,
                                    first.free_area_m2, rho, rho.cwiseProduct(first.indirect));
    };
  if (options.solve_grid) {
    options.solve_grid(task, grid);
    return level;
  }
  const FindExchange find = options.find_exchange ? options.find_exchange : full_matrix;
  FoundExchange found =
      find({grid.mesh, distinct_scene_, visibility, culling, rho, source, factor_options});
  grid.usable = std::move(found.usable);
  task.take_free_areas(found.exchange->area_m2());
  grid.form_factors = found.summary;
  grid.links = found.links;
  if (found.links) task.near_sources = {};  // they split bright sources themselves
  auto watch = split == kFinestSplit ? options.watch_finest : nullptr;  // the first solution
  solve_with_near_sources(task, grid, [&](const BandMatrix& of, const SolveOptions& how) {
    SolveOptions watched = how;
    if (watch) watched.on_progress = std::exchange(watch, nullptr)(grid.mesh, of);
    grid.solve = solve_radiosity(*found.exchange, rho, of, watched, grid.reflected,
                                 options.progress, &grid.indirect);
  });
  if (options.sensitivities && split == kFinestSplit)
    differentiate(*found.exchange, task, *level->gather, grid);
  return level;
}

void solve_with_near_sources(
    const GridTask& task, GridSolution& grid,
    const std::function<void(const BandMatrix& source, const SolveOptions& options)>& solve) {
  solve(task.source, task.solve);
  if (!task.near_sources || grid.solve.outcome != SolveOutcome::converged) return;
  const SolveSummary first = std::move(grid.solve);
  const BandMatrix missing = task.near_sources(grid);
  const BandMatrix more = task.rho.cwiseProduct(missing);
  const BandMatrix reflected = std::move(grid.reflected);
  const BandMatrix indirect = std::move(grid.indirect) + missing;
  // What they add is small and need not be known to more digits than the whole.
  SolveOptions rest = task.solve;
  rest.method = SolveMethod::conjugate_gradient;  // less than nothing may be missing: no shooting
  const Eigen::ArrayXd part = more.cwiseAbs().colwise().maxCoeff().transpose();
  const Eigen::ArrayXd whole = reflected.cwiseAbs().colwise().maxCoeff().transpose();
  rest.relative_bound = std::clamp(
      rest.relative_bound * (part > 0.0).select(whole / part.max(1e-300), 1e300).minCoeff(),
      rest.relative_bound, 0.1);
  solve(more, rest);
  grid.reflected += reflected;
  grid.indirect += indirect;
  grid.solve.bands_reduced = first.bands_reduced;
  grid.solve.iterations += first.iterations;
  grid.solve.matrix_passes += first.matrix_passes;
  grid.solve.residual_history.insert(grid.solve.residual_history.begin(),
                                     first.residual_history.begin(), first.residual_history.end());
  // What is missing is off by no more than twice the first solution's error: brightness less mean.
  const double row_sum = std::max(1.0, grid.form_factors.row_sum_max);
  for (Index k = 0; k < first.error_bound.size(); ++k) {
    const double q = task.rho.col(k).maxCoeff() * row_sum;
    grid.solve.error_bound[k] += q < 1.0 ? (1.0 + 2.0 * q / (1.0 - q)) * first.error_bound[k]
                                         : std::numeric_limits<double>::infinity();
  }
}

const SmoothField& Prediction::Level::smooth() const {
  std::call_once(smooth_once, [this] {
    smooth_field = std::make_unique<SmoothField>(solution.mesh, solution.usable, solution.indirect);
  });
  return *smooth_field;
}

void Prediction::Level::evaluate(std::uint32_t patch, const Vec3& point,
                                 Eigen::Ref<Eigen::VectorXd> value) const {
  if (reconstruction == Reconstruction::smooth) return smooth().evaluate(patch, point, value);
  if (reconstruction == Reconstruction::constant) {
    value = solution.indirect.row(patch).transpose();
    return;
  }
  std::call_once(vertices_once, [this] {
    vertices = std::make_unique<VertexRadiosity>(solution.mesh, solution.usable, solution.indirect,
                                                 reconstruction == Reconstruction::averaged
                                                     ? VertexRule::averaged
                                                     : VertexRule::least_squares);
  });
  vertices->evaluate(patch, point, value);
}

const GatheredField& Prediction::Level::gathered(const Scene& scene, bool occlusion) const {
  std::call_once(gathered_once, [&] {
    gathered_field = std::make_unique<GatheredField>(FieldSources{
        solution.mesh, scene, solution.usable, solution.reflected, smooth(), *gather, occlusion});
  });
  return *gathered_field;
}

SolveOutcome Prediction::outcome() const {
  for (const auto& level : levels_)
    if (level->solution.solve.outcome != SolveOutcome::converged)
      return level->solution.solve.outcome;
  return SolveOutcome::converged;
}

void Prediction::differentiate(const ExchangeOperator& exchange, const GridTask& task,
                               const Gather& gather, GridSolution& grid) const {
  const BandMatrix& rho = task.rho;
  const SolvedSystem system{exchange, rho, grid.direct, grid.indirect};
  const auto surfaces = static_cast<Index>(distinct_scene_.surfaces.size());
  SolveOptions quiet = task.solve;
  quiet.on_progress = {};
  for (std::size_t m = 0; m < distinct_scene_.materials.size(); ++m) {
    std::vector<char> is_in_material(grid.mesh.size());
    for (std::size_t i = 0; i < grid.mesh.size(); ++i)
      is_in_material[i] =
          distinct_scene_.surfaces[grid.mesh.surface_of(grid.mesh.patches[i])].material == m;
    BandMatrix derivative, mean = BandMatrix::Zero(surfaces, rho.cols());
    reflectance_sensitivity(system, is_in_material, quiet, derivative);
    if (task.near_sources) {  // what they add has a derivative, too
      BandMatrix share = BandMatrix::Zero(rho.rows(), rho.cols());
      for (std::size_t i = 0; i < grid.mesh.size(); ++i)
        if (is_in_material[i]) share.row(static_cast<Index>(i)).setOnes();
      const BandMatrix rest = derivative - share.cwiseProduct(grid.direct);
      BandMatrix more;
      solve_radiosity(
          exchange, rho,
          rho.cwiseProduct(near_source_correction(grid.mesh, distinct_scene_, gather, grid.usable,
                                                  grid.free_area_m2, share, rest)),
          quiet, more);
      derivative += more;
    }
    Eigen::VectorXd area = Eigen::VectorXd::Zero(surfaces);
    for (std::size_t i = 0; i < grid.mesh.size(); ++i) {
      if (!grid.usable[i]) continue;
      const auto s = static_cast<Index>(grid.mesh.surface_of(grid.mesh.patches[i]));
      mean.row(s) +=
          grid.free_area_m2[static_cast<Index>(i)] * derivative.row(static_cast<Index>(i));
      area[s] += grid.free_area_m2[static_cast<Index>(i)];
    }
    for (Index s = 0; s < surfaces; ++s)
      if (area[s] > 0.0) mean.row(s) /= area[s];
    grid.radiosity_by_reflectance.push_back(std::move(mean));
  }
}

std::vector<BandMatrix> Prediction::radiosity_by_reflectance() const {
  std::vector<BandMatrix> all;
  for (const BandMatrix& distinct : fine().radiosity_by_reflectance)
    all.push_back(expand_rows(distinct));
  return all;
}

// The error bound is that of the finest grid's value, |I_h - I_2h|: a third of it moves the value
// by no more than it allows.
Eigen::VectorXd Prediction::extrapolated(const Eigen::VectorXd& fine,
                                         const Eigen::VectorXd& coarse) const {
  if (!bound_is_reliable()) return fine;
  return (fine + (fine - coarse) / kRichardson).cwiseMax(0.0);
}

Eigen::VectorXd Prediction::expand(const Eigen::VectorXd& distinct) const {
  Eigen::VectorXd all(static_cast<Index>(needs_.band_source.size()));
  for (Index b = 0; b < all.size(); ++b)
    all[b] = needs_.band_scale[b] * distinct[static_cast<Index>(needs_.band_source[b])];
  return all;
}

BandMatrix Prediction::expand_rows(const BandMatrix& distinct) const {
  BandMatrix all(distinct.rows(), static_cast<Index>(scene_->bands.size()));
  for (Index r = 0; r < all.rows(); ++r)
    all.row(r) = expand(distinct.row(r).transpose()).transpose();
  return all;
}

bool Prediction::is_resolved(const PatchMesh& finest) {
  return static_cast<double>(finest.size()) >=
         kPatchesAPiece * static_cast<double>(finest.pieces.size());
}

bool Prediction::bound_is_reliable() const {
  if (fine().links) return false;  // what they leave out is an estimate
  return !needs_.interreflection || is_resolved(fine().mesh);
}

BandMatrix Prediction::indirect_from_surfaces(const Level& level, const Vec3& point,
                                              const Vec3& normal, bool is_secondary) const {
  Gather::Scratch scratch, source_scratch;
  // Parts are split by distance alone, so the same parts are one level deeper in the next grid. All
  // grids must gather again in the same places, or their difference would say nothing.
  const int gather_again_depth = kGatherAgainDepth + levels_[0]->split - level.split;
  // What a point reflects: its own direct light, exact, and indirect light from the smooth field;
  // very close to the receiver, where the field's edge singularities show, gathered once more.
  const auto source_at = [&](std::uint32_t patch, const Vec3& at, int depth,
                             Eigen::Ref<Eigen::VectorXd> value) {
    const PatchMesh& mesh = level.solution.mesh;
    const Piece& piece = mesh.pieces[mesh.patches[patch].piece];
    const auto& rho =
        distinct_scene_.material_of(distinct_scene_.surfaces[piece.surface]).reflectance.values;
    if (depth >= gather_again_depth && !is_secondary)
      value =
          indirect_from_surfaces(level, at, piece.plane.normal, true).colwise().sum().transpose();
    else
      level.evaluate(patch, at, value);
    level.gather->add_direct(at, piece.plane.normal, value, source_scratch);
    value = value.cwiseProduct(
        Eigen::Map<const Eigen::VectorXd>(rho.data(), static_cast<Index>(rho.size())));
  };
  return level.gather->from_surfaces(point, normal, level.solution.reflected, source_at, scratch);
}

BoundedIrradiance Prediction::irradiance_at(const Vec3& point, const Vec3& normal) const {
  Gather::Scratch scratch;
  const auto bands = static_cast<Index>(distinct_scene_.bands.size());
  Eigen::VectorXd value = Eigen::VectorXd::Zero(bands);
  levels_[0]->gather->add_direct(point, normal, value, scratch);
  Eigen::VectorXd bound = Eigen::VectorXd::Zero(bands);
  if (needs_.interreflection) {
    std::array<BandMatrix, 3> gathered;
    for (std::size_t k = 0; k < 3; ++k)
      gathered[k] = indirect_from_surfaces(*levels_[k], point, normal, false);
    const Eigen::VectorXd finest = gathered[0].colwise().sum().transpose();
    value += extrapolated(finest, gathered[1].colwise().sum().transpose());
    bound = guarded_difference(gathered[0], gathered[1], gathered[2], kGatheredOrder)
                .colwise()
                .sum()
                .transpose() +
            solver_bounds();
  }
  bound += kRounding * value;
  return {expand(value), expand(bound)};
}

BoundedIrradiance Prediction::irradiance_on(std::uint32_t piece, const Vec3& point,
                                            Gather::Scratch& scratch) const {
  const auto bands = static_cast<Index>(distinct_scene_.bands.size());
  Eigen::VectorXd value = Eigen::VectorXd::Zero(bands), bound = Eigen::VectorXd::Zero(bands);
  if (needs_.interreflection) {
    const std::uint32_t patch = levels_[0]->smooth().find_patch(piece, point);
    if (gathers_field_) {
      const RefinedField& field = gathered_field();
      const std::uint32_t cell = field.find_cell(patch, point);
      field.evaluate(cell, point, value);
      bound = gathered_bound_.row(cell).transpose();
    } else {
      levels_[0]->evaluate(patch, point, value);
      bound = indirect_bound().row(patch).transpose();
    }
  }
  levels_[0]->gather->add_direct(point, fine().mesh.pieces[piece].plane.normal, value, scratch);
  bound += kRounding * value;
  return {expand(value), expand(bound)};
}

BandMatrix Prediction::radiosity() const {
  const BandMatrix& reflected = fine().reflected;
  BandMatrix all(reflected.rows(), static_cast<Index>(scene_->bands.size()));
  for (Index i = 0; i < all.rows(); ++i) {
    const auto& exitance =
        scene_->material_of(scene_->surfaces[fine().mesh.surface_of(fine().mesh.patches[i])])
            .exitance.values;
    all.row(i) = expand(reflected.row(i).transpose()).transpose() +
                 Eigen::Map<const Eigen::RowVectorXd>(exitance.data(), all.cols());
  }
  return all;
}

BandMatrix Prediction::irradiance() const {
  BandMatrix all(fine().direct.rows(), static_cast<Index>(scene_->bands.size()));
  for (Index i = 0; i < all.rows(); ++i)
    all.row(i) = expand((fine().direct.row(i) + fine().indirect.row(i)).transpose()).transpose();
  return all;
}

BandMatrix Prediction::radiosity_bound() const {
  const BandMatrix rho = reflectance_of(fine().mesh, *scene_);
  BandMatrix all(rho.rows(), rho.cols());
  for (Index i = 0; i < all.rows(); ++i) {
    const Eigen::VectorXd bound =
        indirect_bound().row(i).transpose() + kRounding * fine().direct.row(i).transpose();
    all.row(i) = rho.row(i).cwiseProduct(expand(bound).transpose());
  }
  return all;
}

}  // namespace truebox
