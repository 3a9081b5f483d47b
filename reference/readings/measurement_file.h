// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "image/bayer.h"
#include "provenance/provenance.h"

namespace truebox {

/// The camera. An empty gain or read noise is to be estimated from the frames.
struct Instrument {
  std::string camera;
  int bits = 8;
  BayerPattern bayer;
  double saturation_dn = 0.0;           ///< readings at or above it are not used
  double floor_dn = 0.0;                ///< readings below it are not used
  std::optional<double> gain_dn;        ///< variance per signal, DN
  std::optional<double> read_noise_dn;  ///< standard deviation, quantisation excluded
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
};

/// Reads and checks a measurement file; the files that it names are not opened, but must exist.
/// InputError names file and line, what was expected and what stands there; unknown keys are
/// errors.
MeasurementFile read_measurement(const std::filesystem::path& path);

}  // namespace truebox
