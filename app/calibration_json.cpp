// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <nlohmann/json.hpp>

#include "calibration_report.h"

namespace truebox::app {
namespace {

using nlohmann::json;

json estimate(const Estimate& e) { return {{"value", e.value}, {"u", e.standard_uncertainty}}; }

json check_json(const NoiseCheck& check) {
  return {{"chi2_per_dof", check.chi2_per_dof},
          {"u", check.u},
          {"samples", check.samples},
          {"outliers", check.outliers}};
}

json noise_json(const SiteNoise& noise, double step_dn) {
  json j{{"site", std::string(1, noise.site)},
         {"floor_dn2", noise.model.floor_dn2},
         {"gain_dn", noise.model.gain_dn},
         {"stated_by_the_file", noise.given},
         {"held_out", check_json(noise.pooled)}};
  const PhotonTransfer& t = noise.transfer;
  if (t.found)
    j["photon_transfer"] = {{"gain_dn", {{"value", t.model.gain_dn}, {"u", t.gain_u_dn}}},
                            {"floor_dn2", {{"value", t.model.floor_dn2}, {"u", t.floor_u_dn2}}},
                            {"read_noise_dn", estimate(t.read_noise_dn(step_dn))},
                            {"correlation", t.correlation},
                            {"dispersion", t.dispersion},
                            {"samples", t.samples},
                            {"outliers", t.outliers}};
  else
    j["photon_transfer"] = {{"not_found", t.why_not}};
  for (const HeldOutNoise& group : noise.held_out) {
    json g = check_json(group.check);
    g["left_out"] = group.group;
    j["held_out"]["groups"].push_back(g);
  }
  return j;
}

json dark_json(const MasterDark& dark, const DarkDistribution* distribution) {
  json j{{"exposure_s", dark.exposure_s},
         {"frames", dark.frames},
         {"average_dn", dark.average_dn},
         {"u_of_mean_dn", std::sqrt(dark.variance_dn2)},
         {"clipped_fraction", dark.clipped_fraction}};
  if (distribution && distribution->found) {
    j["black_level_dn"] = estimate(distribution->mean_dn);
    j["sigma_dn"] = estimate(distribution->sigma_dn);
    j["sigma_from"] =
        distribution->sigma_dn.standard_uncertainty > 0.0 ? "dark frames" : "photon transfer";
  }
  return j;
}

json instrument_json(const InstrumentCalibration& instrument, const Instrument& file) {
  const CameraResponse& response = instrument.response;
  json j{{"response", file.response},
         {"offset_dn", response.offset_dn.value},
         {"offset_u_dn", response.offset_dn.standard_uncertainty},
         {"curvature_per_dn", response.curvature_per_dn.value},
         {"curvature_u_per_dn", response.curvature_per_dn.standard_uncertainty},
         {"response_chi2_per_dof", instrument.linearity.chi2_per_dof},
         {"response_chi2_per_dof_if_linear", instrument.linearity.chi2_per_dof_linear},
         {"darks", json::array()}};
  for (std::size_t i = 0; i < instrument.darks.size(); ++i)
    j["darks"].push_back(dark_json(instrument.darks[i], i < instrument.dark_distributions.size()
                                                            ? &instrument.dark_distributions[i]
                                                            : nullptr));
  for (const SiteNoise& noise : instrument.noise)
    j["noise"].push_back(noise_json(noise, file.step_dn));
  if (!instrument.noise.empty()) {
    j["noise_floor_dn2"] = instrument.noise.front().model.floor_dn2;
    j["gain_dn"] = instrument.noise.front().model.gain_dn;
  }
  const DefectMap& defects = instrument.defects;
  j["defects"] = {{"hot", defects.hot},       {"hot_limit_dn", defects.hot_limit_dn},
                  {"dead", defects.dead},     {"stuck", defects.stuck},
                  {"masked", defects.masked}, {"not_finite", defects.not_finite},
                  {"total", defects.total()}};
  const FlatField& flat = instrument.flat;
  j["flat"] = {{"model", flat.model}};
  if (!flat.coefficients.empty()) {
    j["flat"]["coefficients"] = flat.coefficients;
    j["flat"]["coefficients_u"] = flat.coefficients_u;
    j["flat"]["chi2_per_dof"] = flat.chi2_per_dof;
  }
  if (instrument.curve.found) {
    for (const Estimate& e : instrument.curve.signal_dn) {
      j["curve"]["signal_dn"].push_back(e.value);
      if (std::isfinite(e.standard_uncertainty))
        j["curve"]["u_dn"].push_back(e.standard_uncertainty);
      else
        j["curve"]["u_dn"].push_back("inf");
    }
    j["curve"]["largest_repair"] = instrument.curve.largest_repair;
    j["curve"]["lowest_reading"] = instrument.curve.lowest;
    j["curve"]["highest_reading"] = instrument.curve.highest;
  }
  return j;
}

json budget_json(const UncertaintyBudget& budget) {
  json j = json::object();
  for (const auto& c : budget.contributions()) j[c.name] = c.standard_uncertainty;
  j["combined"] = budget.combined();
  return j;
}

json photograph_json(const LinearPhotograph& p, const std::string& file) {
  return {{"band", p.band},
          {"file", file},
          {"unit", p.unit},
          {"exposures_s", p.exposures_s},
          {"mean_ratio", p.mean_ratio},
          {"linearity_chi2_per_dof", p.chi2_per_dof},
          {"linearity_dof", p.dof},
          {"saturated", p.saturated},
          {"below_floor", p.below_floor},
          {"glare", estimate(p.glare)},
          {"budget",
           {{"value", p.reference_value},
            {"noise", budget_json(p.noise_budget)},
            {"common", budget_json(p.common_budget)}}}};
}

}  // namespace

std::string calibration_json(const PhotometricCalibration& calibration,
                             const std::vector<std::string>& files) {
  const MeasurementFile& file = calibration.file;
  json j{{"title", file.title},
         {"measurement", file.path},
         {"source", file.provenance.source},
         {"unit", calibration.photographs.empty() ? "" : calibration.photographs[0].unit},
         {"instrument", instrument_json(calibration.instruments.front(), file.instrument)}};
  for (std::size_t c = 1; c < calibration.instruments.size(); ++c)
    j["other_channels"].push_back(instrument_json(calibration.instruments[c], file.instrument));
  for (std::size_t i = 0; i < calibration.photographs.size(); ++i)
    j["bands"].push_back(photograph_json(calibration.photographs[i], files[i]));
  return j.dump(2) + "\n";
}

}  // namespace truebox::app
