// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_model.h"

#include <algorithm>

#include "mesh/patch_topology.h"
#include "scene/requirements.h"
#include "transport/direct_light.h"
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
  elements_of_corner_.resize(mesh_.vertices.size());
  for (std::uint32_t i = 0; i < mesh_.size(); ++i)
    if (factors_.usable[i])
      for (const std::uint32_t corner : mesh_.corners_of(mesh_.patches[i]))
        elements_of_corner_[corner].push_back(i);
  gather_ = std::make_unique<Gather>(mesh_, lamp_scene_, factor_options.occlusion);
  finder_ = std::make_unique<SmoothField>(mesh_, factors_.usable,
                                          BandMatrix::Zero(static_cast<Index>(mesh_.size()), 1));
  direct_ =
      mean_direct(mesh_, lamp_scene_, *gather_, element_tree(mesh_),
                  ShaftCulling(mesh_, lamp_scene_, factor_options.occlusion), options.progress);
}

SceneState SceneModel::state() const {
  const auto bands = static_cast<Index>(scene_->bands.size());
  SceneState state{BandMatrix(static_cast<Index>(scene_->materials.size()), bands),
                   BandMatrix(static_cast<Index>(lamps_.size()), bands),
                   Eigen::VectorXd::Zero(static_cast<Index>(scene_->materials.size())), true};
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

namespace {

/// Of what elements have, the mean over a part.
Eigen::RowVectorXd at_part(const ViewPart& part, const BandMatrix& elements) {
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(elements.cols());
  for (const auto& [element, weight] : part.weights)
    sum += weight * elements.row(static_cast<Index>(element));
  return sum;
}

}  // namespace

ElementLight SceneModel::element_light(const SceneState& state) const {
  const DenseExchange exchange(factors_);
  const BandMatrix rho = element_reflectance(state);
  SolveOptions options;
  options.relative_bound = options_.solver_bound;
  ElementLight light;
  light.outcome = SolveOutcome::converged;
  for (Index l = 0; l < direct_.cols(); ++l) {
    BandMatrix reflected, indirect = BandMatrix::Zero(rho.rows(), rho.cols());
    if (state.interreflection && !lamps_.empty()) {
      const BandMatrix direct = direct_.col(l).replicate(1, rho.cols());
      const SolveSummary summary = solve_radiosity(exchange, rho, rho.cwiseProduct(direct), options,
                                                   reflected, {}, &indirect);
      if (summary.outcome != SolveOutcome::converged) light.outcome = summary.outcome;
    }
    light.indirect.push_back(std::move(indirect));
  }
  return light;
}

BlockRadiosity SceneModel::radiosity_of(const std::vector<ViewBlock>& blocks,
                                        const SceneState& state, const ElementLight& light,
                                        const WantedDerivatives* wanted) const {
  const auto n = static_cast<Index>(blocks.size()), bands = state.reflectance.cols();
  BlockRadiosity answer;
  answer.outcome = light.outcome;
  answer.value = BandMatrix::Zero(n, bands);
  if (wanted && wanted->gloss)
    answer.by_gloss.assign(scene_->materials.size(), BandMatrix::Zero(n, bands));
  for (std::size_t l = 0; l < lamps_.size(); ++l) {
    BandMatrix by_exitance = BandMatrix::Zero(n, bands);
    const auto spectrum = state.exitance.row(static_cast<Index>(l));
    for (Index i = 0; i < n; ++i)
      for (const ViewPart& part : blocks[static_cast<std::size_t>(i)].parts) {
        const auto material = static_cast<Index>(material_of(part));
        Eigen::RowVectorXd sent = at_part(part, light.indirect[l]);
        sent.array() += part.direct[static_cast<Index>(l)];
        sent = state.reflectance.row(material).cwiseProduct(sent);
        if (material_of(part) == lamps_[l]) sent.array() += 1.0;
        if (part.gloss.size() > 0) {
          const double seen = part.gloss[static_cast<Index>(l)];
          sent.array() += state.gloss[material] * seen;
          if (!answer.by_gloss.empty())
            answer.by_gloss[material_of(part)].row(i) += part.share * seen * spectrum;
        }
        by_exitance.row(i) += part.share * sent;
      }
    answer.value += by_exitance * spectrum.asDiagonal();
    if (wanted && wanted->exitance) answer.by_exitance.push_back(std::move(by_exitance));
  }
  return answer;
}

BandMatrix SceneModel::by_reflectance(std::size_t material, const SceneState& state,
                                      const ElementLight& light, SolveOutcome& outcome) const {
  const auto n = static_cast<Index>(blocks_.size()), bands = state.reflectance.cols();
  BandMatrix by_rho = BandMatrix::Zero(n, bands);
  BandMatrix direct = BandMatrix::Zero(static_cast<Index>(mesh_.size()), bands), indirect = direct;
  BandMatrix irradiance;  // d I of the elements / d rho
  for (std::size_t l = 0; l < lamps_.size(); ++l) {
    const auto spectrum = state.exitance.row(static_cast<Index>(l));
    direct += direct_.col(static_cast<Index>(l)) * spectrum;
    indirect += light.indirect[l] * spectrum.asDiagonal();
  }
  if (state.interreflection && !lamps_.empty()) {
    const DenseExchange exchange(factors_);
    const BandMatrix rho = element_reflectance(state);
    std::vector<char> is_in_material(mesh_.size());
    for (std::size_t i = 0; i < mesh_.size(); ++i)
      is_in_material[i] = scene_->surfaces[mesh_.surface_of(mesh_.patches[i])].material == material;
    SolveOptions options;
    options.relative_bound = options_.solver_bound;
    BandMatrix derivative;
    const SolveSummary summary = reflectance_sensitivity({exchange, rho, direct, indirect},
                                                         is_in_material, options, derivative);
    if (summary.outcome != SolveOutcome::converged) outcome = summary.outcome;
    irradiance = factors_.area_m2.cwiseInverse().asDiagonal() * exchange.product(derivative);
  }
  for (Index i = 0; i < n; ++i)
    for (const ViewPart& part : blocks_[static_cast<std::size_t>(i)].parts) {
      const std::size_t own = material_of(part);
      if (irradiance.size() > 0)
        by_rho.row(i) +=
            part.share *
            state.reflectance.row(static_cast<Index>(own)).cwiseProduct(at_part(part, irradiance));
      if (own != material) continue;
      by_rho.row(i) += part.share * at_part(part, indirect);
      for (std::size_t l = 0; l < lamps_.size(); ++l)
        by_rho.row(i) += part.share * part.direct[static_cast<Index>(l)] *
                         state.exitance.row(static_cast<Index>(l));
    }
  return by_rho;
}

BlockRadiosity SceneModel::radiosity(const SceneState& state,
                                     const WantedDerivatives* wanted) const {
  const ElementLight light = element_light(state);
  BlockRadiosity answer = radiosity_of(blocks_, state, light, wanted);
  if (!wanted) return answer;
  for (std::size_t m = 0; m < scene_->materials.size(); ++m)
    answer.by_reflectance.push_back(
        wanted->reflectance[m] ? by_reflectance(m, state, light, answer.outcome) : BandMatrix());
  return answer;
}

}  // namespace truebox
