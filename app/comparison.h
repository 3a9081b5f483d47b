// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "colour/colour_pipeline.h"
#include "colour/scene_linear.h"
#include "difference/limits.h"
#include "difference/perceptual.h"
#include "difference/regions.h"
#include "difference/significance.h"
#include "document/report.h"

namespace CLI {
class App;
}

namespace truebox::app {

/// What `compare` is asked; a suite file asks the same for each of its entries.
struct ComparisonArguments {
  std::string test, reference;
  std::string test_channels, reference_channels;  ///< maps, see image/channel_map.h
  std::optional<double> warn, fail;
  double outliers = 0.0;
  bool relative = false, percent = false, sigmas = false;
  std::vector<std::string> limits;  ///< "quantity:warn:fail[:outliers]"

  std::string test_uncertainty, reference_uncertainty, test_variance, reference_variance;
  std::string error_bound;
  double calibration = 0.0, test_samples = 0.0, reference_samples = 0.0;
  bool statistical = false;
  double coverage_factor = 2.0, level = 0.01;

  std::optional<double> band_nm;
  std::string mask, regions, region_names;
  std::vector<std::string> region_masks;  ///< "name=file"

  std::string observer = "1931", display, view;
  std::optional<double> exposure_stops;
  double white_cd_m2 = ViewingConditions{}.white_cd_m2;
  double pixels_per_degree = kDefaultPixelsPerDegree;
  bool no_perceptual = false;
};

/// Adds the options of one comparison. The caller runs `check` once they are parsed; it throws
/// CLI::ValidationError.
void add_comparison_options(CLI::App& command, ComparisonArguments& arguments);
void check_comparison(const ComparisonArguments& arguments);

/// The colours of both sides, at one exposure.
struct ComparedColours {
  SceneLinear test, reference;
  double exposure = 1.0;
};

/// Everything the two files say about one another.
struct Comparison {
  DifferenceMap map;
  DifferenceStatistics statistics;
  std::vector<LimitResult> limits;
  std::optional<Significance> significance;  ///< where an uncertainty is known
  bool significance_judges = false;
  std::vector<MetricMap> metrics;
  std::vector<RegionDifference> regions;
  std::size_t region_count = 0;
  std::optional<ComparedColours> colours;
  std::optional<ImageSet> image_set;  ///< of all bands
  std::vector<std::string> left_out;  ///< what could not be computed, and why
};

/// Throws InputError and MismatchError.
Comparison compare(const ComparisonArguments& arguments);

/// `thumbnails` gets small pictures of the reference and the difference if it is not null.
Report comparison_report(const ComparisonArguments& arguments, const Comparison& comparison,
                         std::vector<Panel>* thumbnails = nullptr);

/// The verdict's checks and sentence, in `comparison_verdict.cpp`.
std::vector<Check> comparison_checks(const Comparison& comparison);
std::string comparison_sentence(const Comparison& comparison);

/// "pixel (3, 4), S0.552nm"; "0.05 W m^-2".
std::string place(const SamplePosition& at);
std::string with_unit(double value, const std::string& unit);

/// The tables of a report and of the terminal, in `comparison_tables.cpp`.
Table statistics_table(const Comparison& comparison);
std::vector<Table> comparison_tables(const Comparison& comparison);

}  // namespace truebox::app
