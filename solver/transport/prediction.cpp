// SPDX-License-Identifier: BSD-3-Clause
#include "transport/prediction.h"

#include <algorithm>

#include "transport/direct_light.h"
#include "transport/grid_difference.h"
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
  distinct_scene_ = in_bands(scene, needs_.distinct_bands);
  const double edge_m = edge_for_count(scene, std::max<std::size_t>(1, options.elements / 16));
  // The finest grid decides; better told before the others are solved.
  if (needs_.interreflection && !options.find_exchange && !options.solve_grid)
    require_memory(mesh_of(edge_m, kFinestSplit, options).size(), options.form_factors);
  for (int k = 2; k >= 0; --k) levels_[k] = solve_level(edge_m, kFinestSplit - k, options);
  if (options.error_shares && needs_.interreflection &&
      options.form_factors.method == FormFactorMethod::exact_visibility) {
    error_shares_ = find_error_shares(*levels_[1]);  // nothing to sample again
  } else if (options.error_shares && needs_.interreflection) {
    PredictOptions again = options;
    again.form_factors.seed += 1000;
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
  GridSolution& grid = level->solution;
  grid.mesh = mesh_of(edge_m, split, options);
  const auto bands = static_cast<Index>(distinct_scene_.bands.size());
  level->gather = std::make_unique<Gather>(grid.mesh, distinct_scene_, needs_.occlusion);
  const ElementTree tree = element_tree(grid.mesh);
  const ShaftCulling culling(grid.mesh, distinct_scene_, needs_.occlusion);
  grid.direct =
      mean_direct(grid.mesh, distinct_scene_, *level->gather, tree, culling, options.progress);
  const BandMatrix rho = reflectance_of(grid.mesh, distinct_scene_);
  const BandMatrix source = rho.cwiseProduct(grid.direct);
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
  if (options.solve_grid) {
    options.solve_grid({distinct_scene_, rho, source, factor_options, options.solve}, grid);
    return level;
  }
  SolveOptions solve_options = options.solve;
  if (options.watch_finest && split == kFinestSplit)
    solve_options.on_progress = options.watch_finest(grid.mesh, source);
  const Visibility visibility(grid.mesh, distinct_scene_);
  const FindExchange find = options.find_exchange ? options.find_exchange : full_matrix;
  FoundExchange found =
      find({grid.mesh, distinct_scene_, visibility, culling, rho, source, factor_options});
  grid.usable = std::move(found.usable);
  grid.form_factors = found.summary;
  grid.links = found.links;
  grid.solve = solve_radiosity(*found.exchange, rho, source, solve_options, grid.reflected,
                               options.progress, &grid.indirect);
  if (options.sensitivities && split == kFinestSplit)
    differentiate(*found.exchange, rho, options.solve, grid);
  return level;
}

const SmoothField& Prediction::Level::smooth() const {
  std::call_once(smooth_once, [this] {
    smooth_field = std::make_unique<SmoothField>(solution.mesh, solution.usable, solution.indirect);
  });
  return *smooth_field;
}

const GatheredField& Prediction::Level::gathered(const Scene& scene, bool occlusion) const {
  std::call_once(gathered_once, [&] {
    gathered_field = std::make_unique<GatheredField>(FieldSources{
        solution.mesh, scene, solution.usable, solution.reflected, smooth(), *gather, occlusion});
  });
  return *gathered_field;
}

const GatheredField& Prediction::gathered(std::size_t level) const {
  return levels_[level]->gathered(distinct_scene_, needs_.occlusion);
}

SolveOutcome Prediction::outcome() const {
  for (const auto& level : levels_)
    if (level->solution.solve.outcome != SolveOutcome::converged)
      return level->solution.solve.outcome;
  return SolveOutcome::converged;
}

void Prediction::differentiate(const ExchangeOperator& exchange, const BandMatrix& rho,
                               const SolveOptions& options, GridSolution& grid) const {
  const SolvedSystem system{exchange, rho, grid.direct, grid.indirect};
  const auto surfaces = static_cast<Index>(distinct_scene_.surfaces.size());
  for (std::size_t m = 0; m < distinct_scene_.materials.size(); ++m) {
    std::vector<char> is_in_material(grid.mesh.size());
    for (std::size_t i = 0; i < grid.mesh.size(); ++i)
      is_in_material[i] =
          distinct_scene_.surfaces[grid.mesh.surface_of(grid.mesh.patches[i])].material == m;
    BandMatrix derivative, mean = BandMatrix::Zero(surfaces, rho.cols());
    SolveOptions quiet = options;
    quiet.on_progress = {};
    reflectance_sensitivity(system, is_in_material, quiet, derivative);
    Eigen::VectorXd area = Eigen::VectorXd::Zero(surfaces);
    for (std::size_t i = 0; i < grid.mesh.size(); ++i) {
      if (!grid.usable[i]) continue;
      const auto s = static_cast<Index>(grid.mesh.surface_of(grid.mesh.patches[i]));
      mean.row(s) += grid.mesh.patches[i].area_m2 * derivative.row(static_cast<Index>(i));
      area[s] += grid.mesh.patches[i].area_m2;
    }
    for (Index s = 0; s < surfaces; ++s)
      if (area[s] > 0.0) mean.row(s) /= area[s];
    grid.radiosity_by_reflectance.push_back(std::move(mean));
  }
}

std::vector<BandMatrix> Prediction::radiosity_by_reflectance() const {
  std::vector<BandMatrix> all;
  for (const BandMatrix& distinct : fine().radiosity_by_reflectance) {
    BandMatrix expanded(distinct.rows(), static_cast<Index>(scene_->bands.size()));
    for (Index s = 0; s < distinct.rows(); ++s)
      expanded.row(s) = expand(distinct.row(s).transpose()).transpose();
    all.push_back(std::move(expanded));
  }
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

bool Prediction::bound_is_reliable() const {
  if (fine().links) return false;  // what they leave out is an estimate
  return !needs_.interreflection ||
         static_cast<double>(fine().mesh.size()) >=
             kPatchesAPiece * static_cast<double>(fine().mesh.pieces.size());
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
      level.smooth().evaluate(patch, at, value);
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
      const std::uint32_t cell = gathered(0).find_cell(patch, point);
      bound = gathered_bound().row(cell).transpose();
      best_field_->evaluate(cell, point, value);
    } else {
      levels_[0]->smooth().evaluate(patch, point, value);
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
