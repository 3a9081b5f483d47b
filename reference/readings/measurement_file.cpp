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

Instrument read_instrument(TomlTable table) {
  Instrument instrument;
  instrument.camera = table.text_or("camera", "");
  instrument.bits = table.integer("bits", 1, 32);
  try {
    instrument.bayer = BayerPattern(table.text("bayer"));
  } catch (const std::invalid_argument& error) {
    table.fail("bayer", "rggb, bggr, grbg or gbrg", "\"" + table.text("bayer") + "\"");
  }
  const double full_scale = static_cast<double>((std::int64_t{1} << instrument.bits) - 1);
  instrument.saturation_dn = table.number("saturation_dn", 1.0, full_scale);
  instrument.floor_dn = table.number_or("floor_dn", 0.0, 0.0, instrument.saturation_dn);
  instrument.gain_dn = number_or_estimate(table, "gain");
  instrument.read_noise_dn = number_or_estimate(table, "read_noise");
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

BandFiles read_band(TomlTable table) {
  BandFiles band;
  band.name = table.text("name");
  const std::string site = table.text("site");
  if (site != "R" && site != "G" && site != "B")
    table.fail("site", "\"R\", \"G\" or \"B\"", "\"" + site + "\"");
  band.site = site[0];
  TomlTable transmission = table.table("transmission");
  band.transmission_path = transmission.existing_file("file");
  band.transmission_column = transmission.text("column");
  transmission.finish();
  band.note = table.text_or("note", "");
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
  measurement.chart = read_chart_files(root.table("chart"));
  measurement.known = read_known(root.table("known"), measurement.chart);
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
    measurement.bands.push_back(read_band(std::move(table)));
  root.finish();
  return measurement;
}

}  // namespace truebox
