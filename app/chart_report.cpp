// SPDX-License-Identifier: BSD-3-Clause
#include "chart_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "chart_colour.h"
#include "colour/colour_pipeline.h"
#include "difference/ciede2000.h"
#include "figures/line_plot.h"
#include "figures/text.h"

namespace truebox::app {
namespace {

// RMS differences of an earlier analysis of these photographs: quadratic illumination, the
// reflectances of all patches used in fitting it (that is, not held out).
const std::map<std::string, double> kEarlierRms = {
    {"400 nm", 0.064}, {"450 nm", 0.011}, {"500 nm", 0.010}, {"550 nm", 0.009},
    {"600 nm", 0.017}, {"650 nm", 0.012}, {"700 nm", 0.021}};

// The largest count of |E_n| > 1 that chance explains: k = 2 leaves 4.55 % outside, and a binomial
// count exceeds this with a probability below 1 %.
std::size_t binomial_limit(std::size_t n) {
  constexpr double kOutside = 0.0455, kLevel = 0.99;
  double term = std::pow(1.0 - kOutside, static_cast<double>(n)), sum = term;
  std::size_t k = 0;
  while (sum < kLevel && k < n) {
    term *= static_cast<double>(n - k) / static_cast<double>(k + 1) * kOutside / (1.0 - kOutside);
    sum += term;
    ++k;
  }
  return k;
}

// |E_n| that the largest of n normal scores exceeds with a probability of 1 % (Sidak 1967).
double family_wise_limit(std::size_t n) {
  const double each = 1.0 - std::pow(0.99, 1.0 / static_cast<double>(n));
  double low = 0.0, high = 10.0;
  for (int step = 0; step < 60; ++step) {
    const double z = 0.5 * (low + high);
    (std::erfc(z / std::sqrt(2.0)) > each ? low : high) = z;
  }
  return 0.5 * low;  // E_n is z / k, k = 2
}

struct WorstReading {
  const PatchReading* reading = nullptr;
  std::string band;
};

WorstReading worst_reading(const ChartMeasurement& m) {
  WorstReading worst;
  for (const BandMeasurement& band : m.bands)
    for (const PatchReading& r : band.readings)
      if (!r.standard &&
          (!worst.reading || std::abs(r.en.value) > std::abs(worst.reading->en.value)))
        worst = {&r, band.name};
  return worst;
}

std::vector<Check> make_checks(const ChartMeasurement& m) {
  std::vector<Check> checks;
  for (const BandMeasurement& band : m.bands) {
    const auto limit = kEarlierRms.find(band.name);
    if (limit == kEarlierRms.end()) continue;
    checks.push_back(
        {"chart, " + band.name + ": rms of fitted minus certified reflectance",
         band.rms <= limit->second ? Agreement::agrees : Agreement::fails, band.rms, limit->second,
         "1", "18 held-out patches; the limit is what an analysis that saw them all reached"});
  }
  const std::size_t beyond = m.held_out() - m.agreeing(), limit = binomial_limit(m.held_out());
  checks.push_back({"chart: held-out readings with |E_n| > 1",
                    beyond <= limit ? Agreement::agrees : Agreement::fails,
                    static_cast<double>(beyond), static_cast<double>(limit), "",
                    fmt::format("of {}; k = 2 leaves {:.1f} by chance, the limit is exceeded with "
                                "probability 1 %",
                                m.held_out(), 0.0455 * static_cast<double>(m.held_out()))});
  const WorstReading worst = worst_reading(m);
  const double largest = worst.reading ? std::abs(worst.reading->en.value) : 0.0;
  const double family = family_wise_limit(m.held_out());
  checks.push_back({"chart: largest |E_n| of a held-out reading",
                    largest <= family ? Agreement::agrees : Agreement::warning, largest, family,
                    "1",
                    worst.reading ? fmt::format("{} at {}; the limit is family-wise, 1 %",
                                                worst.reading->patch, worst.band)
                                  : "no readings"});
  return checks;
}

Table band_table(const ChartMeasurement& m) {
  Table table{"Held-out patches in each band: fitted from the photograph minus spectrometer",
              {{"Band"},
               {"Photosites"},
               {"Centre", "nm", 1, true},
               {"RMS", "1", 4, true},
               {"Earlier RMS", "1", 3, true},
               {"Largest |E_n|", "1", 2, true},
               {"Agree"},
               {"chi2/nu", "1", 2, true},
               {"Veil", "1", 3, true}},
              {}};
  for (const BandMeasurement& band : m.bands) {
    const auto earlier = kEarlierRms.find(band.name);
    table.rows.push_back(
        {band.name, std::string(1, band.site),
         Cell(band.band.centre_nm.value, band.band.centre_nm.standard_uncertainty), band.rms,
         earlier == kEarlierRms.end() ? Cell("") : Cell(earlier->second), band.largest_en,
         fmt::format("{} of {}", band.agreeing, band.held_out), band.chi2_per_dof,
         band.veil_kept ? Cell(band.veil.value, band.veil.standard_uncertainty) : Cell("none")});
  }
  return table;
}

Table readings_table(const BandMeasurement& band) {
  Table table{
      band.name + ": reflectance fitted from the photograph against the spectrometer, u with k = 1",
      {{"Patch"},
       {"Fitted", "1", 4, true},
       {"Certified", "1", 4, true},
       {"Difference", "1", 4, true},
       {"E_n", "1", 2, true}},
      {}};
  for (const PatchReading& r : band.readings) {
    if (r.standard) continue;
    table.rows.push_back(
        {r.patch,
         r.at_bound ? Cell("at bound 0") : Cell(r.measured.value, r.measured.standard_uncertainty),
         Cell(r.reference.value, r.reference.standard_uncertainty),
         r.measured.value - r.reference.value,
         Cell(r.en.value, r.en.agrees() ? Agreement::agrees : Agreement::warning)});
  }
  return table;
}

Table score_table(const ChartMeasurement& m) {
  Table table{
      "E_n of the held-out readings: photograph minus spectrometer over U, k = 2. Beyond "
      "-1 or 1, marked !, they disagree",
      {{"Patch"}},
      {}};
  for (const BandMeasurement& band : m.bands) table.columns.push_back({band.name});
  for (std::size_t p = 0; p < m.chart.patches.size(); ++p) {
    if (m.bands.front().readings[p].standard) continue;
    std::vector<Cell> row{m.chart.patches[p]};
    for (const BandMeasurement& band : m.bands) {
      const EnScore& en = band.readings[p].en;
      row.push_back(fixed_text(en.value, 2) + (en.agrees() ? "" : " !"));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

PictureRow band_pictures(const BandMeasurement& band, const ColourPipeline& colour) {
  const ChartPlanes& p = band.planes;
  std::vector<float> shown_prediction = p.prediction, difference(p.photograph.size(), 0.0f);
  for (std::size_t i = 0; i < p.photograph.size(); ++i)
    if (p.patch[i] != 0) difference[i] = p.photograph[i] - p.prediction[i];
  const double exposure = exposure_for_quantile(p.prediction, 0.99);
  const auto photo = colour.grey_picture(p.width, p.height, p.photograph, exposure);
  const auto predicted = colour.grey_picture(p.width, p.height, shown_prediction, exposure);
  PictureRow row;
  row.panels.push_back({"Photograph, " + band.name,
                        plain_picture(p.width, p.height, photo.rgb, photo.note),
                        "linear photograph of the chart through the " + band.name + " filter"});
  row.panels.push_back({"Prediction",
                        plain_picture(p.width, p.height, predicted.rgb, predicted.note),
                        "patches as the spectrometer and the fitted illumination predict them"});
  row.panels.push_back({"Photograph - prediction",
                        signed_false_colour(p.width, p.height, difference, 0.1,
                                            "reflectance x relative illumination", "1"),
                        "signed difference inside the patches, zero outside"});
  row.caption = fmt::format(
      "{}: one value a 2 x 2 Bayer cell, {} photosites, nothing interpolated. The prediction is "
      "shown inside the patches only; the six grey ones are inputs of the fit.",
      band.name, band.site);
  return row;
}

std::vector<Block> spectra_figures(const ChartMeasurement& m) {
  std::vector<std::size_t> held_out;
  for (std::size_t p = 0; p < m.chart.patches.size(); ++p)
    if (!m.bands.empty() && !m.bands[0].readings.empty() && !m.bands[0].readings[p].standard)
      held_out.push_back(p);
  std::vector<Block> blocks;
  constexpr std::size_t kEach = 3;
  for (std::size_t first = 0; first < held_out.size(); first += kEach) {
    LinePlot plot{
        "", {"wavelength", "nm", false, ValueRange{380.0, 720.0}}, {"reflectance", "1"}, {}};
    std::string names;
    for (std::size_t k = first; k < std::min(first + kEach, held_out.size()); ++k) {
      const std::size_t p = held_out[k];
      const std::string& name = m.chart.patches[p];
      names += (names.empty() ? "" : ", ") + name;
      PlotSeries curve{name + ", spectrometer", {}, {}};
      for (double nm = 380.0; nm <= 720.0; nm += 2.0) {
        curve.x.push_back(nm);
        curve.y.push_back(m.chart.reflectance[p].at(nm));
      }
      PlotSeries points{name + ", photograph", {}, {}};
      points.line = false;
      points.markers = true;
      for (const BandMeasurement& band : m.bands) {
        if (band.readings.empty() || band.readings[p].at_bound) continue;
        points.x.push_back(band.band.centre_nm.value);
        points.y.push_back(band.readings[p].measured.value);
        points.u_y.push_back(2.0 * band.readings[p].measured.standard_uncertainty);
        points.half_width_x.push_back(5.0);
      }
      plot.series.push_back(std::move(curve));
      plot.series.push_back(std::move(points));
    }
    plot.title = names;
    blocks.push_back(
        Figure{names, to_svg(plot),
               "Curves: spectrometer. Points: fitted from the photographs, bars U = 2 u; "
               "horizontal bars: the filters' 10 nm pass band."});
  }
  return blocks;
}

Paragraph plan_text(const Requirements& plan) {
  std::string text = "What the chart requires:";
  for (const std::string& reason : plan.reasons) text += " " + reason + ".";
  return {text};
}

Paragraph instrument_text(const ChartMeasurement& m) {
  const InstrumentEstimate& i = m.instrument;
  return {fmt::format(
      "Camera: {}. Seven exposures a filter, dark frames subtracted, merged by minimum variance. "
      "Noise from the photographs themselves: variance = {:.3g} DN^2 + {:.3g} DN x signal. "
      "Response: "
      "offset {:.2f} +- {:.2f} DN, curvature ({:.3g} +- {:.1g}) per DN.",
      m.file.instrument.camera, i.noise.floor_dn2, i.noise.gain_dn,
      i.response.response.offset_dn.value, i.response.response.offset_dn.standard_uncertainty,
      i.response.response.curvature_per_dn.value,
      i.response.response.curvature_per_dn.standard_uncertainty)};
}

}  // namespace

ReportPart chart_report(const ChartMeasurement& m, const Requirements& plan,
                        const std::filesystem::path& colour_dir) {
  ReportPart report;
  report.checks = make_checks(m);
  const ColourPipeline colour;

  Section overview{"The chart: photograph, prediction, difference", {}};
  const ChartColour chart_colour(m, colour_dir);
  overview.blocks.push_back(plan_text(plan));
  overview.blocks.push_back(instrument_text(m));
  overview.blocks.push_back(chart_colour.pictures(colour));
  overview.blocks.push_back(band_table(m));
  overview.blocks.push_back(Paragraph{"All held-out readings: " + m.missing().in_words()});
  overview.blocks.push_back(score_table(m));
  for (const BandMeasurement& band : m.bands)
    if (!band.note.empty()) overview.blocks.push_back(Paragraph{band.name + ": " + band.note});

  Section bands{"Band by band", {}};
  for (const BandMeasurement& band : m.bands) bands.blocks.push_back(band_pictures(band, colour));
  Section values{"Fitted against certified values", {}};
  for (const BandMeasurement& band : m.bands) values.blocks.push_back(readings_table(band));
  Section colours{"Colour of the patches", {chart_colour.table()}};
  report.sections = {std::move(overview),
                     std::move(bands),
                     {"Spectra", spectra_figures(m)},
                     std::move(values),
                     std::move(colours)};

  const WorstReading worst = worst_reading(m);
  report.sentence = fmt::format("{} of {} chart readings agree with the spectrometer (k = 2)",
                                m.agreeing(), m.held_out());
  if (worst.reading)
    report.sentence +=
        fmt::format("; farthest off is {} at {}: {:.3f} against {:.3f}, E_n = {:.2f}",
                    worst.reading->patch, worst.band, worst.reading->measured.value,
                    worst.reading->reference.value, worst.reading->en.value);
  report.provenance = {{"Photographs", m.file.provenance.source},
                       {"Licence of the photographs", m.file.provenance.licence},
                       {"Chart reflectances", m.chart.provenance.source},
                       {"Uncertainty of the reflectances", m.chart.provenance.uncertainty},
                       {"Colour", colour.description()}};
  return report;
}

}  // namespace truebox::app
