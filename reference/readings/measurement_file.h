// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "image/bayer.h"
#include "provenance/provenance.h"
#include "radiometry/estimate.h"

namespace truebox {

/// The camera. An empty gain or read noise is to be estimated from the frames.
struct Instrument {
  std::string camera;
  int bits = 8;
  BayerPattern bayer;
  bool mosaic = true;                   ///< false: bayer = "none", every photosite sees alike
  double saturation_dn = 0.0;           ///< readings at or above it are not used
  double floor_dn = 0.0;                ///< readings below it are not used
  std::optional<double> gain_dn;        ///< variance per signal, DN
  std::optional<double> read_noise_dn;  ///< standard deviation, quantisation excluded
  double step_dn = 1.0;                 ///< between two readings; 0 for floating point
  std::string response = "fitted";      ///< or "linear", "debevec", "robertson"
  double exposure_uncertainty = 0.0;    ///< relative, of the exposure times, common to all
};

/// A rectangle of pixels: left, top, width, height.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
};

/// How evenly sensor and lens answer: frames of an even field, or a law fitted to them.
struct FlatFiles {
  std::vector<std::string> paths;  ///< empty: no flat field
  double exposure_s = 0.0;
  std::string model = "frames";  ///< or "polynomial" (1 + a r^2 + b r^4 + c r^6), "cos4"
  double uncertainty = 0.0;      ///< relative, of the even field itself, common to all pixels
};

/// A target that sends no light of its own: what is seen there is veiling glare.
struct GlareTarget {
  Region region;               ///< width 0: none
  double uncertainty = 0.577;  ///< relative; 1 / sqrt(3): anything from none to twice as much
};

/// What links the signal of a region to a quantity with a unit.
struct AbsoluteScale {
  std::string band;   ///< empty: every band
  Region region;      ///< width 0: `patch` says where
  std::string patch;  ///< of the chart
  Estimate value;
  std::string unit;  ///< "cd m^-2"
};

struct FrameFile {
  std::string path;
  double exposure_s = 0.0;
};

struct DarkFiles {
  double exposure_s = 0.0;
  std::vector<std::string> paths;
};

/// One spectral band: its filter, the photosites that see it best, its exposures.
struct BandFiles {
  std::string name;               ///< "450 nm"
  char site = 'G';                ///< 'R', 'G' or 'B'
  std::string transmission_path;  ///< table of the filter's measured transmission
  std::string transmission_column;
  double stated_centre_nm = 0.0;  ///< the maker's
  std::string note;               ///< why this site, for the report; may be empty
  int line = 0;                   ///< in the measurement file
  std::vector<FrameFile> photographs;
};

struct ChartFiles {
  std::string scene_path;  ///< may be empty
  std::string labels_path;
  std::string reflectance_path;
  std::vector<std::string> patches;
  int margin_px = 0;
};

/// What is taken as known: standards with their standard uncertainty (k = 1).
struct KnownStandards {
  std::vector<std::string> patches;
  double relative_uncertainty = 0.0;
  double absolute_uncertainty = 0.0;
  double centre_uncertainty_nm = 0.0;
};

/// What is fitted, and how. See calibration/README.md.
struct FitChoices {
  std::vector<int> field_orders = {2, 3};
  int block_px = 6;
  double block_uncertainty = 0.004;
  double veil_threshold = 3.0;
};

/// A measurement as its author wrote it down (TOML). Paths are resolved against the file.
struct MeasurementFile {
  std::string path;
  std::string title;
  Provenance provenance;
  Instrument instrument;
  ChartFiles chart;
  KnownStandards known;
  FitChoices fit;
  std::vector<DarkFiles> darks;
  std::vector<BandFiles> bands;
  FlatFiles flat;
  std::string defect_mask;  ///< path of an image, nonzero where a photosite is not to be used
  GlareTarget glare;
  std::vector<AbsoluteScale> scales;

  bool has_chart() const { return !chart.patches.empty(); }
};

/// Reads and checks a measurement file. With [chart], bands must say what a fit of reflectances
/// needs (site, transmission, centre) and [known] must be there; without, photographs are enough.
/// The files that it names are not opened, but must exist.
/// InputError names file and line, what was expected and what stands there; unknown keys are
/// errors.
MeasurementFile read_measurement(const std::filesystem::path& path);

}  // namespace truebox
