// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_measurement_fit.h"

#include <algorithm>
#include <cmath>

#include "fit/scene_forward.h"
#include "fit/scene_planes.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"
#include "scene/scene_file.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

Hold hold_of(const std::string& word) {
  return word == "free" ? Hold::free : word == "prior" ? Hold::prior : Hold::fixed;
}

std::string names_of(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& n : names) text += (text.empty() ? "" : ", ") + n;
  return text;
}

std::size_t material_named(const Scene& scene, const std::string& name,
                           const SceneMeasurementFile& file, int line) {
  std::vector<std::string> known;
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    if (scene.materials[m].name == name) return m;
    known.push_back(scene.materials[m].name);
  }
  throw InputError(file.path, line, "a material of the scene: " + names_of(known),
                   "\"" + name + "\"");
}

SpectralBasis basis_of(const std::string& word) {
  return word == "constant"  ? SpectralBasis::constant
         : word == "linear"  ? SpectralBasis::linear
         : word == "bspline" ? SpectralBasis::bspline
                             : SpectralBasis::bands;
}

SpectralPrior spectra_of(const MaterialChoice& choice, const Scene& scene) {
  const TableFile table = read_table(choice.spectra_path);
  Eigen::MatrixXd spectra(static_cast<Index>(table.columns.size()) - 1,
                          static_cast<Index>(scene.bands.size()));
  if (spectra.rows() < 2)
    throw InputError(choice.spectra_path, 0, "two or more columns of reflectance beside wavelength",
                     std::to_string(spectra.rows()));
  for (Index i = 0; i < spectra.rows(); ++i) {
    const auto values = sample_bands(
        spectrum_from_table(table, table.columns[static_cast<std::size_t>(i) + 1]), scene.bands);
    for (Index b = 0; b < spectra.cols(); ++b) spectra(i, b) = values[static_cast<std::size_t>(b)];
  }
  return prior_of_spectra(spectra, choice.spectra_floor_u);
}

void choose_reflectances(SceneMeasurement& m) {
  m.problem.reflectances.assign(m.scene->materials.size(), ReflectanceChoice{});
  for (const auto& [name, choice] : m.file.reflectances) {
    const std::size_t material = material_named(*m.scene, name, m.file, choice.line);
    ReflectanceChoice& target = m.problem.reflectances[material];
    if (!choice.same_as.empty()) {
      target.same_as = material_named(*m.scene, choice.same_as, m.file, choice.line);
      continue;
    }
    target.hold = hold_of(choice.fit);
    target.standard_uncertainty = choice.standard_uncertainty;
    target.basis = basis_of(choice.basis);
    target.count = choice.count;
    target.curvature_u = choice.curvature_u;
    if (!choice.spectra_path.empty()) target.spectra = spectra_of(choice, *m.scene);
    if (choice.start)
      m.scene->materials[material].reflectance = Reflectance(m.scene->bands.size(), *choice.start);
  }
}

void choose_emissions(SceneMeasurement& m) {
  const auto& lamps = m.model->lamps();
  m.problem.emissions.assign(lamps.size(), EmissionChoice{});
  for (const auto& [name, choice] : m.file.emissions) {
    const std::size_t material = material_named(*m.scene, name, m.file, choice.line);
    const auto lamp = std::find(lamps.begin(), lamps.end(), material);
    if (lamp == lamps.end())
      throw InputError(m.file.path, choice.line, "a material that emits", "\"" + name + "\"");
    m.problem.emissions[static_cast<std::size_t>(lamp - lamps.begin())] = {
        hold_of(choice.fit), choice.each_band, choice.standard_uncertainty};
  }
}

void choose_response(SceneMeasurement& m) {
  if (!m.file.response) return;
  ResponseChoice choice;
  choice.hold = hold_of(m.file.response->fit);
  choice.segments = m.file.response->segments;
  choice.decades = m.file.response->decades;
  choice.gamma_u = m.file.response->standard_uncertainty;
  choice.white = 0.0;
  for (const PlaneReadings& plane : m.problem.planes)
    for (const BlockReading& r : plane.readings) choice.white = std::max(choice.white, r.value);
  if (choice.white > 0.0) m.problem.response = choice;
}

/// The scene with the fitted reflectances and emissions.
Scene fitted_scene(const SceneMeasurement& m, const SceneFit& fit) {
  Scene scene = *m.scene;
  for (std::size_t k = 0; k < scene.materials.size(); ++k)
    for (std::size_t b = 0; b < scene.bands.size(); ++b)
      scene.materials[k].reflectance[b] =
          fit.state.reflectance(static_cast<Index>(k), static_cast<Index>(b));
  for (std::size_t l = 0; l < m.model->lamps().size(); ++l)
    for (std::size_t b = 0; b < scene.bands.size(); ++b)
      scene.materials[m.model->lamps()[l]].exitance[b] =
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
  m.scene = std::make_unique<Scene>(read_scene(file.scene_path));
  if (!file.bands_nm.empty()) try {
      *m.scene = in_bands_at(*m.scene, {file.bands_nm.begin(), file.bands_nm.end()});
    } catch (const std::invalid_argument& error) {
      throw InputError(file.path, 0, "bands_nm = bands of the scene", error.what());
    }
  choose_reflectances(m);
  SceneModelOptions options;
  options.elements = file.elements;
  options.margin_px = file.margin_px;
  options.progress = progress;
  m.model = std::make_unique<SceneModel>(*m.scene, options);
  m.problem.model = m.model.get();
  m.problem.interreflection = file.interreflection;
  choose_emissions(m);
  add_planes(m, progress);
  choose_response(m);
  return m;
}

SceneFit fit_measurement(SceneMeasurement& m, const SceneFitOptions& options,
                         const Progress& progress) {
  SceneFitOptions how = options;
  how.robust_sigma = m.file.robust_sigma;
  m.problem.region_relative_u.resize(0, 0);
  SceneFit fit = fit_scene(m.problem, how);
  if (!m.file.model_bound || fit.stopped || !m.file.interreflection ||
      (fit.summary.outcome != Outcome::converged && fit.summary.outcome != Outcome::rank_deficient))
    return fit;
  m.problem.region_relative_u = model_uncertainty(m, fit, progress);
  return fit_scene(m.problem, how);
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
