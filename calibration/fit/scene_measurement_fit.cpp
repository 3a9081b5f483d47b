// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_measurement_fit.h"

#include <algorithm>
#include <cmath>

#include "fit/scene_choices.h"
#include "fit/scene_forward.h"
#include "fit/scene_planes.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

/// The scene with the fitted reflectances and emissions.
Scene fitted_scene(const SceneMeasurement& m, const SceneFit& fit) {
  Scene scene = m.scene();
  for (std::size_t k = 0; k < scene.materials.size(); ++k)
    for (std::size_t b = 0; b < scene.bands.size(); ++b)
      scene.materials[k].reflectance[b] =
          fit.state.reflectance(static_cast<Index>(k), static_cast<Index>(b));
  for (std::size_t l = 0; l < m.model().lamps().size(); ++l)
    for (std::size_t b = 0; b < scene.bands.size(); ++b)
      scene.materials[m.model().lamps()[l]].exitance[b] =
          fit.state.exitance(static_cast<Index>(l), static_cast<Index>(b));
  return scene;
}

/// Bound of each surface's mean irradiance over that irradiance, as a standard uncertainty, in each
/// plane: surfaces x planes.
BandMatrix model_uncertainty(const SceneMeasurement& m, const SceneFit& fit,
                             const Progress& progress) {
  const Scene scene = fitted_scene(m, fit);
  PredictOptions options;
  options.elements = m.file.elements;
  options.progress = progress;
  const Prediction prediction(scene, options);
  const BandMatrix bound = prediction.surface_irradiance_bound();
  const BandMatrix irradiance = prediction.irradiance();
  BandMatrix mean = BandMatrix::Zero(bound.rows(), bound.cols());
  Eigen::VectorXd area = Eigen::VectorXd::Zero(bound.rows());
  const PatchMesh& mesh = prediction.fine().mesh;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (!prediction.fine().usable[i]) continue;
    const auto s = static_cast<Index>(mesh.surface_of(mesh.patches[i]));
    mean.row(s) += mesh.patches[i].area_m2 * irradiance.row(static_cast<Index>(i));
    area[s] += mesh.patches[i].area_m2;
  }
  BandMatrix u = BandMatrix::Zero(bound.rows(), static_cast<Index>(m.problem.planes.size()));
  for (Index s = 0; s < u.rows(); ++s)
    for (Index k = 0; k < u.cols(); ++k) {
      const Eigen::VectorXd& w = m.problem.planes[static_cast<std::size_t>(k)].band_weights;
      const double light = area[s] > 0.0 ? mean.row(s).dot(w) / area[s] : 0.0;
      if (light > 0.0) u(s, k) = bound.row(s).dot(w) / light / std::sqrt(3.0);
    }
  return u;
}

}  // namespace

SceneMeasurement read_scene_fit(const SceneMeasurementFile& file, const Progress& progress) {
  SceneMeasurement m;
  m.file = file;
  Scene scene = read_scene(file.scene_path);
  if (!file.bands_nm.empty()) try {
      scene = in_bands_at(scene, {file.bands_nm.begin(), file.bands_nm.end()});
    } catch (const std::invalid_argument& error) {
      throw InputError(file.path, 0, "bands_nm = bands of the scene", error.what());
    }
  choose_reflectances(m, scene);
  choose_cameras(m, scene);
  choose_offsets(m, scene);
  SceneModelOptions options;
  options.edge_m = edge_for_count(scene, file.elements);  // the same wherever surfaces move to
  options.margin_px = file.margin_px;
  options.tile_px = file.tile_px;
  options.roughness = choose_gloss(m, scene);
  options.progress = progress;
  // Derivatives by differences want form factors without noise.
  if (m.shaped.moves_surfaces()) options.form_factors.method = FormFactorMethod::exact_visibility;
  m.shaped.original = scene;
  m.shaped.scene = std::make_unique<Scene>(std::move(scene));
  m.shaped.model = std::make_unique<SceneModel>(m.scene(), options);
  m.problem.model = &m.model();
  m.problem.interreflection = file.interreflection;
  choose_emissions(m);
  add_planes(m, progress);
  choose_response(m);
  return m;
}

namespace {

constexpr double kMoved_px = 0.5;  // half of what is left out beside an edge
constexpr int kMostSortings = 5;

/// Fits, and sorts the pixels again as long as what they show has moved.
SceneFit fit_where_things_are(SceneMeasurement& m, const ShapeFitOptions& options,
                              const Progress& progress) {
  SceneFit fit;
  for (int k = 0; k < kMostSortings; ++k) {
    const std::vector<double> before = m.shaped.values;
    fit = fit_shaped_scene(m.problem, m.shaped, options);
    if (fit.stopped || m.shaped.motion_px(before, m.shaped.values) <= kMoved_px) return fit;
    // Not to be stopped half way: what is reported must belong together.
    m.shaped.model->set_progress({});
    add_planes(m, {});
    m.shaped.model->set_progress(progress);
    m.problem.model = &m.model();
  }
  fit.summary.outcome = Outcome::not_converged;
  fit.summary.message = "cameras or surfaces still move: begin closer, as truebox align would";
  return fit;
}

}  // namespace

SceneFit fit_measurement(SceneMeasurement& m, const ShapeFitOptions& options,
                         const Progress& progress) {
  ShapeFitOptions how = options;
  how.robust_sigma = m.file.robust_sigma;
  m.problem.region_relative_u.resize(0, 0);
  SceneFit fit = fit_where_things_are(m, how, progress);
  if (!m.file.model_bound || fit.stopped || !m.file.interreflection ||
      (fit.summary.outcome != Outcome::converged && fit.summary.outcome != Outcome::rank_deficient))
    return fit;
  try {
    m.problem.region_relative_u = model_uncertainty(m, fit, progress);
    return fit_where_things_are(m, how, progress);
  } catch (const FitStopped&) {
    fit.stopped = true;
    fit.summary.outcome = Outcome::not_converged;
    fit.summary.message = "stopped by the user before the model's error entered the uncertainties";
    return fit;
  }
}

std::vector<FittedReading> predict_held_out(const SceneFitProblem& problem,
                                            const std::vector<std::vector<BlockReading>>& held_out,
                                            const SceneFit& fit) {
  SceneFitProblem other = problem;
  for (std::size_t k = 0; k < other.planes.size(); ++k) other.planes[k].readings = held_out[k];
  const SceneForward forward(other);
  Eigen::VectorXd x(static_cast<Index>(fit.parameters.size())), y;
  for (Index k = 0; k < x.size(); ++k)
    x[k] = fit.parameters[static_cast<std::size_t>(k)].estimate.value;
  Eigen::MatrixXd derivatives;
  forward.predict(x, y, &derivatives);
  const Eigen::MatrixXd product = derivatives * fit.covariance;
  std::vector<FittedReading> readings;
  Index row = 0;
  for (std::size_t k = 0; k < other.planes.size(); ++k)
    for (const BlockReading& r : other.planes[k].readings) {
      const std::size_t s = problem.model->blocks()[r.block].surface;
      const double region =
          problem.region_relative_u.size() > 0
              ? r.value * problem.region_relative_u(static_cast<Index>(s), static_cast<Index>(k))
              : 0.0;
      const double fitted = std::max(0.0, product.row(row).dot(derivatives.row(row)));
      readings.push_back(
          {.plane = k,
           .block = r.block,
           .value = r.value,
           .predicted = y[row],
           .standard_uncertainty = std::sqrt(r.standard_uncertainty * r.standard_uncertainty +
                                             region * region + fitted)});
      ++row;
    }
  return readings;
}

}  // namespace truebox
