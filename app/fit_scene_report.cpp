// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "figures/false_colour.h"
#include "figures/line_plot.h"
#include "figures/score_plot.h"
#include "fit_scene.h"
#include "image/image_file.h"

namespace truebox::app {
namespace {

constexpr double kShownSigmas = 4.0;
constexpr std::size_t kShownCorrelations = 30;  // parameters of a table that a person can read

Table parameter_table(const SceneFit& fit) {
  Table table{"Estimates with their standard uncertainties (k = 1)",
              {{"Parameter"}, {"Estimate", "", 5}, {"Start", "", 4}, {"Unit"}, {"Remark"}},
              {}};
  for (const FittedParameter& p : fit.parameters)
    table.rows.push_back({p.name,
                          p.at_bound || !p.determined
                              ? Cell(p.estimate.value, Agreement::warning)
                              : Cell(p.estimate.value, p.estimate.standard_uncertainty),
                          p.start, p.unit.empty() ? "1" : p.unit, p.note});
  return table;
}

Table budget_table(const SceneFit& fit) {
  std::vector<std::string> sources;
  for (const FittedParameter& p : fit.parameters)
    for (const Contribution& c : p.budget.contributions())
      if (std::find(sources.begin(), sources.end(), c.name) == sources.end())
        sources.push_back(c.name);
  Table table{"Where the uncertainties come from: standard uncertainties, in quadrature the total",
              {{"Parameter"}},
              {}};
  for (const std::string& s : sources) table.columns.push_back({s, "", 2});
  for (const FittedParameter& p : fit.parameters) {
    std::vector<Cell> row{p.name};
    for (const std::string& s : sources)
      row.push_back(p.budget.of(s) > 0.0 ? Cell(p.budget.of(s)) : Cell(""));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table correlation_table(const SceneFit& fit) {
  const std::size_t n = std::min(kShownCorrelations, fit.parameters.size());
  Table table{n < fit.parameters.size()
                  ? fmt::format("Correlations of the first {} parameters; all are in the JSON", n)
                  : "Correlations",
              {{"Parameter"}},
              {}};
  for (std::size_t j = 0; j < n; ++j)
    table.columns.push_back({fit.parameters[j].name, "1", 2, true});
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<Cell> row{fit.parameters[i].name};
    for (std::size_t j = 0; j < n; ++j)
      row.push_back(fit.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Figure spectra_figure(const SceneFitRun& run) {
  const Scene& scene = run.measurement.scene();
  LinePlot plot{"Fitted reflectances", {"wavelength", "nm"}, {"reflectance", "1"}, {}};
  for (const FittedSpectrum& s : run.fit.spectra) {
    PlotSeries series{scene.materials[s.material].name, scene.bands.centres_nm(), {}};
    series.markers = true;
    for (const Estimate& e : s.reflectance) {
      series.y.push_back(e.value);
      series.u_y.push_back(2.0 * e.standard_uncertainty);
    }
    plot.series.push_back(std::move(series));
  }
  return {"Fitted reflectances", to_svg(plot), "Bars and ribbons: U = 2 u."};
}

Figure history_figure(const SceneFit& fit) {
  LinePlot plot{"Convergence", {"step", "1"}, {"chi2", "1", true}, {{"chi2", {}, {}}}};
  for (const FitStep& s : fit.history) {
    plot.series[0].x.push_back(s.iteration);
    plot.series[0].y.push_back(std::max(s.chi2, 1e-30));
  }
  plot.series[0].markers = true;
  return {"Convergence", to_svg(plot), "chi2 of each step; a new search begins where it jumps."};
}

Table surface_table(const SceneFitRun& run) {
  Table table{"Residuals of each surface, all planes",
              {{"Surface"},
               {"Readings"},
               {"Mean reading over the model's, less 100 %", "%", 2, true},
               {"chi2/n", "1", 2, true},
               {"Largest |z|", "1", 1, true}},
              {}};
  for (const SurfaceResidual& r : surface_residuals(run))
    table.rows.push_back(
        {r.surface, std::to_string(r.readings), r.mean_percent, r.chi2, r.farthest});
  return table;
}

PictureRow plane_pictures(const SceneFitRun& run, const Image& map, std::size_t k) {
  const auto& name = run.measurement.problem.planes[k].name;
  const auto [width, height] = run.measurement.size_px[k];
  const auto& value = map.channels[4 * k].samples;
  const ValueRange range{0.0, std::max(1e-30, value_range(value, 0.01).high)};
  PictureRow row;
  row.panels.push_back({"Reading, " + name,
                        false_colour(width, height, value, range, "reading", "1"),
                        "mean readings of the elements"});
  row.panels.push_back({"Fitted model",
                        false_colour(width, height, map.channels[4 * k + 1].samples, range,
                                     "predicted reading", "1"),
                        "the readings that the fitted scene predicts"});
  row.panels.push_back({"Reading - model, in u",
                        signed_false_colour(width, height, map.channels[4 * k + 3].samples,
                                            kShownSigmas, "(reading - model) / u", "1"),
                        "signed residuals in standard uncertainties"});
  row.caption = name + ": one value an element. What is not a reading has the colour of no number.";
  return row;
}

Table candidate_table(const std::vector<ModelCandidate>& candidates) {
  Table table{"Models compared; the simplest that suffices is chosen",
              {{"Model"},
               {"Parameters"},
               {"AICc", "1", 1, true},
               {"BIC", "1", 1, true},
               {"Held-out rms", "%", 2, true},
               {"Held-out chi2/n", "1", 2, true},
               {"Choice"}},
              {}};
  for (const ModelCandidate& c : candidates)
    table.rows.push_back({c.name, std::to_string(c.parameters), c.aicc, c.bic,
                          100.0 * c.held_out_rms, c.held_out_chi2, c.chosen ? "chosen" : c.why});
  return table;
}

nlohmann::json readings_json(const SceneFitRun& run) {
  nlohmann::json all = nlohmann::json::array();
  const auto add = [&](const FittedReading& r, bool held_out) {
    const ViewBlock& block = run.measurement.model().blocks()[r.block];
    all.push_back({{"plane", run.measurement.problem.planes[r.plane].name},
                   {"surface", run.measurement.scene().surfaces[block.surface].name},
                   {"element", block.element},
                   {"pixels", block.pixels.size()},
                   {"value", r.value},
                   {"predicted", r.predicted},
                   {"u", r.standard_uncertainty},
                   {"held_out", held_out}});
  };
  for (const FittedReading& r : run.fit.readings) add(r, false);
  for (const FittedReading& r : run.held_out) add(r, true);
  return all;
}

/// Cameras that were fitted, as a scene file has them; lengths in mm.
nlohmann::json cameras_json(const ShapedScene& shaped) {
  nlohmann::json all = nlohmann::json::object();
  for (std::size_t v = 0; v < shaped.views.size(); ++v) {
    const std::string& name = shaped.views[v].camera;
    const bool is_fitted = std::any_of(shaped.unknowns.begin(), shaped.unknowns.end(),
                                       [&](const ShapeUnknown& u) { return u.camera == name; });
    if (!is_fitted) continue;
    const CameraDescription camera = shaped.camera(shaped.values, v);
    const auto vector = [](const Vec3& x) { return std::vector<double>{x.x(), x.y(), x.z()}; };
    all[name] = {
        {"position_mm", vector(1e3 * camera.position_m)},
        {"direction", vector(camera.direction)},
        {"up", vector(camera.up)},
        {"focal_length_mm", 1e3 * camera.focal_length_m},
        {"principal_point_mm",
         {1e3 * camera.lens.principal_point_m[0], 1e3 * camera.lens.principal_point_m[1]}}};
  }
  return all;
}

}  // namespace

Image residual_map(const SceneFitRun& run) {
  const auto& m = run.measurement;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Image map;
  for (std::size_t k = 0; k < m.problem.planes.size(); ++k) {
    map.width = std::max(map.width, m.size_px[k].first);
    map.height = std::max(map.height, m.size_px[k].second);
  }
  for (const PlaneReadings& plane : m.problem.planes)
    for (const char* what : {"reading", "predicted", "residual", "z"})
      map.add_channel(plane.name + "." + what, nan);
  const auto paint = [&](const FittedReading& r) {
    const float values[4] = {static_cast<float>(r.value), static_cast<float>(r.predicted),
                             static_cast<float>(r.value - r.predicted), static_cast<float>(r.z())};
    const auto width = static_cast<std::uint32_t>(m.size_px[r.plane].first);
    for (const std::uint32_t i : m.model().blocks()[r.block].pixels)
      for (std::size_t c = 0; c < 4; ++c)
        map.channels[4 * r.plane + c]
            .samples[map.index(static_cast<int>(i % width), static_cast<int>(i / width))] =
            values[c];
  };
  for (const FittedReading& r : run.fit.readings) paint(r);
  for (const FittedReading& r : run.held_out) paint(r);
  map.attributes["source"] = "truebox fit of " + m.file.path;
  return map;
}

void write_residual_maps(const SceneFitRun& run, const std::filesystem::path& directory) {
  const Image map = residual_map(run);
  write_exr(directory / "residuals.exr", map);
  for (std::size_t k = 0; k < run.measurement.problem.planes.size(); ++k) {
    const Picture picture =
        signed_false_colour(map.width, map.height, map.channels[4 * k + 3].samples, kShownSigmas,
                            "(reading - model) / u", "1");
    write_file_atomically(directory / fmt::format("residuals_{}.png", k + 1), picture.png.data(),
                          picture.png.size());
  }
}

Report scene_fit_report(const SceneFitRun& run) {
  const SceneFit& fit = run.fit;
  const auto& file = run.measurement.file;
  Report report;
  report.title = file.title;
  report.subtitle = fmt::format("Reflectances from photographs{}, with their uncertainties",
                                file.simulated ? " (simulated)" : "");
  report.checks.push_back(
      {"fit: converged and determined",
       fit.summary.outcome == Outcome::converged ? Agreement::agrees : Agreement::fails,
       fit.summary.outcome == Outcome::converged ? 1.0 : 0.0, 1.0, "", fit.summary.brief()});
  if (!run.held_out.empty()) {
    const double share = 100.0 * share_within(run.held_out);
    report.checks.push_back({"held-out readings within U (k = 2)",
                             share >= 95.0 ? Agreement::agrees : Agreement::warning, share, 95.0,
                             "%", fmt::format("of {}", run.held_out.size())});
  }
  report.verdict = {
      worst_outcome(report.checks),
      fmt::format(
          "{}; chi2/nu = {:.2f}{}.", to_string(fit.summary.outcome), fit.summary.chi2_per_dof,
          fit.null_directions.empty() ? "" : "; not determined: " + fit.null_directions.front())};
  report.key_numbers = {{"Readings", static_cast<double>(fit.summary.observations)},
                        {"Free parameters", static_cast<double>(fit.summary.parameters)},
                        {"chi2/nu", fit.summary.chi2_per_dof},
                        {"Enlarged by", fit.birge, "", 3, "where chi2/nu exceeds chance"}};
  Section estimates{"Estimates", {parameter_table(fit)}};
  if (!fit.weakest_direction.empty())
    estimates.blocks.push_back(Paragraph{"Least determined: " + fit.weakest_direction});
  for (const std::string& direction : fit.null_directions)
    estimates.blocks.push_back(Paragraph{"Not determined: " + direction});
  if (!fit.spectra.empty() && run.measurement.scene().bands.size() > 1)
    estimates.blocks.push_back(spectra_figure(run));
  estimates.blocks.push_back(budget_table(fit));
  estimates.blocks.push_back(correlation_table(fit));
  Section residuals{"Residuals", {}};
  const Image map = residual_map(run);
  std::vector<double> z;
  for (const FittedReading& r : fit.readings) z.push_back(r.z());
  if (!z.empty())
    residuals.blocks.push_back(Figure{"Residuals in u", z_histogram_svg("Residuals in u", z),
                                      "Readings of one surface share part of their error."});
  residuals.blocks.push_back(surface_table(run));
  for (std::size_t k = 0; k < run.measurement.problem.planes.size(); ++k)
    residuals.blocks.push_back(plane_pictures(run, map, k));
  report.sections = {
      std::move(estimates), std::move(residuals), {"Convergence", {history_figure(fit)}}};
  if (!run.candidates.empty())
    report.sections.push_back({"Model selection", {candidate_table(run.candidates)}});
  report.provenance = {{"Measurement", file.path},
                       {"Photographs", file.provenance.source},
                       {"Licence", file.provenance.licence},
                       {"Scene", file.scene_path}};
  return report;
}

nlohmann::json scene_fit_json(const SceneFitRun& run) {
  const SceneFit& fit = run.fit;
  const Scene& scene = run.measurement.scene();
  nlohmann::json json{{"title", run.measurement.file.title},
                      {"measurement", run.measurement.file.path},
                      {"source", run.measurement.file.provenance.source},
                      {"simulated", run.measurement.file.simulated},
                      {"outcome", to_string(fit.summary.outcome)},
                      {"summary", fit.summary.brief()},
                      {"message", fit.summary.message},
                      {"stopped", fit.stopped},
                      {"chi2", fit.summary.chi2},
                      {"chi2_priors", fit.summary.chi2_standards},
                      {"chi2_per_dof", fit.summary.chi2_per_dof},
                      {"enlarged_by", fit.birge},
                      {"condition", fit.summary.condition},
                      {"readings", fit.summary.observations},
                      {"effective_readings", fit.effective_readings},
                      {"outliers", fit.outliers},
                      {"gloss_left_out", fit.gloss_left_out},
                      {"null_directions", fit.null_directions},
                      {"least_determined", fit.weakest_direction},
                      {"bands_nm", scene.bands.centres_nm()}};
  for (const FittedParameter& p : fit.parameters) {
    nlohmann::json item{{"name", p.name},
                        {"kind", p.kind},
                        {"unit", p.unit.empty() ? "1" : p.unit},
                        {"start", p.start},
                        {"value", p.estimate.value},
                        {"at_bound", p.at_bound},
                        {"at_initial_value", p.at_initial_value},
                        {"determined", p.determined},
                        {"note", p.note}};
    if (p.determined && !p.at_bound) {
      item["u"] = p.estimate.standard_uncertainty;
      for (const Contribution& c : p.budget.contributions())
        item["budget"][c.name] = c.standard_uncertainty;
    }
    json["parameters"].push_back(std::move(item));
  }
  for (Eigen::Index i = 0; i < fit.correlation.rows(); ++i) {
    const Eigen::VectorXd row = fit.correlation.row(i).transpose();
    json["correlation"].push_back(std::vector<double>(row.data(), row.data() + row.size()));
  }
  for (const FittedSpectrum& s : fit.spectra) {
    nlohmann::json item{{"material", scene.materials[s.material].name}};
    for (const Estimate& e : s.reflectance) {
      item["reflectance"].push_back(e.value);
      item["u"].push_back(e.standard_uncertainty);
    }
    json["spectra"].push_back(std::move(item));
  }
  for (const FitStep& s : fit.history)
    json["history"].push_back({{"step", s.iteration},
                               {"chi2", s.chi2},
                               {"step_length", s.step},
                               {"gradient", s.gradient}});
  json["all_readings"] = readings_json(run);
  for (const SurfaceResidual& r : surface_residuals(run))
    json["surfaces"].push_back({{"name", r.surface},
                                {"readings", r.readings},
                                {"mean_percent", r.mean_percent},
                                {"chi2", r.chi2},
                                {"largest_z", r.farthest}});
  json["cameras"] = cameras_json(run.measurement.shaped);
  for (const PlaneCounts& c : run.measurement.counts)
    json["planes"].push_back({{"name", c.name},
                              {"used", c.used},
                              {"held_out", c.held_out},
                              {"masked", c.masked},
                              {"saturated", c.saturated},
                              {"not_finite", c.not_finite},
                              {"not_shown", c.not_shown}});
  if (!run.held_out.empty())
    json["held_out"] = {{"readings", run.held_out.size()},
                        {"rms_relative", rms_relative(run.held_out)},
                        {"share_within_U", share_within(run.held_out)}};
  for (const ModelCandidate& c : run.candidates)
    json["models"].push_back({{"name", c.name},
                              {"parameters", c.parameters},
                              {"aicc", c.aicc},
                              {"bic", c.bic},
                              {"held_out_rms", c.held_out_rms},
                              {"held_out_chi2", c.held_out_chi2},
                              {"chosen", c.chosen},
                              {"why", c.why}});
  return json;
}

}  // namespace truebox::app
