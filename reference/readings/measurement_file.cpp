// SPDX-License-Identifier: BSD-3-Clause
#include "readings/measurement_file.h"

#include <algorithm>

#include "radiometry/input_error.h"
#include "readings/toml_reader.h"

namespace truebox {
namespace {

using detail::TomlTable;

constexpr double kMaxExposure_s = 1e5;

/// A number, or "estimate".
std::optional<double> number_or_estimate(TomlTable& table, const std::string& key) {
  if (!table.is_text(key)) return table.number(key, 0.0, 1e6);
  if (table.text(key) != "estimate")
    table.fail(key, "a number or \"estimate\"", "\"" + table.text(key) + "\"");
  return std::nullopt;
}

std::string one_of(TomlTable& table, const std::string& key, const std::string& fallback,
                   const std::vector<std::string>& choices) {
  const std::string value = table.text_or(key, fallback);
  if (std::find(choices.begin(), choices.end(), value) != choices.end()) return value;
  std::string expected;
  for (const auto& choice : choices) expected += (expected.empty() ? "\"" : ", \"") + choice + "\"";
  table.fail(key, expected, "\"" + value + "\"");
}

Region read_region(TomlTable& table, const std::string& key) {
  const std::vector<int> r = table.integers(key, 0, 1 << 20);
  if (r.size() != 4 || r[2] < 1 || r[3] < 1)
    table.fail(key, "[left, top, width, height] in px", std::to_string(r.size()) + " numbers");
  return {r[0], r[1], r[2], r[3]};
}

Instrument read_instrument(TomlTable table) {
  Instrument instrument;
  instrument.camera = table.text_or("camera", "");
  instrument.bits = table.integer("bits", 1, 32);
  const std::string pattern = table.text("bayer");
  instrument.mosaic = pattern != "none";
  try {
    if (instrument.mosaic) instrument.bayer = BayerPattern(pattern);
  } catch (const std::invalid_argument& error) {
    table.fail("bayer", "rggb, bggr, grbg, gbrg or none", "\"" + pattern + "\"");
  }
  const double full_scale = static_cast<double>((std::int64_t{1} << instrument.bits) - 1);
  instrument.step_dn = table.number_or("step_dn", 1.0, 0.0, 1e6);
  const double least = instrument.step_dn > 0.0 ? 1.0 : 0.0;  // floating point may end at 1
  instrument.saturation_dn = table.number("saturation_dn", least, full_scale);
  instrument.floor_dn = table.number_or("floor_dn", 0.0, 0.0, instrument.saturation_dn);
  if (table.has("gain")) instrument.gain_dn = number_or_estimate(table, "gain");
  if (table.has("read_noise")) instrument.read_noise_dn = number_or_estimate(table, "read_noise");
  instrument.response =
      one_of(table, "response", "fitted", {"fitted", "linear", "debevec", "robertson"});
  if ((instrument.response == "debevec" || instrument.response == "robertson") &&
      (instrument.bits != 8 || instrument.mosaic))
    table.fail("response",
               "\"fitted\" or \"linear\" (curves are recovered from 8-bit files without "
               "a mosaic only)",
               "\"" + instrument.response + "\"");
  instrument.exposure_uncertainty = table.number_or("exposure_uncertainty", 0.0, 0.0, 1.0);
  table.finish();
  return instrument;
}

ChartFiles read_chart_files(TomlTable table) {
  ChartFiles chart;
  if (table.has("scene")) chart.scene_path = table.existing_file("scene");
  chart.labels_path = table.existing_file("labels");
  chart.reflectance_path = table.existing_file("reflectance");
  chart.patches = table.texts("patches");
  if (chart.patches.size() > 255) table.fail("patches", "at most 255 names", "more");
  chart.margin_px = table.has("margin_px") ? table.integer("margin_px", 0, 100) : 0;
  table.finish();
  return chart;
}

KnownStandards read_known(TomlTable table, const ChartFiles& chart) {
  KnownStandards known;
  known.patches = table.texts("standards");
  for (const auto& name : known.patches)
    if (std::find(chart.patches.begin(), chart.patches.end(), name) == chart.patches.end())
      table.fail("standards", "names of chart patches", "\"" + name + "\"");
  known.relative_uncertainty = table.number("relative_uncertainty", 0.0, 1.0);
  known.absolute_uncertainty = table.number("absolute_uncertainty", 0.0, 1.0);
  if (!(known.relative_uncertainty + known.absolute_uncertainty > 0.0))
    table.fail("relative_uncertainty", "a standard uncertainty above 0", "0");
  known.centre_uncertainty_nm = table.number_or("centre_uncertainty_nm", 0.0, 0.0, 100.0);
  table.finish();
  return known;
}

FitChoices read_fit(TomlTable table) {
  FitChoices fit;
  if (table.has("field_orders")) fit.field_orders = table.integers("field_orders", 0, 6);
  if (table.has("block_px")) fit.block_px = table.integer("block_px", 2, 64);
  fit.block_uncertainty = table.number_or("block_uncertainty", fit.block_uncertainty, 1e-6, 1.0);
  fit.veil_threshold = table.number_or("veil_threshold", fit.veil_threshold, 0.0, 1e9);
  table.finish();
  return fit;
}

FlatFiles read_flat(TomlTable table) {
  FlatFiles flat;
  flat.paths = table.existing_files("files");
  flat.exposure_s = table.number("exposure_s", 1e-9, kMaxExposure_s);
  flat.model = one_of(table, "model", "frames", {"frames", "polynomial", "cos4"});
  flat.uncertainty = table.number("uncertainty", 0.0, 1.0);
  table.finish();
  return flat;
}

AbsoluteScale read_scale(TomlTable table, const ChartFiles& chart) {
  AbsoluteScale scale;
  scale.band = table.text_or("band", "");
  scale.patch = table.text_or("patch", "");
  if (scale.patch.empty()) {
    scale.region = read_region(table, "region");
  } else if (std::find(chart.patches.begin(), chart.patches.end(), scale.patch) ==
             chart.patches.end()) {
    table.fail("patch", "the name of a chart patch", "\"" + scale.patch + "\"");
  }
  scale.value.value = table.number("value", 1e-30, 1e30);
  scale.value.standard_uncertainty = table.number("uncertainty", 0.0, 1e30);
  scale.unit = table.text("unit");
  table.finish();
  return scale;
}

BandFiles read_band(TomlTable table, bool for_chart) {
  BandFiles band;
  band.name = table.text("name");
  band.line = table.line();
  if (for_chart || table.has("site")) {
    const std::string site = table.text("site");
    if (site != "R" && site != "G" && site != "B")
      table.fail("site", "\"R\", \"G\" or \"B\"", "\"" + site + "\"");
    band.site = site[0];
  }
  if (for_chart || table.has("transmission")) {
    TomlTable transmission = table.table("transmission");
    band.transmission_path = transmission.existing_file("file");
    band.transmission_column = transmission.text("column");
    transmission.finish();
  }
  band.note = table.text_or("note", "");
  if (for_chart || table.has("stated_centre_nm"))
    band.stated_centre_nm = table.number("stated_centre_nm", 1.0, 1e6);
  for (TomlTable& frame : table.tables("photographs")) {
    FrameFile file;
    file.path = frame.existing_file("file");
    file.exposure_s = frame.number("exposure_s", 1e-9, kMaxExposure_s);
    frame.finish();
    band.photographs.push_back(std::move(file));
  }
  table.finish();
  return band;
}

}  // namespace

MeasurementFile read_measurement(const std::filesystem::path& path) {
  TomlTable root = TomlTable::parse(path);
  MeasurementFile measurement;
  measurement.path = path.string();
  measurement.title = root.text("title");
  measurement.provenance = {.source = root.text("source"),
                            .licence = root.text_or("licence", ""),
                            .unit = "DN",
                            .uncertainty = "estimated from the frames",
                            .use = Use::input};
  measurement.instrument = read_instrument(root.table("instrument"));
  const bool for_chart = root.has("chart");
  if (for_chart) {
    measurement.chart = read_chart_files(root.table("chart"));
    measurement.known = read_known(root.table("known"), measurement.chart);
  }
  if (root.has("fit")) measurement.fit = read_fit(root.table("fit"));
  if (root.has("dark"))
    for (TomlTable& table : root.tables("dark")) {
      DarkFiles dark;
      dark.exposure_s = table.number("exposure_s", 1e-9, kMaxExposure_s);
      dark.paths = table.existing_files("files");
      table.finish();
      measurement.darks.push_back(std::move(dark));
    }
  for (TomlTable& table : root.tables("bands"))
    measurement.bands.push_back(read_band(std::move(table), for_chart));
  for (std::size_t b = 0; b < measurement.bands.size(); ++b)
    for (std::size_t other = 0; other < b; ++other)
      if (measurement.bands[b].name == measurement.bands[other].name)
        throw InputError(measurement.path, measurement.bands[b].line, "bands of different names",
                         "\"" + measurement.bands[b].name + "\" again");
  if (root.has("flat")) measurement.flat = read_flat(root.table("flat"));
  if (root.has("defects")) {
    TomlTable defects = root.table("defects");
    measurement.defect_mask = defects.existing_file("mask");
    defects.finish();
  }
  if (root.has("glare")) {
    TomlTable glare = root.table("glare");
    measurement.glare.region = read_region(glare, "region");
    measurement.glare.uncertainty =
        glare.number_or("uncertainty", measurement.glare.uncertainty, 0.0, 10.0);
    glare.finish();
  }
  if (root.has("scale"))
    for (TomlTable& table : root.tables("scale"))
      measurement.scales.push_back(read_scale(std::move(table), measurement.chart));
  root.finish();
  return measurement;
}

}  // namespace truebox
