// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "acceptance.h"
#include "comparison.h"
#include "figures/colour_map.h"
#include "figures/score_plot.h"
#include "figures/text.h"
#include "image/image_file.h"
#include "version.h"

namespace truebox::app {
namespace {

constexpr int kThumbnail_px = 96;  // longest side

/// The channel that holds the largest difference: the one to look at.
const DifferenceChannel& worst_channel(const Comparison& c) {
  for (const auto& channel : c.map.channels)
    if (channel.name == c.statistics.max_at.channel) return channel;
  return c.map.channels.front();
}

struct ShownDifference {
  std::vector<float> values;
  std::string quantity, unit;
};

ShownDifference shown_difference(const Comparison& c) {
  const DifferenceChannel& worst = worst_channel(c);
  if (!c.significance_judges && (c.limits.empty() || c.limits[0].limit.quantity != "sigmas"))
    return {worst.difference, "test - reference, " + worst.name, c.map.unit};
  std::vector<float> z(worst.difference.size());
  for (std::size_t i = 0; i < z.size(); ++i) z[i] = static_cast<float>(worst.score(i));
  return {std::move(z), "(test - reference) / u, " + worst.name, "1"};
}

/// Mean colour of blocks, the longer side at most `kThumbnail_px`.
Picture thumbnail(int width, int height, const std::vector<std::uint8_t>& rgb) {
  const int step = std::max(1, (std::max(width, height) + kThumbnail_px - 1) / kThumbnail_px);
  const int w = (width + step - 1) / step, h = (height + step - 1) / step;
  std::vector<std::uint8_t> small(3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int c = 0; c < 3; ++c) {
        int sum = 0, count = 0;
        for (int v = y * step; v < std::min(height, (y + 1) * step); ++v)
          for (int u = x * step; u < std::min(width, (x + 1) * step); ++u, ++count)
            sum += rgb[3 * static_cast<std::size_t>(v * width + u) + static_cast<std::size_t>(c)];
        small[3 * static_cast<std::size_t>(y * w + x) + static_cast<std::size_t>(c)] =
            static_cast<std::uint8_t>(sum / std::max(1, count));
      }
  return plain_picture(w, h, small, "");
}

std::vector<std::uint8_t> difference_colours(const ShownDifference& d) {
  const double limit = symmetric_limit(d.values, 0.99);
  std::vector<std::uint8_t> rgb;
  for (const float v : d.values) {
    const Rgb8 colour =
        std::isfinite(v) ? diverging_colour(v / (limit > 0.0 ? limit : 1.0)) : Rgb8{255, 0, 255};
    rgb.insert(rgb.end(), colour.begin(), colour.end());
  }
  return rgb;
}

/// Both sides as a display shows them; without colours, the worst channel in grey.
struct ShownSides {
  DisplayPicture test, reference;
};

ShownSides shown_sides(const ComparisonArguments& a, const Comparison& c) {
  const ColourPipeline pipeline(ViewChoice{a.display, a.view});
  if (c.colours)
    return {pipeline.picture(c.colours->test.rgb, c.colours->exposure),
            pipeline.picture(c.colours->reference.rgb, c.colours->exposure)};
  const DifferenceChannel& worst = worst_channel(c);
  std::vector<float> test = worst.reference;
  for (std::size_t i = 0; i < test.size(); ++i) test[i] += worst.difference[i];
  const double exposure = a.exposure_stops ? std::exp2(*a.exposure_stops)
                                           : exposure_for_quantile(worst.reference, 0.95);
  return {pipeline.grey_picture(c.map.width, c.map.height, test, exposure),
          pipeline.grey_picture(c.map.width, c.map.height, worst.reference, exposure)};
}

PictureRow main_pictures(const Comparison& c, const ShownSides& sides) {
  const int w = c.map.width, h = c.map.height;
  const ShownDifference d = shown_difference(c);
  PictureRow row = {
      {{"Reference", plain_picture(w, h, sides.reference.rgb, sides.reference.note),
        "The reference image"},
       {"Test", plain_picture(w, h, sides.test.rgb, sides.test.note),
        "The test image, with the same exposure"},
       {"Signed difference",
        signed_false_colour(w, h, d.values, symmetric_limit(d.values, 0.99), d.quantity, d.unit),
        "Difference by pixel: " + comparison_sentence(c)}},
      "Grey: no difference. Red: the test is brighter. Blue: it is darker. The scale ends at "
      "the 99th percentile of the channel with the largest difference.",
      {}};
  row.image_set = c.image_set;
  return row;
}

std::optional<PictureRow> flagged_pictures(const ShownSides& sides) {
  const auto flagged = [](const DisplayPicture& p) {
    return p.clipped_pixels + p.out_of_gamut_pixels + p.not_finite_pixels > 0;
  };
  if (!flagged(sides.test) && !flagged(sides.reference)) return std::nullopt;
  PictureRow row;
  for (const auto& [name, p] :
       {std::pair{"Reference", &sides.reference}, std::pair{"Test", &sides.test}})
    row.panels.push_back(
        {fmt::format("{}: what is not shown as it is", name),
         plain_picture(p->width, p->height, flagged_picture(*p), p->note),
         fmt::format("{} pixels clipped, {} out of gamut, {} not finite", p->clipped_pixels,
                     p->out_of_gamut_pixels, p->not_finite_pixels)});
  row.caption =
      "Red: brighter than the display's white. Blue: a colour the display does not have. Violet: "
      "both. Magenta: not a number. The numbers of this report are not clipped.";
  return row;
}

/// The maps of two metrics a viewer's eye is modelled by, with their scales.
std::optional<PictureRow> metric_pictures(const Comparison& c) {
  PictureRow row;
  for (const MetricMap& map : c.metrics) {
    if (map.name != "flip" && map.name != "hdr-flip" && map.name != "ciede2000" &&
        map.name != "angle")
      continue;
    ValueRange range = value_range(map.values, 0.01);
    range.low = 0.0;
    if (map.name.ends_with("flip")) range.high = 1.0;
    if (!(range.high > 0.0)) range.high = 1.0;
    row.panels.push_back(
        {map.title, false_colour(map.width, map.height, map.values, range, map.title, map.unit),
         map.title + " by pixel"});
  }
  if (row.panels.empty()) return std::nullopt;
  row.caption =
      "Dark: no visible difference. FLIP is between 0 and 1; the other scales end at the "
      "99th percentile.";
  return row;
}

Figure z_figure(const Comparison& c) {
  std::vector<double> z;
  for (const auto& channel : c.map.channels)
    for (std::size_t i = 0; i < channel.difference.size(); ++i)
      if (c.map.counts(i)) z.push_back(channel.score(i));
  return {"Differences in units of their uncertainty",
          z_histogram_svg("Histogram of the differences in sigmas", z),
          "Narrower than the line: uncertainties stated too large. Wider or shifted: something is "
          "not accounted for."};
}

void add_key_numbers(const Comparison& c, Report& report) {
  if (!c.limits.empty() && c.limits[0].of_pixels) {
    const LimitResult& r = c.limits[0];
    report.key_numbers.push_back({"Largest difference", r.measured, r.unit, 3, place(r.at)});
    report.key_numbers.push_back({"Pixels over the fail limit", static_cast<double>(r.beyond_fail),
                                  "px", 3, fmt::format("of {}", r.pixels)});
  }
  if (c.significance && c.significance_judges) {
    const Significance& s = *c.significance;
    report.key_numbers.push_back(
        {"Pixels that stand out",
         100.0 * static_cast<double>(s.beyond) / static_cast<double>(s.pixels), "%", 3,
         fmt::format("k = {:g}; {:.3g} % expected", s.options.coverage_factor,
                     100.0 * s.beyond_expected / static_cast<double>(s.pixels))});
    report.key_numbers.push_back({"Root mean square z", s.rms_z, "", 3, "1 expected"});
  }
  report.key_numbers.push_back(
      {"Root mean square", c.statistics.rms, c.map.unit, 3, "all channels"});
  report.key_numbers.push_back(
      {"Relative bias", 100.0 * c.statistics.relative_bias, "%", 3, "test - reference"});
  for (const MetricMap& map : c.metrics)
    if (map.name == "flip")
      report.key_numbers.push_back(
          {"FLIP, mean", metric_summary(map, c.map.mask).mean, "", 3, "0 to 1"});
}

std::string uncertainty_text(const ComparisonArguments& a) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  if (!a.test_uncertainty.empty()) add("prediction: u from " + a.test_uncertainty);
  if (!a.test_variance.empty())
    add(fmt::format("prediction: variance from {}, {:g} samples", a.test_variance, a.test_samples));
  if (!a.error_bound.empty()) add("prediction: bound / sqrt 3 from " + a.error_bound);
  if (!a.reference_uncertainty.empty()) add("measurement: u from " + a.reference_uncertainty);
  if (!a.reference_variance.empty())
    add(fmt::format("measurement: variance from {}, {:g} samples", a.reference_variance,
                    a.reference_samples));
  for (const auto& [side, samples] :
       {std::pair{"prediction", a.test_samples}, std::pair{"measurement", a.reference_samples}})
    if (samples > 0.0) add(fmt::format("{}: Student's t of {:g} samples", side, samples));
  if (a.calibration > 0.0)
    add(fmt::format("calibration: {:g} % of the scale, shared by all pixels",
                    100.0 * a.calibration));
  return text;
}

void add_provenance(const ComparisonArguments& a, const Comparison& c, const ShownSides& sides,
                    Report& report) {
  report.provenance = {{"Program", std::string("truebox ") + kVersion},
                       {"Test", a.test},
                       {"Reference", a.reference}};
  if (const std::string why = acceptance_text(a.reference); !why.empty())
    report.provenance.push_back({"Reference accepted", why});
  for (const LimitResult& r : c.limits)
    report.provenance.push_back(
        {"Limit on " + r.limit.quantity,
         fmt::format("warn {}, fail {}, {:g} % of the pixels may lie beyond",
                     with_unit(r.limit.warn, r.unit), with_unit(r.limit.fail, r.unit),
                     100.0 * r.limit.allowed_fraction)});
  if (const std::string text = uncertainty_text(a); !text.empty())
    report.provenance.push_back({"Uncertainties", text});
  if (!a.mask.empty())
    report.provenance.push_back(
        {"Mask", fmt::format("{}, {} pixels count", a.mask, c.map.pixel_count())});
  if (c.colours) report.provenance.push_back({"Colours from", c.colours->reference.origin});
  report.provenance.push_back({"Colour", sides.reference.description});
  if (c.colours && !a.no_perceptual)
    report.provenance.push_back({"Viewer", fmt::format("white {:g} cd m^-2, {:.4g} pixels a degree",
                                                       a.white_cd_m2, a.pixels_per_degree)});
  for (const std::string& text : c.left_out) report.provenance.push_back({"Left out", text});
}

}  // namespace

Report comparison_report(const ComparisonArguments& a, const Comparison& c,
                         std::vector<Panel>* thumbnails) {
  Report report;
  report.title = fmt::format("{} against {}", std::filesystem::path(a.test).filename().string(),
                             std::filesystem::path(a.reference).filename().string());
  report.subtitle = fmt::format("{} x {} px, {} channels compared", c.map.width, c.map.height,
                                c.map.channels.size());
  report.checks = comparison_checks(c);
  report.verdict = {worst_outcome(report.checks), comparison_sentence(c)};
  add_key_numbers(c, report);
  const ShownSides sides = shown_sides(a, c);
  Section pictures{"Pictures", {main_pictures(c, sides)}};
  if (auto row = flagged_pictures(sides)) pictures.blocks.push_back(std::move(*row));
  if (auto row = metric_pictures(c)) pictures.blocks.push_back(std::move(*row));
  Section numbers{"Numbers", {}};
  for (Table& table : comparison_tables(c)) numbers.blocks.push_back(std::move(table));
  if (c.significance) numbers.blocks.push_back(z_figure(c));
  report.sections = {std::move(pictures), std::move(numbers)};
  add_provenance(a, c, sides, report);
  if (thumbnails != nullptr) {
    *thumbnails = {
        {"Reference", thumbnail(c.map.width, c.map.height, sides.reference.rgb),
         "The reference image, small"},
        {"Test", thumbnail(c.map.width, c.map.height, sides.test.rgb), "The test image, small"},
        {"Difference",
         thumbnail(c.map.width, c.map.height, difference_colours(shown_difference(c))),
         "The signed difference, small: red is brighter, blue darker"}};
  }
  return report;
}

}  // namespace truebox::app
