// SPDX-License-Identifier: BSD-3-Clause
#include "transport/prediction.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "transport/band_product.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kRounding = 1e-12;  // of a clipped Lambert sum, relative; measured below 1e-13

constexpr int kGatherAgainDepth = 3;  // receivers within about half an element of the fine grid

// Exponent of B = B0 + c x^lambda at a right-angled edge of reflectance rho: the Mellin transform
// of the edge's kernel, 1 = (rho / 4) G(1 + l/2) G((1 - l)/2) / G(3/2); 0.763 at rho = 0.5.
double edge_exponent(double rho) {
  const auto excess = [rho](double l) {
    return 0.25 * rho * std::tgamma(1.0 + 0.5 * l) * std::tgamma(0.5 * (1.0 - l)) /
               std::tgamma(1.5) -
           1.0;
  };
  double low = 0.0, high = 1.0 - 1e-9;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0.0 ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

Scene only_bands(const Scene& scene, const std::vector<std::size_t>& bands) {
  Scene part = scene;
  std::vector<double> centres;
  for (std::size_t b : bands) centres.push_back(scene.bands.centre_nm(b));
  part.bands = WavelengthGrid::from_centres(std::move(centres));
  for (std::size_t m = 0; m < scene.materials.size(); ++m)
    for (auto [from, to] : {std::pair{&scene.materials[m].reflectance.values,
                                      &part.materials[m].reflectance.values},
                            std::pair{&scene.materials[m].exitance.values,
                                      &part.materials[m].exitance.values}}) {
      to->clear();
      for (std::size_t b : bands) to->push_back((*from)[b]);
    }
  return part;
}

BandMatrix reflectance_of(const PatchMesh& mesh, const Scene& scene) {
  BandMatrix rho(static_cast<Index>(mesh.size()), static_cast<Index>(scene.bands.size()));
  for (Index i = 0; i < rho.rows(); ++i) {
    const auto& values =
        scene.material_of(scene.surfaces[mesh.surface_of(mesh.patches[i])]).reflectance.values;
    rho.row(i) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), rho.cols());
  }
  return rho;
}

BandMatrix mean_direct(const PatchMesh& mesh, const Gather& gather, Index bands) {
  BandMatrix direct = BandMatrix::Zero(static_cast<Index>(mesh.size()), bands);
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(mesh.size())),
                    [&](const auto& range) {
                      Gather::Scratch scratch;
                      Eigen::VectorXd sum(bands);
                      for (std::uint32_t i = range.begin(); i < range.end(); ++i) {
                        sum.setZero();
                        gather.add_mean_direct(i, sum, scratch);
                        direct.row(i) = sum.transpose();
                      }
                    });
  return direct;
}

}  // namespace

Prediction::Prediction(const Scene& scene, const PredictOptions& options)
    : scene_(&scene), needs_(requirements(scene)) {
  distinct_scene_ = only_bands(scene, needs_.distinct_bands);
  fine_ = std::make_unique<GridSolution>();
  coarse_ = std::make_unique<GridSolution>();
  const double edge_m = edge_for_count(scene, std::max<std::size_t>(1, options.elements / 4));
  solve_grid(*coarse_, edge_m, 0, options);
  solve_grid(*fine_, edge_m, 1, options);
  visibility_ = std::make_unique<Visibility>(fine_->mesh, scene);
  gather_fine_ = std::make_unique<Gather>(fine_->mesh, distinct_scene_, needs_.occlusion);
  gather_coarse_ = std::make_unique<Gather>(coarse_->mesh, distinct_scene_, needs_.occlusion);
  smooth_fine_ = std::make_unique<SmoothField>(fine_->mesh, fine_->usable, fine_->indirect);
  smooth_coarse_ = std::make_unique<SmoothField>(coarse_->mesh, coarse_->usable, coarse_->indirect);
  compare_grids();
}

void Prediction::solve_grid(GridSolution& grid, double edge_m, int level,
                            const PredictOptions& options) {
  grid.mesh = uniform_mesh(distinct_scene_, edge_m, level);
  const auto bands = static_cast<Index>(distinct_scene_.bands.size());
  const Gather gather(grid.mesh, distinct_scene_, needs_.occlusion);
  grid.direct = mean_direct(grid.mesh, gather, bands);
  const BandMatrix rho = reflectance_of(grid.mesh, distinct_scene_);
  const BandMatrix source = rho.cwiseProduct(grid.direct);
  if (!needs_.interreflection) {
    grid.usable.assign(grid.mesh.size(), 1);
    grid.indirect = BandMatrix::Zero(rho.rows(), bands);
    grid.reflected = source;
    grid.solve.outcome = SolveOutcome::converged;
    grid.solve.error_bound = Eigen::VectorXd::Zero(bands);
    return;
  }
  FormFactorOptions factor_options = options.form_factors;
  factor_options.occlusion = needs_.occlusion;
  factor_options.seed = options.form_factors.seed + static_cast<std::uint64_t>(level);
  factor_options.progress = options.progress;
  const Visibility visibility(grid.mesh, distinct_scene_);
  const FormFactors factors =
      form_factors(grid.mesh, distinct_scene_, visibility, factor_options);
  grid.usable = factors.usable;
  grid.form_factors = factors.summary;
  grid.solve = solve_radiosity(factors, rho, source, options.solve, grid.reflected, options.progress);
  grid.indirect = band_product(factors.exchange_area_m2, grid.reflected);
  for (Index i = 0; i < grid.indirect.rows(); ++i) grid.indirect.row(i) /= factors.area_m2[i];
}

SolveOutcome Prediction::outcome() const {
  return coarse_->solve.outcome == SolveOutcome::converged ? fine_->solve.outcome
                                                           : coarse_->solve.outcome;
}

// The solver's bound holds for every element, so for any gathered mean of them.
double Prediction::solver_bound(const GridSolution& grid, Index band) const {
  return grid.solve.error_bound[band];
}

void Prediction::compare_grids() {
  const PatchMesh& mesh = fine_->mesh;
  const auto bands = fine_->indirect.cols();
  // At a point the grids may converge as slowly as the edge singularity: e_h = |I_h - I_2h| / (2^l - 1).
  Eigen::RowVectorXd factor(bands);
  for (Index k = 0; k < bands; ++k) {
    double rho = 0.0;
    for (const Material& m : distinct_scene_.materials)
      rho = std::max(rho, m.reflectance[static_cast<std::size_t>(k)]);
    factor[k] = 1.0 / (std::exp2(edge_exponent(rho)) - 1.0);
  }
  indirect_bound_ = BandMatrix::Zero(fine_->indirect.rows(), bands);
  parent_.resize(mesh.size());
  tbb::parallel_for(
      tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(mesh.size())),
      [&](const auto& range) {
        Eigen::VectorXd a(bands), b(bands);
        for (std::uint32_t i = range.begin(); i < range.end(); ++i) {
          const Patch& patch = mesh.patches[i];
          const std::uint32_t parent = smooth_coarse_->find_patch(patch.piece, patch.centroid);
          parent_[i] = parent;
          if (!fine_->usable[i]) continue;
          const auto compare = [&](const Vec3& point) {
            smooth_fine_->evaluate(i, point, a);
            smooth_coarse_->evaluate(parent, point, b);
            indirect_bound_.row(i) =
                indirect_bound_.row(i).cwiseMax(factor.cwiseProduct((a - b).cwiseAbs().transpose()));
          };
          compare(patch.centroid);
          for (std::uint32_t v : mesh.corners_of(patch))
            compare(patch.centroid + 0.95 * (mesh.vertices[v] - patch.centroid));
        }
      });
  share_bounds_at_contacts();
  for (Index k = 0; k < bands; ++k)
    indirect_bound_.col(k).array() += solver_bound(*fine_, k) + solver_bound(*coarse_, k);
}

// Where another surface stands on this one the light turns around its corners within an element:
// by chance one of them may agree on both grids, so those that meet there share the largest.
void Prediction::share_bounds_at_contacts() {
  const PatchMesh& mesh = fine_->mesh;
  std::vector<std::vector<std::uint32_t>> patches_at(mesh.vertices.size());
  std::vector<char> is_contact(mesh.vertices.size(), 0);
  for (std::uint32_t i = 0; i < mesh.size(); ++i)
    for (std::uint32_t v : mesh.corners_of(mesh.patches[i])) {
      if (fine_->usable[i]) patches_at[v].push_back(i);
      else is_contact[v] = 1;
    }
  const BandMatrix own = indirect_bound_;
  for (std::size_t v = 0; v < patches_at.size(); ++v) {
    if (!is_contact[v]) continue;
    for (std::uint32_t i : patches_at[v])
      for (std::uint32_t j : patches_at[v])
        indirect_bound_.row(i) = indirect_bound_.row(i).cwiseMax(own.row(j));
  }
}

Eigen::VectorXd Prediction::expand(const Eigen::VectorXd& distinct) const {
  Eigen::VectorXd all(static_cast<Index>(needs_.band_source.size()));
  for (Index b = 0; b < all.size(); ++b)
    all[b] = needs_.band_scale[b] * distinct[static_cast<Index>(needs_.band_source[b])];
  return all;
}

BandMatrix Prediction::indirect_from_surfaces(const GridSolution& grid, const Gather& gather,
                                              const SmoothField& smooth, const Vec3& point,
                                              const Vec3& normal, bool is_secondary) const {
  Gather::Scratch scratch, source_scratch;
  // Parts are split by distance alone: the same parts are one level deeper in the coarse grid. Both
  // grids must gather again in the same places, or their difference would say nothing.
  const int gather_again_depth = kGatherAgainDepth + (&grid == coarse_.get() ? 1 : 0);
  // What a point reflects: its own direct light, exact, and indirect light from the smooth field;
  // very close to the receiver, where the field's edge singularities show, gathered once more.
  const auto source_at = [&](std::uint32_t patch, const Vec3& at, int depth,
                             Eigen::Ref<Eigen::VectorXd> value) {
    const Piece& piece = grid.mesh.pieces[grid.mesh.patches[patch].piece];
    const auto& rho =
        distinct_scene_.material_of(distinct_scene_.surfaces[piece.surface]).reflectance.values;
    if (depth >= gather_again_depth && !is_secondary)
      value = indirect_from_surfaces(grid, gather, smooth, at, piece.plane.normal, true)
                  .colwise()
                  .sum()
                  .transpose();
    else
      smooth.evaluate(patch, at, value);
    gather.add_direct(at, piece.plane.normal, value, source_scratch);
    value = value.cwiseProduct(
        Eigen::Map<const Eigen::VectorXd>(rho.data(), static_cast<Index>(rho.size())));
  };
  return gather.from_surfaces(point, normal, grid.reflected, source_at, scratch);
}

BoundedIrradiance Prediction::irradiance_at(const Vec3& point, const Vec3& normal) const {
  Gather::Scratch scratch;
  const auto bands = static_cast<Index>(distinct_scene_.bands.size());
  Eigen::VectorXd value = Eigen::VectorXd::Zero(bands);
  gather_fine_->add_direct(point, normal, value, scratch);
  Eigen::VectorXd bound = Eigen::VectorXd::Zero(bands);
  if (needs_.interreflection) {
    const BandMatrix fine =
        indirect_from_surfaces(*fine_, *gather_fine_, *smooth_fine_, point, normal, false);
    const BandMatrix coarse =
        indirect_from_surfaces(*coarse_, *gather_coarse_, *smooth_coarse_, point, normal, false);
    value += fine.colwise().sum().transpose();
    bound = (fine - coarse).cwiseAbs().colwise().sum().transpose();
    for (Index k = 0; k < bands; ++k) bound[k] += solver_bound(*fine_, k) + solver_bound(*coarse_, k);
  }
  bound += kRounding * value;
  return {expand(value), expand(bound)};
}

BoundedIrradiance Prediction::irradiance_on(std::uint32_t piece, const Vec3& point,
                                            Gather::Scratch& scratch) const {
  const auto bands = static_cast<Index>(distinct_scene_.bands.size());
  Eigen::VectorXd value = Eigen::VectorXd::Zero(bands), bound = Eigen::VectorXd::Zero(bands);
  if (needs_.interreflection) {
    const std::uint32_t patch = smooth_fine_->find_patch(piece, point);
    smooth_fine_->evaluate(patch, point, value);
    bound = indirect_bound_.row(patch).transpose();
  }
  gather_fine_->add_direct(point, fine_->mesh.pieces[piece].plane.normal, value, scratch);
  bound += kRounding * value;
  return {expand(value), expand(bound)};
}

BandMatrix Prediction::radiosity() const {
  const BandMatrix& reflected = fine_->reflected;
  BandMatrix all(reflected.rows(), static_cast<Index>(scene_->bands.size()));
  for (Index i = 0; i < all.rows(); ++i) {
    const auto& exitance =
        scene_->material_of(scene_->surfaces[fine_->mesh.surface_of(fine_->mesh.patches[i])])
            .exitance.values;
    all.row(i) = expand(reflected.row(i).transpose()).transpose() +
                 Eigen::Map<const Eigen::RowVectorXd>(exitance.data(), all.cols());
  }
  return all;
}

BandMatrix Prediction::irradiance() const {
  BandMatrix all(fine_->direct.rows(), static_cast<Index>(scene_->bands.size()));
  for (Index i = 0; i < all.rows(); ++i)
    all.row(i) = expand((fine_->direct.row(i) + fine_->indirect.row(i)).transpose()).transpose();
  return all;
}

BandMatrix Prediction::surface_irradiance_bound() const {
  const PatchMesh& mesh = fine_->mesh;
  const Index bands = fine_->indirect.cols();
  const auto surfaces = static_cast<Index>(scene_->surfaces.size());
  BandMatrix children = BandMatrix::Zero(coarse_->indirect.rows(), bands);
  Eigen::VectorXd children_area = Eigen::VectorXd::Zero(coarse_->indirect.rows());
  Eigen::VectorXd area = Eigen::VectorXd::Zero(surfaces);
  BandMatrix sum = BandMatrix::Zero(surfaces, bands);
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (!fine_->usable[i]) continue;
    const Patch& patch = mesh.patches[i];
    children.row(parent_[i]) += patch.area_m2 * fine_->indirect.row(static_cast<Index>(i));
    children_area[parent_[i]] += patch.area_m2;
  }
  for (std::size_t p = 0; p < coarse_->mesh.size(); ++p) {
    const auto row = static_cast<Index>(p);
    const auto surface = static_cast<Index>(coarse_->mesh.surface_of(coarse_->mesh.patches[p]));
    sum.row(surface) += (children.row(row) - children_area[row] * coarse_->indirect.row(row)).cwiseAbs();
    area[surface] += children_area[row];
  }
  BandMatrix all = BandMatrix::Zero(surfaces, static_cast<Index>(scene_->bands.size()));
  for (Index s = 0; s < surfaces; ++s) {
    if (area[s] == 0.0) continue;
    Eigen::VectorXd bound = sum.row(s).transpose() / area[s];
    for (Index k = 0; k < bands; ++k) bound[k] += solver_bound(*fine_, k) + solver_bound(*coarse_, k);
    all.row(s) = expand(bound).transpose();
  }
  return all;
}

BandMatrix Prediction::radiosity_bound() const {
  const BandMatrix rho = reflectance_of(fine_->mesh, *scene_);
  BandMatrix all(rho.rows(), rho.cols());
  for (Index i = 0; i < all.rows(); ++i) {
    const Eigen::VectorXd bound =
        indirect_bound_.row(i).transpose() + kRounding * fine_->direct.row(i).transpose();
    all.row(i) = rho.row(i).cwiseProduct(expand(bound).transpose());
  }
  return all;
}

}  // namespace truebox
