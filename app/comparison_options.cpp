// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>

#include "comparison.h"

namespace truebox::app {
namespace {

void add_limit_options(CLI::App& command, ComparisonArguments& a) {
  const char* group = "Limits";
  command.add_option("--warn", a.warn, "warn where a pixel differs by more (default: as --fail)")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  command
      .add_option("--fail", a.fail,
                  "fail where a pixel differs by more (default: as --warn, else 0)")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  auto* relative =
      command.add_flag("--relative", a.relative, "limits are fractions of the reference")
          ->group(group);
  auto* percent =
      command.add_flag("--percent", a.percent, "limits are percentages of the reference")
          ->excludes(relative)
          ->group(group);
  command.add_flag("--sigmas", a.sigmas, "limits are in standard uncertainties")
      ->excludes(relative)
      ->excludes(percent)
      ->group(group);
  command
      .add_option("--outliers", a.outliers, "fraction of the pixels that may lie beyond a limit")
      ->check(CLI::Range(0.0, 1.0))
      ->group(group);
  command
      .add_option("--limit", a.limits,
                  "QUANTITY:WARN:FAIL[:OUTLIERS], repeatable; of each pixel: absolute, relative, "
                  "percent, sigmas, ciede2000, itp, flip, hdr-flip, dssim, angle; of the whole: "
                  "bias, mae, rmse, relative-bias, relative-mae, relative-rmse, relmse, smape, "
                  "flip-mean and the like")
      ->allow_extra_args(false)
      ->group(group);
}

void add_uncertainty_options(CLI::App& command, ComparisonArguments& a) {
  const char* group = "Uncertainties";
  const auto image = [&](const char* name, std::string& path, const char* text) {
    return command.add_option(name, path, text)->group(group);
  };
  auto* test_u = image("--uncertainty", a.test_uncertainty,
                       "standard uncertainty of TEST, pixel by pixel, an image");
  auto* reference_u = image("--reference-stderr", a.reference_uncertainty,
                            "standard uncertainty of REFERENCE, an image");
  image("--error-bound", a.error_bound,
        "bound on the error of TEST, an image (u = bound / sqrt 3)");
  image("--variance", a.test_variance, "variance of the samples of TEST, an image")
      ->excludes(test_u);
  image("--reference-variance", a.reference_variance, "variance of the samples of REFERENCE")
      ->excludes(reference_u);
  command
      .add_option("--samples", a.test_samples, "independent samples a pixel of TEST: Welch test")
      ->check(CLI::Range(2.0, 1e12))
      ->group(group);
  command.add_option("--reference-samples", a.reference_samples, "likewise of REFERENCE")
      ->check(CLI::Range(2.0, 1e12))
      ->group(group);
  command
      .add_option("--calibration", a.calibration,
                  "relative standard uncertainty of the scale that all pixels share")
      ->check(CLI::Range(0.0, 10.0))
      ->group(group);
  command
      .add_flag("--statistical", a.statistical,
                "judge by chance: fails if more pixels stand out than noise explains")
      ->group(group);
  command.add_option("--k", a.coverage_factor, "coverage factor beyond which a pixel stands out")
      ->check(CLI::Range(0.5, 10.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--level", a.level, "how often images that agree may fail")
      ->check(CLI::Range(1e-9, 0.5))
      ->capture_default_str()
      ->group(group);
}

void add_part_options(CLI::App& command, ComparisonArguments& a) {
  const char* group = "What is compared";
  command
      .add_option("--test-channels", a.test_channels,
                  "channels of TEST by another program: NAME=CHANNEL[*FACTOR],...; {nm} stands for "
                  "a wavelength, as in 'S0.{nm}nm=band_{nm}nm'")
      ->group(group);
  command.add_option("--reference-channels", a.reference_channels, "likewise of REFERENCE")
      ->group(group);
  command.add_option("--band", a.band_nm, "compare only the band nearest to this wavelength, nm")
      ->group(group);
  command.add_option("--mask", a.mask, "image of one channel; pixels where it is 0 do not count")
      ->group(group);
  auto* regions = command.add_option(
      "--regions", a.regions, "image of one channel, a whole number for each surface, 0 for none");
  regions->group(group);
  command.add_option("--region-names", a.region_names, "table with the columns id and name")
      ->needs(regions)
      ->group(group);
  command.add_option("--region", a.region_masks, "NAME=MASK, repeatable: a surface by its mask")
      ->allow_extra_args(false)
      ->group(group);
}

void add_colour_options(CLI::App& command, ComparisonArguments& a) {
  const char* group = "Colour";
  command.add_option("--observer", a.observer, "of spectral images")
      ->check(CLI::IsMember({"1931", "1964", "2015-2", "2015-10"}))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--exposure", a.exposure_stops,
                  "in stops, for both sides (default: 95 % of the reference below white)")
      ->check(CLI::Range(-100.0, 100.0))
      ->group(group);
  command.add_option("--display", a.display, "display of the OpenColorIO config")->group(group);
  command.add_option("--view", a.view, "view of the OpenColorIO config")->group(group);
  command
      .add_option("--white", a.white_cd_m2, "luminance of the display's white, cd m^-2 (dE ITP)")
      ->check(CLI::Range(1.0, 10000.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--pixels-per-degree", a.pixels_per_degree, "of the viewer (FLIP)")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str()
      ->group(group);
  command.add_flag("--no-perceptual", a.no_perceptual, "without colour differences, FLIP and SSIM")
      ->group(group);
}

}  // namespace

void add_comparison_options(CLI::App& command, ComparisonArguments& a) {
  command.add_option("TEST,--test", a.test, "the image to be judged")->required();
  command.add_option("REFERENCE,--reference", a.reference, "the image to judge it by")->required();
  add_limit_options(command, a);
  add_uncertainty_options(command, a);
  add_part_options(command, a);
  add_colour_options(command, a);
}

void check_comparison(const ComparisonArguments& a) {
  const bool uncertain = !a.test_uncertainty.empty() || !a.reference_uncertainty.empty() ||
                         !a.test_variance.empty() || !a.reference_variance.empty() ||
                         !a.error_bound.empty() || a.calibration > 0.0;
  if ((a.sigmas || a.statistical) && !uncertain)
    throw CLI::ValidationError(a.sigmas ? "--sigmas" : "--statistical",
                               "needs --uncertainty, --reference-stderr or another uncertainty");
  if (a.warn && a.fail && *a.warn > *a.fail)
    throw CLI::ValidationError("--warn", "must not exceed --fail");
  if (!a.test_variance.empty() && a.test_samples == 0.0)
    throw CLI::ValidationError("--variance", "needs --samples");
  if (!a.reference_variance.empty() && a.reference_samples == 0.0)
    throw CLI::ValidationError("--reference-variance", "needs --reference-samples");
  for (const std::string& text : a.limits) {
    try {
      parse_limit(text);
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError("--limit", error.what());
    }
  }
  for (const std::string& text : a.region_masks)
    if (text.find('=') == std::string::npos || text.front() == '=' || text.back() == '=')
      throw CLI::ValidationError("--region", "write NAME=MASK, not '" + text + "'");
}

}  // namespace truebox::app
