// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "chart_finder/chart_finder.h"
#include "commands.h"
#include "document/writers.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox::app {
namespace {

struct ChartArguments {
  std::vector<std::string> images;
  std::string mosaic = "as the file says";
  std::string directory = "chart";
};

void set_mosaic(ChartPicture& picture, const std::string& pattern, const std::string& file) {
  picture.mosaic = pattern != "none";
  try {
    if (picture.mosaic) picture.bayer = BayerPattern(pattern);
  } catch (const std::invalid_argument& error) {
    throw InputError(file, 0, "a Bayer pattern (rggb, bggr, grbg, gbrg) or none", pattern);
  }
}

/// The planes of one file: a calibrated photograph's value with its uncertainty, R, G, B, or the
/// only channel.
void add_planes(const Image& image, const std::string& name, ChartPicture& picture) {
  const auto samples = [&](const char* channel) {
    const Channel* c = image.find(channel);
    return c ? c->samples : std::vector<float>{};
  };
  const auto band = image.attributes.find("band");
  const std::string label = band == image.attributes.end() ? name : band->second;
  if (image.find("value")) {
    picture.planes.push_back({label, samples("value"), samples("u_noise"), samples("u_common")});
  } else if (image.find("R") && image.find("G") && image.find("B")) {
    for (const char* c : {"R", "G", "B"}) picture.planes.push_back({c, samples(c), {}, {}});
  } else if (image.channels.size() == 1) {
    picture.planes.push_back({label, image.channels[0].samples, {}, {}});
  } else {
    throw InputError(name, 0, "a channel \"value\", channels R, G, B, or a single channel",
                     std::to_string(image.channels.size()) + " others");
  }
}

ChartPicture read_picture(const ChartArguments& arguments) {
  ChartPicture picture;
  for (const std::string& path : arguments.images) {
    const Image image = read_image(path);
    if (picture.planes.empty()) {
      picture.width = image.width;
      picture.height = image.height;
      const auto own = image.attributes.find("bayer");
      set_mosaic(picture,
                 arguments.mosaic != "as the file says" ? arguments.mosaic
                 : own != image.attributes.end()        ? own->second
                                                        : "none",
                 path);
    }
    if (image.width != picture.width || image.height != picture.height)
      throw MismatchError(path + " has another size than " + arguments.images[0]);
    add_planes(image, path, picture);
  }
  if (picture.planes.size() != 1 && picture.planes.size() != 3)
    throw InputError(arguments.images[0], 0, "one plane, or three to be seen as red, green, blue",
                     std::to_string(picture.planes.size()) + " planes");
  return picture;
}

nlohmann::json to_json(const ChartFinding& finding) {
  const auto points = [](const std::array<PixelPosition, 4>& outline) {
    nlohmann::json j = nlohmann::json::array();
    for (const PixelPosition& p : outline) j.push_back({p.x_px, p.y_px});
    return j;
  };
  nlohmann::json j{{"outcome", finding.found ? "found" : "no chart"}};
  if (!finding.found) {
    j["why"] = finding.why_not;
    return j;
  }
  j["corners_px"] = points(finding.corners);
  j["colour_distance"] = finding.colour_distance;
  for (const FoundPatch& patch : finding.patches) {
    nlohmann::json values = nlohmann::json::array();
    for (const PatchValue& v : patch.values)
      values.push_back({{"plane", v.plane},
                        {"site", std::string(1, v.site)},
                        {"mean", v.mean},
                        {"u_noise", v.u_noise},
                        {"u_common", v.u_common},
                        {"scatter", v.scatter},
                        {"samples", v.samples}});
    j["patches"].push_back(
        {{"name", patch.name}, {"outline_px", points(patch.outline)}, {"values", values}});
  }
  return j;
}

Report to_report(const ChartFinding& finding, const ChartOverlay& overlay,
                 const std::vector<std::string>& images) {
  Report report;
  report.title = "ColorChecker";
  for (const auto& image : images) report.subtitle += (report.subtitle.empty() ? "" : ", ") + image;
  report.verdict = {finding.found ? Agreement::agrees : Agreement::not_run,
                    finding.found ? "A chart of 24 patches was found and measured"
                                  : "No chart: " + finding.why_not};
  report.checks.push_back({"a chart is in the picture", report.verdict.outcome,
                           finding.colour_distance, 0.0, "1",
                           "the detector's distance from the colours it knows"});
  PictureRow row;
  row.panels.push_back(
      {"What was averaged",
       plain_picture(overlay.width, overlay.height, overlay.rgb, "8-bit copy for the eye"),
       "the picture with the outlines of the chart and of the averaged areas"});
  row.caption = "Red: the areas averaged, on the linear floats. Yellow: the chart as detected.";
  report.sections.push_back({"Where the chart is", {row}});
  if (!finding.found) return report;
  Table table{"Mean of each patch; u of the mean, k = 1",
              {{"Patch"},
               {"Plane"},
               {"Photosites"},
               {"Mean", "", 5},
               {"u common", "", 3},
               {"Scatter", "", 3},
               {"Samples"}},
              {}};
  for (const FoundPatch& patch : finding.patches)
    for (const PatchValue& v : patch.values)
      table.rows.push_back({patch.name, v.plane, std::string(1, v.site), Cell(v.mean, v.u_noise),
                            v.u_common, v.scatter, fmt::format("{}", v.samples)});
  report.sections.push_back({"Patches", {table}});
  return report;
}

int chart(const ChartArguments& arguments) {
  const ChartPicture picture = read_picture(arguments);
  const ChartFinding finding = find_chart(picture);
  const ChartOverlay overlay = chart_overlay(picture, finding);
  const std::filesystem::path directory = arguments.directory;
  std::filesystem::create_directories(directory);
  const auto png = encode_png_rgb8(overlay.width, overlay.height, overlay.rgb);
  write_file_atomically(directory / "overlay.png", png.data(), png.size());
  write_file_atomically(directory / "chart.json", to_json(finding).dump(2) + "\n");
  write_report(directory, to_report(finding, overlay, arguments.images));
  if (!finding.found) {
    fmt::print("no chart: {}\n", finding.why_not);
    return kNotSolved;
  }
  fmt::print("{:<14} {:<10} {:>4} {:>12} {:>11} {:>11} {:>8}\n", "patch", "plane", "site", "mean",
             "u noise", "u common", "samples");
  for (const FoundPatch& patch : finding.patches)
    for (const PatchValue& v : patch.values)
      fmt::print("{:<14} {:<10} {:>4} {:>12.5g} {:>11.2g} {:>11.2g} {:>8}\n", patch.name, v.plane,
                 v.site, v.mean, v.u_noise, v.u_common, v.samples);
  fmt::print("{}\n", (directory / "report.html").string());
  return kAgrees;
}

}  // namespace

void add_chart_command(CLI::App& program, Action& chosen) {
  auto* command =
      program.add_subcommand("chart", "finds a ColorChecker in a linear picture and measures it");
  auto arguments = std::make_shared<ChartArguments>();
  command
      ->add_option("IMAGE", arguments->images,
                   "one picture (R, G, B or grey), or three to be seen as red, green and blue")
      ->required()
      ->expected(1, 3);
  command->add_option("--mosaic", arguments->mosaic, "rggb, bggr, grbg, gbrg or none")
      ->capture_default_str();
  command->add_option("-o,--output", arguments->directory, "directory to write into")
      ->capture_default_str();
  command->footer(
      "Example:\n  truebox calibrate reference/llanos_narrowband/measurement.toml -o calibrated\n"
      "  truebox chart calibrated/650nm.exr calibrated/550nm.exr calibrated/450nm.exr -o chart\n"
      "writes chart.json, overlay.png and report.html. The chart is looked for on an 8-bit copy "
      "and\n"
      "measured on the floats. Exit code 5 if there is no chart.");
  command->callback([arguments, &chosen] { chosen = [arguments] { return chart(*arguments); }; });
}

}  // namespace truebox::app
