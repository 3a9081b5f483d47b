// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "colour/colour_pipeline.h"
#include "commands.h"
#include "difference/difference_statistics.h"
#include "document/writers.h"
#include "figures/score_plot.h"
#include "figures/text.h"
#include "image/image_file.h"
#include "image/spectral_image.h"

namespace truebox::app {
namespace {

struct CompareArguments {
  std::string test, reference, directory, json, junit, markdown;
  std::string test_uncertainty, reference_uncertainty;
  double warn = 0.0, fail = 0.0, outliers = 0.0;
  bool relative = false, sigmas = false;
  std::optional<double> band_nm;
};

/// Everything the two files say about one another.
struct Comparison {
  Image test, reference;
  DifferenceMap map;
  DifferenceStatistics statistics;
  DifferenceGate gate;
};

DifferenceLimits limits_of(const CompareArguments& a) {
  DifferenceLimits limits{DifferenceScale::absolute, a.warn, a.fail, a.outliers};
  if (a.relative) limits.scale = DifferenceScale::relative;
  if (a.sigmas) limits.scale = DifferenceScale::sigmas;
  return limits;
}

Comparison compare(const CompareArguments& a) {
  Comparison c{read_image(a.test), read_image(a.reference), {}, {}, {}};
  DifferenceOptions options;
  options.band_nm = a.band_nm;
  std::optional<Image> test_u, reference_u;
  if (!a.test_uncertainty.empty()) test_u = read_image(a.test_uncertainty);
  if (!a.reference_uncertainty.empty()) reference_u = read_image(a.reference_uncertainty);
  options.test_uncertainty = test_u ? &*test_u : nullptr;
  options.reference_uncertainty = reference_u ? &*reference_u : nullptr;
  c.map = difference_map(c.test, c.reference, options);
  c.statistics = difference_statistics(c.map);
  c.gate = apply_limits(c.map, limits_of(a));
  return c;
}

/// The unit of numbers on the scale of the limits.
std::string scale_unit(const Comparison& c) {
  switch (c.gate.limits.scale) {
    case DifferenceScale::absolute: return c.map.unit;
    case DifferenceScale::relative: return "1";
    case DifferenceScale::sigmas: break;
  }
  return "sigma";
}

std::string with_unit(double value, const std::string& unit) {
  const std::string shown = unit_text(unit);
  return number_text(value, 4) + (shown.empty() ? "" : " " + shown);
}

std::string place(const SamplePosition& at) {
  return fmt::format("pixel ({}, {}), {}", at.x_px, at.y_px, at.channel);
}

std::string verdict_sentence(const Comparison& c) {
  const DifferenceGate& g = c.gate;
  if (g.pixels_not_finite > 0)
    return fmt::format(
        "{} of {} pixels hold NaN or Inf, so nothing can be said for the test image.",
        g.pixels_not_finite, g.pixels);
  const std::string unit = scale_unit(c);
  const std::string largest =
      fmt::format("the largest {}difference is {} at {}",
                  g.limits.scale == DifferenceScale::relative ? "relative " : "",
                  with_unit(g.largest, unit), place(g.largest_at));
  if (g.outcome == Agreement::agrees)
    return fmt::format("The images agree: {}, the limit {}.", largest,
                       with_unit(g.limits.warn, unit));
  const bool fails = g.outcome == Agreement::fails;
  return fmt::format("{} of {} pixels differ by more than {} ({:.3g} % may); {}.",
                     fails ? g.pixels_over_fail : g.pixels_over_warn, g.pixels,
                     with_unit(fails ? g.limits.fail : g.limits.warn, unit),
                     100.0 * g.limits.allowed_fraction, largest);
}

Table statistics_table(const Comparison& c) {
  const DifferenceStatistics& s = c.statistics;
  const std::string unit = unit_text(c.map.unit);
  Table table{"Differences, test - reference, over all finite samples",
              {{"Statistic"}, {"Value"}, {"Unit"}},
              {}};
  const auto add = [&](const char* name, double value, const std::string& u) {
    table.rows.push_back({name, value, u});
  };
  add("samples", static_cast<double>(s.samples), "");
  add("not finite", static_cast<double>(s.not_finite), "");
  add("bias", s.bias, unit);
  add("mean absolute", s.mean_absolute, unit);
  add("root mean square", s.rms, unit);
  add("largest absolute", s.max_absolute, unit);
  add("median absolute", s.p50, unit);
  add("95th percentile", s.p95, unit);
  add("99th percentile", s.p99, unit);
  add("relative bias", 100.0 * s.relative_bias, "%");
  add("relative mean absolute", 100.0 * s.relative_mean_absolute, "%");
  add("relative root mean square", 100.0 * s.relative_rms, "%");
  if (c.map.has_uncertainty()) add("root mean square z", s.rms_sigmas, "");
  return table;
}

/// The channel that holds the largest difference: the one to look at.
const DifferenceChannel& worst_channel(const Comparison& c) {
  for (const auto& channel : c.map.channels)
    if (channel.name == c.statistics.max_at.channel) return channel;
  return c.map.channels.front();
}

bool has_rgb(const Image& image) {
  return image.find("R") != nullptr && image.find("G") != nullptr && image.find("B") != nullptr;
}

DisplayPicture shown(const ColourPipeline& pipeline, const Image& image, bool colour,
                     std::span<const float> plane, double exposure) {
  return colour ? pipeline.picture(image, exposure)
                : pipeline.grey_picture(image.width, image.height, plane, exposure);
}

PictureRow pictures(const Comparison& c, std::string& colour_description) {
  const ColourPipeline pipeline;
  const DifferenceChannel& worst = worst_channel(c);
  const bool colour = has_rgb(c.test) && has_rgb(c.reference);
  std::vector<float> test = worst.reference;
  for (std::size_t i = 0; i < test.size(); ++i) test[i] += worst.difference[i];
  const double exposure =
      exposure_for_quantile(colour ? c.reference.find("G")->samples : worst.reference, 0.95);
  const DisplayPicture r = shown(pipeline, c.reference, colour, worst.reference, exposure);
  const DisplayPicture t = shown(pipeline, c.test, colour, test, exposure);
  colour_description = r.description;
  const bool sigmas = c.gate.limits.scale == DifferenceScale::sigmas;
  std::vector<float> shown_difference = worst.difference;
  if (sigmas)
    for (std::size_t i = 0; i < test.size(); ++i)
      shown_difference[i] = static_cast<float>(worst.sigmas(i));
  const double limit = symmetric_limit(shown_difference, 0.99);
  const int w = c.map.width, h = c.map.height;
  return {
      {{"Reference", plain_picture(w, h, r.rgb, r.note), "The reference image"},
       {"Test", plain_picture(w, h, t.rgb, t.note), "The test image, with the same exposure"},
       {"Signed difference",
        signed_false_colour(
            w, h, shown_difference, limit,
            (sigmas ? "(test - reference) / u, " : "test - reference, ") + worst.name,
            sigmas ? "1" : c.map.unit),
        "Difference by pixel: " + verdict_sentence(c)}},
      "Grey: no difference. Red: the test is brighter. Blue: it is darker. The scale ends at the "
      "99th percentile of the channel with the largest difference."};
}

Figure z_figure(const Comparison& c) {
  std::vector<double> z;
  for (const auto& channel : c.map.channels)
    for (std::size_t i = 0; i < channel.difference.size(); ++i) z.push_back(channel.sigmas(i));
  return {"Differences in units of their uncertainty",
          z_histogram_svg("Histogram of the differences in sigmas", z),
          "Narrower than the line: uncertainties stated too large. Wider or shifted: something is "
          "not accounted for."};
}

Report make_report(const CompareArguments& a, const Comparison& c) {
  Report report;
  report.title = fmt::format("{} against {}", std::filesystem::path(a.test).filename().string(),
                             std::filesystem::path(a.reference).filename().string());
  report.subtitle = fmt::format("{} x {} px, {} channels compared", c.map.width, c.map.height,
                                c.map.channels.size());
  report.verdict = {c.gate.outcome, verdict_sentence(c)};
  const double allowed = c.gate.limits.allowed_fraction * static_cast<double>(c.gate.pixels);
  const auto check = [&](const char* name, std::size_t count, double limit, Agreement if_over) {
    const auto n = static_cast<double>(count);
    report.checks.push_back({name, n > limit ? if_over : Agreement::agrees, n, limit, "px", ""});
  };
  check("pixels not finite", c.gate.pixels_not_finite, 0.0, Agreement::fails);
  check("pixels over the fail limit", c.gate.pixels_over_fail, allowed, Agreement::fails);
  check("pixels over the warn limit", c.gate.pixels_over_warn, allowed, Agreement::warning);
  report.key_numbers = {
      {"Largest difference", c.gate.largest, scale_unit(c), 3, place(c.gate.largest_at)},
      {"Root mean square", c.statistics.rms, c.map.unit, 3, "all channels"},
      {"Relative bias", 100.0 * c.statistics.relative_bias, "%", 3, "test - reference"},
      {"Pixels over the fail limit", static_cast<double>(c.gate.pixels_over_fail), "px", 3,
       fmt::format("of {}", c.gate.pixels)}};
  std::string colour;
  report.sections = {{"Pictures", {pictures(c, colour)}}, {"Numbers", {statistics_table(c)}}};
  if (c.map.has_uncertainty()) report.sections[1].blocks.push_back(z_figure(c));
  const std::string unit = scale_unit(c);
  report.provenance = {{"Test", a.test},
                       {"Reference", a.reference},
                       {"Warn limit", with_unit(a.warn, unit)},
                       {"Fail limit", with_unit(a.fail, unit)},
                       {"Pixels allowed beyond", fmt::format("{:g} %", 100.0 * a.outliers)},
                       {"Colour", colour}};
  return report;
}

void print_summary(const Comparison& c) {
  for (const auto& row : statistics_table(c).rows)
    fmt::print("{:<26}{:>14} {}\n", row[0].text, number_text(*row[1].number, 5), row[2].text);
  fmt::print("{:<26}{}\n\n{}: {}\n", "largest at", place(c.statistics.max_at),
             to_text(c.gate.outcome), verdict_sentence(c));
}

int run_compare(CompareArguments a) {
  const Comparison c = compare(a);
  print_summary(c);
  const Report report = make_report(a, c);
  if (!a.directory.empty()) {
    write_report(a.directory, report);
    write_exr(std::filesystem::path(a.directory) / "difference.exr", to_image(c.map));
    fmt::print("{}\n", (std::filesystem::path(a.directory) / "report.html").string());
  }
  if (!a.json.empty()) write_file_atomically(a.json, to_json(report));
  if (!a.junit.empty()) write_file_atomically(a.junit, to_junit(report));
  if (!a.markdown.empty()) write_file_atomically(a.markdown, to_markdown(report));
  return exit_code(c.gate.outcome);
}

}  // namespace

void add_compare_command(CLI::App& program, Action& chosen) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* command = program.add_subcommand(
      "compare",
      "Compares two images (EXR, PNG, TIFF; spectral or RGB) and says whether they agree");
  command->add_option("TEST", a->test, "the image to be judged")->required();
  command->add_option("REFERENCE", a->reference, "the image to judge it by")->required();
  command->add_option("-o,--output", a->directory, "folder for the report and difference.exr");
  auto* warn =
      command
          ->add_option("--warn", a->warn, "warn where a pixel differs by more (default: as --fail)")
          ->check(CLI::NonNegativeNumber);
  auto* fail = command
                   ->add_option("--fail", a->fail,
                                "fail where a pixel differs by more (default: as --warn, else 0)")
                   ->check(CLI::NonNegativeNumber);
  auto* relative =
      command->add_flag("--relative", a->relative, "limits are fractions of the reference");
  auto* sigmas = command->add_flag("--sigmas", a->sigmas, "limits are in standard uncertainties");
  sigmas->excludes(relative);
  command->add_option("--uncertainty", a->test_uncertainty,
                      "standard uncertainty of TEST, an image");
  command->add_option("--reference-stderr", a->reference_uncertainty,
                      "standard uncertainty of REFERENCE, an image");
  command
      ->add_option("--outliers", a->outliers, "fraction of the pixels that may lie beyond a limit")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--band", a->band_nm, "compare only the band nearest to this wavelength, nm");
  command->add_option("--json", a->json, "file for the full report as JSON");
  command->add_option("--junit", a->junit, "file for the checks as JUnit XML");
  command->add_option("--markdown", a->markdown, "file for a summary in Markdown");
  command->footer(
      "Exit code: 0 agrees, 1 warning, 2 fails, 3 sizes or bands differ, 4 unreadable.\n"
      "Example:\n  truebox compare render.exr photo.exr --relative --warn 0.02 --fail 0.05 -o out");
  command->callback([=, &chosen] {
    if (a->sigmas && a->test_uncertainty.empty() && a->reference_uncertainty.empty())
      throw CLI::ValidationError("--sigmas", "needs --uncertainty or --reference-stderr");
    if (fail->count() == 0) a->fail = a->warn;
    if (warn->count() == 0) a->warn = a->fail;
    if (a->warn > a->fail) throw CLI::ValidationError("--warn", "must not exceed --fail");
    chosen = [a] { return run_compare(*a); };
  });
}

}  // namespace truebox::app
