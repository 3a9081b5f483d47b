// SPDX-License-Identifier: BSD-3-Clause
#include "calibration_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "figures/false_colour.h"
#include "figures/line_plot.h"

namespace truebox::app {
namespace {

constexpr double kNoiseTolerance = 0.1;  // of chi^2/nu: the noise itself is then right to 5 %

double quantile(std::vector<float> values, double q) {
  std::erase_if(values, [](float v) { return !std::isfinite(v); });
  if (values.empty()) return 1.0;
  const auto at = values.begin() + static_cast<long>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return double{*at};
}

std::array<std::uint8_t, 3> flag_colour(std::uint8_t flags) {
  if (flags & (kMaskedPhotosite | kNotFinitePhotosite)) return {0, 158, 115};
  if (flags & (kDeadPhotosite | kStuckPhotosite)) return {204, 121, 167};
  if (flags & kHotPhotosite) return {240, 228, 66};
  if (flags & kSaturatedPhotosite) return {213, 94, 0};
  return {0, 114, 178};
}

std::vector<Check> make_checks(const PhotometricCalibration& calibration) {
  std::vector<Check> checks;
  for (std::size_t c = 0; c < calibration.instruments.size(); ++c) {
    const std::string channel =
        calibration.instruments.size() > 1 ? fmt::format("channel {}, ", c + 1) : "";
    for (const SiteNoise& noise : calibration.instruments[c].noise) {
      if (noise.pooled.samples == 0) {
        checks.push_back(
            {fmt::format("{}photosites {}: noise on frames not used", channel, noise.site),
             Agreement::not_run, 0.0, kNoiseTolerance, "1", "too few frames to leave any out"});
        continue;
      }
      const double off = std::abs(noise.pooled.chi2_per_dof - 1.0);
      checks.push_back(
          {fmt::format("{}photosites {}: measured over predicted variance, less 1, on frames not "
                       "used",
                       channel, noise.site),
           off <= kNoiseTolerance ? Agreement::agrees : Agreement::warning, off, kNoiseTolerance,
           "1",
           fmt::format("chi2/nu {:.3f} +- {:.3f} over {} groups left out in turn",
                       noise.pooled.chi2_per_dof, noise.pooled.u, noise.held_out.size())});
    }
  }
  return checks;
}

Table noise_table(const PhotometricCalibration& calibration) {
  Table table{"Photon transfer: variance = floor + gain x signal; u with k = 1",
              {{"Photosites"},
               {"Gain", "DN", 4, false},
               {"Floor", "DN^2", 3, false},
               {"Read noise", "DN", 3, false},
               {"chi2/nu on frames not used", "1", 3, true},
               {"Scatter over that of noise", "1", 2, true},
               {"Blocks"}},
              {}};
  for (const InstrumentCalibration& instrument : calibration.instruments)
    for (const SiteNoise& noise : instrument.noise) {
      const PhotonTransfer& t = noise.transfer;
      const Estimate read = t.read_noise_dn(calibration.file.instrument.step_dn);
      if (noise.given || !t.found)
        table.rows.push_back({std::string(1, noise.site), noise.model.gain_dn,
                              noise.model.floor_dn2, "stated",
                              Cell(noise.pooled.chi2_per_dof, noise.pooled.u), t.dispersion,
                              fmt::format("{}", t.samples)});
      else
        table.rows.push_back({std::string(1, noise.site), Cell(t.model.gain_dn, t.gain_u_dn),
                              Cell(t.model.floor_dn2, t.floor_u_dn2),
                              Cell(read.value, read.standard_uncertainty),
                              Cell(noise.pooled.chi2_per_dof, noise.pooled.u), t.dispersion,
                              fmt::format("{}", t.samples)});
    }
  return table;
}

Table held_out_table(const PhotometricCalibration& calibration) {
  Table table{"Measured over predicted variance where a group was left out of the fit",
              {{"Left out"}, {"Photosites"}, {"chi2/nu", "1", 3, true}, {"Blocks"}, {"Outliers"}},
              {}};
  for (const InstrumentCalibration& instrument : calibration.instruments)
    for (const SiteNoise& noise : instrument.noise)
      for (const HeldOutNoise& group : noise.held_out)
        table.rows.push_back(
            {group.group, std::string(1, noise.site), Cell(group.check.chi2_per_dof, group.check.u),
             fmt::format("{}", group.check.samples), fmt::format("{}", group.check.outliers)});
  return table;
}

double largest_dispersion(const PhotometricCalibration& calibration) {
  double largest = 0.0;
  for (const InstrumentCalibration& instrument : calibration.instruments)
    for (const SiteNoise& noise : instrument.noise)
      largest = std::max(largest, noise.transfer.dispersion);
  return largest;
}

Table budget_table(const LinearPhotograph& p) {
  Table table{fmt::format("{}: budget of one photosite at {:.4g} {} (the median); k = 1", p.band,
                          p.reference_value, p.unit),
              {{"Contribution"}, {"Kind"}, {"u", p.unit, 3}, {"of the value", "%", 3, true}},
              {}};
  const auto add = [&](const char* kind, const std::string& name, double u) {
    table.rows.push_back(
        {name, kind, u,
         p.reference_value != 0.0 ? Cell(100.0 * u / std::abs(p.reference_value)) : Cell("")});
  };
  for (const auto& c : p.noise_budget.contributions()) add("noise", c.name, c.standard_uncertainty);
  for (const auto& c : p.common_budget.contributions())
    add("common", c.name, c.standard_uncertainty);
  add("noise", "combined", p.noise_budget.combined());
  add("common", "combined", p.common_budget.combined());
  return table;
}

Table photograph_table(const PhotometricCalibration& calibration) {
  Table table{"Photographs",
              {{"Band"},
               {"Exposures"},
               {"Agreement of exposures, chi2/nu", "1", 2, true},
               {"Largest departure", "%", 2, true},
               {"Saturated"},
               {"Below floor"},
               {"Defective"},
               {"Glare"}},
              {}};
  for (const LinearPhotograph& p : calibration.photographs) {
    double largest = 0.0;
    for (double r : p.mean_ratio)
      if (r > 0.0) largest = std::max(largest, 100.0 * std::abs(r - 1.0));
    const auto defective = std::count_if(p.flags.begin(), p.flags.end(), [](std::uint8_t f) {
      return (f & ~(kSaturatedPhotosite | kBelowFloorPhotosite)) != 0;
    });
    table.rows.push_back({p.band, fmt::format("{}", p.exposures_s.size()), p.chi2_per_dof, largest,
                          fmt::format("{}", p.saturated), fmt::format("{}", p.below_floor),
                          fmt::format("{}", defective),
                          p.glare.value != 0.0 ? Cell(p.glare.value, p.glare.standard_uncertainty)
                                               : Cell("not estimated")});
  }
  return table;
}

PictureRow pictures(const LinearPhotograph& p) {
  std::vector<float> relative(p.value.size()), common(p.value.size());
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    relative[i] = p.u_noise[i] / std::max(std::abs(p.value[i]), 1e-12f);
    common[i] = p.u_common[i] / std::max(std::abs(p.value[i]), 1e-12f);
  }
  PictureRow row;
  row.panels.push_back(
      {p.band,
       plain_picture(p.width, p.height, flag_overlay(p),
                     "red: saturated; blue: below the floor; yellow: hot; magenta: "
                     "dead or stuck; green: masked or not finite"),
       "linear photograph in grey, photosites that measure nothing in colour"});
  const auto relative_picture = [&](const std::vector<float>& u, const char* title) {
    const double top = std::max(quantile(u, 0.98), 1e-6);
    row.panels.push_back(
        {title,
         false_colour(p.width, p.height, u, {0.0, top}, "standard uncertainty over value", "1"),
         "relative standard uncertainty in false colour"});
  };
  relative_picture(relative, "Noise");
  relative_picture(common, "Common to neighbours");
  row.caption = p.band + ": nothing is interpolated; each pixel is one photosite.";
  return row;
}

Figure response_figure(const InstrumentCalibration& instrument) {
  PlotSeries curve{"recovered", {}, {}};
  for (std::size_t r = instrument.curve.lowest; r <= instrument.curve.highest; ++r) {
    curve.x.push_back(static_cast<double>(r));
    curve.y.push_back(instrument.curve.signal_dn[r].value);
    curve.u_y.push_back(instrument.curve.signal_dn[r].standard_uncertainty);
  }
  return {
      "Response",
      to_svg({"Response curve", {"reading", "DN"}, {"signal", "DN"}, {std::move(curve)}}),
      "The signal of each reading, up to a scale that makes the middle readings mean themselves; "
      "ribbon: u, k = 1."};
}

Paragraph linearity_text(const PhotometricCalibration& calibration) {
  const InstrumentCalibration& i = calibration.instruments.front();
  if (i.curve.found)
    return {
        fmt::format("The response was recovered from the exposures ({}); making it rise changed "
                    "it by {:.2g} % at most.",
                    calibration.file.instrument.response, 100.0 * i.curve.largest_repair)};
  if (i.linearity.readings == 0) return {"Linearity was not tested: the exposures do not overlap."};
  const auto& [offset, curvature, table] = i.linearity.response;
  return {fmt::format(
      "Linearity: the exposure series show an offset of {:.3g} +- {:.2g} DN and a curvature of "
      "{:.3g} +- {:.2g} per DN, which is {:.2g} % at {:.0f} DN; chi2/nu {:.2f} with both, {:.2f} "
      "for a linear camera. {}",
      offset.value, offset.standard_uncertainty, curvature.value, curvature.standard_uncertainty,
      100.0 * curvature.value * calibration.file.instrument.saturation_dn,
      calibration.file.instrument.saturation_dn, i.linearity.chi2_per_dof,
      i.linearity.chi2_per_dof_linear,
      calibration.file.instrument.response == "fitted"
          ? "Both were corrected."
          : "Neither was corrected; both count as common uncertainty.")};
}

Paragraph defect_text(const InstrumentCalibration& instrument) {
  const DefectMap& d = instrument.defects;
  return {fmt::format(
      "Defective photosites: {} hot (dark reading above {:.2f} DN), {} dead, {} "
      "stuck, {} masked, {} not finite. They keep what they read, with an infinite "
      "uncertainty. Flat field: {}.",
      d.hot, d.hot_limit_dn, d.dead, d.stuck, d.masked, d.not_finite, instrument.flat.model)};
}

}  // namespace

std::vector<std::uint8_t> flag_overlay(const LinearPhotograph& p) {
  std::vector<float> shown;
  for (std::size_t i = 0; i < p.value.size(); ++i)
    if (p.flags[i] == 0) shown.push_back(p.value[i]);
  const double top = std::max(quantile(shown.empty() ? p.value : shown, 0.99), 1e-30);
  std::vector<std::uint8_t> rgb(3 * p.value.size());
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    const double v = std::isfinite(p.value[i]) ? std::clamp(p.value[i] / top, 0.0, 1.0) : 0.0;
    const auto grey = static_cast<std::uint8_t>(std::lround(255.0 * std::pow(v, 1.0 / 2.2)));
    const std::array<std::uint8_t, 3> colour =
        p.flags[i] == 0 ? std::array<std::uint8_t, 3>{grey, grey, grey} : flag_colour(p.flags[i]);
    std::copy(colour.begin(), colour.end(), rgb.begin() + static_cast<long>(3 * i));
  }
  return rgb;
}

Report calibration_report(const PhotometricCalibration& calibration) {
  Report report;
  report.title = calibration.file.title;
  report.subtitle = "Linear photographs and their uncertainties: " + calibration.file.path;
  report.checks = make_checks(calibration);
  report.verdict.outcome = worst_outcome(report.checks);
  double worst = 0.0;
  bool tested = false;
  for (const Check& check : report.checks)
    if (check.outcome != Agreement::not_run) {
      tested = true;
      worst = std::max(worst, check.measured);
    }
  report.verdict.sentence =
      tested ? fmt::format(
                   "{} linear photographs; on frames that no fit used, the mean variance of each "
                   "colour differs from the prediction by {:.1f} % at most",
                   calibration.photographs.size(), 100.0 * worst)
             : fmt::format("{} linear photographs; too few frames to test their noise",
                           calibration.photographs.size());
  Section camera{"The camera", {}};
  camera.blocks.push_back(linearity_text(calibration));
  for (const InstrumentCalibration& instrument : calibration.instruments) {
    camera.blocks.push_back(defect_text(instrument));
    if (instrument.curve.found) camera.blocks.push_back(response_figure(instrument));
  }
  camera.blocks.push_back(noise_table(calibration));
  if (const double scatter = largest_dispersion(calibration); scatter > 1.5)
    camera.blocks.push_back(Paragraph{fmt::format(
        "The variances of single blocks scatter {:.1f} times as much as noise alone would: "
        "rounding "
        "is coarser than the noise and repeats from photosite to photosite. Means over many blocks "
        "hold, single groups below may not; the uncertainties of gain and floor are enlarged for "
        "it.",
        std::sqrt(scatter))});
  camera.blocks.push_back(held_out_table(calibration));
  Section photographs{"The photographs", {photograph_table(calibration)}};
  Section budgets{"Uncertainty budgets", {}};
  for (const LinearPhotograph& p : calibration.photographs) {
    photographs.blocks.push_back(pictures(p));
    budgets.blocks.push_back(budget_table(p));
  }
  report.sections = {std::move(camera), std::move(photographs), std::move(budgets)};
  report.provenance = {{"Frames", calibration.file.provenance.source},
                       {"Licence", calibration.file.provenance.licence},
                       {"Camera", calibration.file.instrument.camera}};
  return report;
}

}  // namespace truebox::app
