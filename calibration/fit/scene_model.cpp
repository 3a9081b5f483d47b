// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_model.h"

#include <algorithm>

#include "fit/view_blocks.h"
#include "mesh/patch_topology.h"
#include "scene/requirements.h"
#include "transport/direct_light.h"
#include "transport/gather.h"
#include "transport/sensitivity.h"

namespace truebox {
namespace {

using Eigen::Index;

/// One band a luminous material, in which that material alone emits, and emits 1.
Scene unit_lamps(const Scene& scene, const std::vector<std::size_t>& lamps) {
  Scene unit = scene;
  std::vector<double> centres;
  for (std::size_t k = 0; k < std::max<std::size_t>(1, lamps.size()); ++k)
    centres.push_back(static_cast<double>(k + 1));
  unit.bands = WavelengthGrid::from_centres(centres);
  for (std::size_t m = 0; m < unit.materials.size(); ++m) {
    unit.materials[m].exitance = RadiantExitance(centres.size(), 0.0);
    unit.materials[m].reflectance = Reflectance(centres.size(), 0.5);
    for (std::size_t k = 0; k < lamps.size(); ++k)
      if (lamps[k] == m) unit.materials[m].exitance[k] = 1.0;
  }
  return unit;
}

std::vector<std::vector<std::uint32_t>> edge_neighbours(const PatchMesh& mesh,
                                                        const std::vector<char>& usable) {
  const PatchTopology topology(mesh);
  std::vector<std::vector<std::uint32_t>> all(mesh.size());
  for (std::uint32_t i = 0; i < mesh.size(); ++i)
    for (std::size_t k = 0; k < mesh.patches[i].corner_count; ++k)
      for (const std::uint32_t j : topology.across(i, k))
        if (usable[j]) all[i].push_back(j);
  return all;
}

}  // namespace

SceneModel::SceneModel(const Scene& scene, const SceneModelOptions& options)
    : scene_(&scene), options_(options) {
  require_lambertian(scene);
  for (std::size_t m = 0; m < scene.materials.size(); ++m)
    if (scene.materials[m].emits()) lamps_.push_back(m);
  lamp_scene_ = unit_lamps(scene, lamps_);
  const double edge =
      options.edge_m > 0.0 ? options.edge_m : edge_for_count(scene, options.elements);
  mesh_ = uniform_mesh(lamp_scene_, edge);
  FormFactorOptions factor_options = options.form_factors;
  factor_options.occlusion = requirements(scene).occlusion;
  factor_options.progress = options.progress;
  factors_ = form_factors(mesh_, lamp_scene_, Visibility(mesh_, lamp_scene_), factor_options);
  neighbours_ = edge_neighbours(mesh_, factors_.usable);
  const Gather gather(mesh_, lamp_scene_, factor_options.occlusion);
  direct_ = mean_direct(mesh_, lamp_scene_, gather, element_tree(mesh_),
                        ShaftCulling(mesh_, lamp_scene_, factor_options.occlusion));
}

std::size_t SceneModel::add_view(const CameraDescription& camera) {
  PixelBlockOptions how;
  how.margin_px = options_.margin_px;
  how.samples = options_.samples;
  const PixelBlocks found = pixel_blocks(lamp_scene_, mesh_, factors_.usable, Camera(camera), how);
  pixels_of_surface_.push_back(found.pixels_of_surface);
  const Gather gather(mesh_, lamp_scene_, requirements(lamp_scene_).occlusion);
  Gather::Scratch scratch;
  Eigen::VectorXd at_point(direct_.cols());
  for (const PixelBlock& pixels : found.blocks) {
    ViewBlock block;
    block.view = views() - 1;
    block.element = pixels.element;
    block.surface = mesh_.surface_of(mesh_.patches[pixels.element]);
    block.pixels = pixels.pixels;
    const Vec3& normal = mesh_.plane_of(mesh_.patches[pixels.element]).normal;
    const auto n = static_cast<Index>(pixels.points.size());
    BandMatrix light = BandMatrix::Zero(n, direct_.cols());
    for (Index k = 0; k < n; ++k) {
      at_point.setZero();
      gather.add_direct(pixels.points[static_cast<std::size_t>(k)], normal, at_point, scratch);
      light.row(k) = at_point.transpose();
    }
    block.direct = Eigen::VectorXd::Zero(direct_.cols());
    for (Index l = 0; l < direct_.cols(); ++l)
      block.direct[l] = mean_over_block(pixels, light.col(l)).value;
    const SampledMean all = mean_over_block(pixels, light.rowwise().sum());
    block.sampling_u = all.value > 0.0 ? all.standard_uncertainty / all.value : 0.0;
    block.weights = plane_weights(block.element, pixels.centre);
    blocks_.push_back(std::move(block));
  }
  return views() - 1;
}

std::size_t SceneModel::add_elements() {
  pixels_of_surface_.emplace_back(scene_->surfaces.size(), 0);
  for (std::uint32_t i = 0; i < mesh_.size(); ++i) {
    const std::size_t s = mesh_.surface_of(mesh_.patches[i]);
    if (!factors_.usable[i] || scene_->surfaces[s].is_opening ||
        scene_->material_of(scene_->surfaces[s]).emits())
      continue;
    ++pixels_of_surface_.back()[s];
    blocks_.push_back({.view = views() - 1,
                       .element = i,
                       .surface = s,
                       .pixels = {},
                       .direct = direct_.row(static_cast<Index>(i)).transpose(),
                       .weights = {{i, 1.0}}});
  }
  return views() - 1;
}

std::size_t SceneModel::add_surface_means() {
  pixels_of_surface_.emplace_back(scene_->surfaces.size(), 0);
  for (std::size_t s = 0; s < scene_->surfaces.size(); ++s) {
    ViewBlock block{.view = views() - 1,
                    .element = 0,
                    .surface = s,
                    .pixels = {},
                    .direct = Eigen::VectorXd::Zero(direct_.cols()),
                    .weights = {}};
    double area = 0.0;
    for (std::uint32_t i = 0; i < mesh_.size(); ++i) {
      if (!factors_.usable[i] || mesh_.surface_of(mesh_.patches[i]) != s) continue;
      if (block.weights.empty()) block.element = i;
      block.weights.emplace_back(i, mesh_.patches[i].area_m2);
      block.direct += mesh_.patches[i].area_m2 * direct_.row(static_cast<Index>(i)).transpose();
      area += mesh_.patches[i].area_m2;
    }
    if (scene_->surfaces[s].is_opening || area <= 0.0) continue;
    for (auto& [element, weight] : block.weights) weight /= area;
    block.direct /= area;
    ++pixels_of_surface_.back()[s];
    blocks_.push_back(std::move(block));
  }
  return views() - 1;
}

// I(x) = I_i + grad . (x - c_i), the gradient by least squares over the neighbours across an edge,
// as in finite volumes: second order in the element size. Source: Barth (1991), AIAA 91-0278.
std::vector<std::pair<std::uint32_t, double>> SceneModel::plane_weights(std::uint32_t element,
                                                                        const Vec3& at) const {
  const auto& around = neighbours_[element];
  const Patch& patch = mesh_.patches[element];
  const Vec3& normal = mesh_.plane_of(patch).normal;
  const Vec3 axis_u = normal.unitOrthogonal(), axis_v = normal.cross(axis_u);
  Eigen::MatrixX2d offsets(static_cast<Index>(around.size()), 2);
  for (Index k = 0; k < offsets.rows(); ++k) {
    const Vec3 d = mesh_.patches[around[static_cast<std::size_t>(k)]].centroid - patch.centroid;
    offsets.row(k) << d.dot(axis_u), d.dot(axis_v);
  }
  std::vector<std::pair<std::uint32_t, double>> weights{{element, 1.0}};
  const Eigen::Matrix2d normal_matrix = offsets.transpose() * offsets;
  const double trace = normal_matrix.trace();
  // Neighbours on one line give no gradient across it.
  if (around.size() < 2 || normal_matrix.determinant() < 1e-3 * trace * trace) return weights;
  const Eigen::Vector2d step((at - patch.centroid).dot(axis_u), (at - patch.centroid).dot(axis_v));
  const Eigen::VectorXd share = offsets * normal_matrix.inverse() * step;
  for (Index k = 0; k < share.size(); ++k) {
    weights.emplace_back(around[static_cast<std::size_t>(k)], share[k]);
    weights[0].second -= share[k];
  }
  return weights;
}

SceneState SceneModel::state() const {
  const auto bands = static_cast<Index>(scene_->bands.size());
  SceneState state{BandMatrix(static_cast<Index>(scene_->materials.size()), bands),
                   BandMatrix(static_cast<Index>(lamps_.size()), bands), true};
  for (Index m = 0; m < state.reflectance.rows(); ++m)
    for (Index b = 0; b < bands; ++b)
      state.reflectance(m, b) =
          scene_->materials[static_cast<std::size_t>(m)].reflectance[static_cast<std::size_t>(b)];
  for (Index l = 0; l < state.exitance.rows(); ++l)
    for (Index b = 0; b < bands; ++b)
      state.exitance(l, b) = scene_->materials[lamps_[static_cast<std::size_t>(l)]]
                                 .exitance[static_cast<std::size_t>(b)];
  return state;
}

BandMatrix SceneModel::element_reflectance(const SceneState& state) const {
  BandMatrix rho(static_cast<Index>(mesh_.size()), state.reflectance.cols());
  for (Index i = 0; i < rho.rows(); ++i) {
    const std::size_t s = mesh_.surface_of(mesh_.patches[static_cast<std::size_t>(i)]);
    rho.row(i) = state.reflectance.row(static_cast<Index>(scene_->surfaces[s].material));
  }
  return rho;
}

BandMatrix SceneModel::at_blocks(const BandMatrix& elements) const {
  BandMatrix all = BandMatrix::Zero(static_cast<Index>(blocks_.size()), elements.cols());
  for (std::size_t i = 0; i < blocks_.size(); ++i)
    for (const auto& [element, weight] : blocks_[i].weights)
      all.row(static_cast<Index>(i)) += weight * elements.row(static_cast<Index>(element));
  return all;
}

BlockRadiosity SceneModel::radiosity(const SceneState& state,
                                     const WantedDerivatives* wanted) const {
  const auto n = static_cast<Index>(blocks_.size()), bands = state.reflectance.cols();
  const auto lamps = static_cast<Index>(lamps_.size());
  const DenseExchange exchange(factors_);
  const BandMatrix rho = element_reflectance(state);
  SolveOptions options;
  options.relative_bound = options_.solver_bound;

  BlockRadiosity answer;
  answer.outcome = SolveOutcome::converged;
  const auto keep_worst = [&](const SolveSummary& summary) {
    if (summary.outcome != SolveOutcome::converged) answer.outcome = summary.outcome;
  };
  const auto material_of = [&](std::size_t block) {
    return static_cast<Index>(scene_->surfaces[blocks_[block].surface].material);
  };
  BandMatrix block_rho(n, bands);
  for (Index i = 0; i < n; ++i)
    block_rho.row(i) = state.reflectance.row(material_of(static_cast<std::size_t>(i)));

  answer.value = BandMatrix::Zero(n, bands);
  BandMatrix arriving = BandMatrix::Zero(n, bands);  // D + I of the blocks
  BandMatrix direct = BandMatrix::Zero(rho.rows(), bands), indirect = direct;  // of the elements
  for (Index l = 0; l < lamps; ++l) {
    const BandMatrix unit_direct = direct_.col(l).replicate(1, bands);
    BandMatrix reflected, unit_indirect = BandMatrix::Zero(rho.rows(), bands);
    if (state.interreflection)
      keep_worst(solve_radiosity(exchange, rho, rho.cwiseProduct(unit_direct), options, reflected,
                                 {}, &unit_indirect));
    BandMatrix received = at_blocks(unit_indirect);
    BandMatrix by_exitance(n, bands);
    for (Index i = 0; i < n; ++i) {
      const ViewBlock& block = blocks_[static_cast<std::size_t>(i)];
      received.row(i).array() += block.direct[l];
      by_exitance.row(i) = block_rho.row(i).cwiseProduct(received.row(i));
      if (static_cast<std::size_t>(material_of(static_cast<std::size_t>(i))) ==
          lamps_[static_cast<std::size_t>(l)])
        by_exitance.row(i).array() += 1.0;
    }
    const auto spectrum = state.exitance.row(l).asDiagonal();
    answer.value += by_exitance * spectrum;
    arriving += received * spectrum;
    direct += unit_direct * spectrum;
    indirect += unit_indirect * spectrum;
    if (wanted && wanted->exitance) answer.by_exitance.push_back(std::move(by_exitance));
  }
  if (!wanted) return answer;

  const SolvedSystem system{exchange, rho, direct, indirect};
  for (Index m = 0; m < state.reflectance.rows(); ++m) {
    if (!wanted->reflectance[static_cast<std::size_t>(m)]) {
      answer.by_reflectance.emplace_back();
      continue;
    }
    BandMatrix by_rho = BandMatrix::Zero(n, bands);
    if (state.interreflection && lamps > 0) {
      std::vector<char> is_in_material(mesh_.size());
      for (std::size_t i = 0; i < mesh_.size(); ++i)
        is_in_material[i] =
            static_cast<Index>(scene_->surfaces[mesh_.surface_of(mesh_.patches[i])].material) == m;
      BandMatrix derivative;
      keep_worst(reflectance_sensitivity(system, is_in_material, options, derivative));
      const BandMatrix irradiance =
          factors_.area_m2.cwiseInverse().asDiagonal() * exchange.product(derivative);
      by_rho = block_rho.cwiseProduct(at_blocks(irradiance));
    }
    for (Index i = 0; i < n; ++i)
      if (material_of(static_cast<std::size_t>(i)) == m) by_rho.row(i) += arriving.row(i);
    answer.by_reflectance.push_back(std::move(by_rho));
  }
  return answer;
}

}  // namespace truebox
