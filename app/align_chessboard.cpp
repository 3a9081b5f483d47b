// SPDX-License-Identifier: BSD-3-Clause
#include "align_chessboard.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "alignment/chessboard_calibration.h"
#include "alignment/chessboard_corners.h"
#include "commands.h"
#include "document/writers.h"
#include "figures/line_overlay.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "sensor/lens.h"

namespace truebox::app {
namespace {

Chessboard read_board(const ChessboardArguments& a) {
  Chessboard board;
  char after = 0;
  if (std::sscanf(a.corners.c_str(), "%dx%d%c", &board.columns, &board.rows, &after) != 2 ||
      board.columns < 2 || board.rows < 2 || board.columns > 200 || board.rows > 200)
    throw InputError("--chessboard", 0, "inner corners as 9x6, at least 2x2", a.corners);
  char unit[4] = "";
  double length = 0.0;
  const int read = std::sscanf(a.square.c_str(), "%lf%3s", &length, unit);
  const std::string name = unit;
  const double metres = name == "mm"   ? 1e-3
                        : name == "cm" ? 1e-2
                        : name == "m"  ? 1.0
                        : name == "in" ? 0.0254
                                       : 0.0;
  board.square_m = length * metres;
  if (read != 2 || !(board.square_m > 0.0) || !std::isfinite(board.square_m))
    throw InputError("--square", 0, "a length as 25mm, 2.5cm, 0.025m or 1in", a.square);
  return board;
}

struct Photographs {
  int width = 0, height = 0;
  std::vector<ChessboardView> views;
  std::vector<std::string> without;
  Image first;
};

Photographs find_corners(const ChessboardArguments& a, const Chessboard& board) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  Photographs found;
  for (const std::string& path : a.photographs) {
    if (terminal) fmt::print(stderr, "\r\033[K{}", path);
    Image image = read_image(path);
    if (found.width == 0) {
      found.width = image.width;
      found.height = image.height;
    }
    if (image.width != found.width || image.height != found.height)
      throw MismatchError(fmt::format("{} is {} x {}, {} {} x {}: one camera, one size", path,
                                      image.width, image.height, a.photographs.front(), found.width,
                                      found.height));
    const auto corners = chessboard_corners(image, board.columns, board.rows);
    const std::string name = std::filesystem::path(path).stem().string();
    if (!corners) {
      found.without.push_back(name);
      continue;
    }
    if (found.views.empty()) found.first = std::move(image);
    found.views.push_back({name, *corners});
  }
  if (terminal) fmt::print(stderr, "\r\033[K");
  return found;
}

/// Where the lens puts a point of the board.
PixelPosition seen_by(const LensCalibration& c, const BoardPose& pose, const Vec3& point_m) {
  const Vec3 w(pose.rotation_rad[0], pose.rotation_rad[1], pose.rotation_rad[2]);
  const double angle = w.norm();
  Vec3 p = point_m;
  if (angle > 0.0) {
    const Vec3 k = w / angle;
    p = std::cos(angle) * point_m + std::sin(angle) * k.cross(point_m) +
        (1.0 - std::cos(angle)) * k.dot(point_m) * k;
  }
  for (int k = 0; k < 3; ++k) p[k] += pose.translation_m[static_cast<std::size_t>(k)];
  const auto image = distorted(c.distortion, NormalisedPoint{p[0] / p[2], p[1] / p[2]});
  return {c.principal_point_px[0] + c.focal_px * image.x,
          c.principal_point_px[1] + c.focal_px * image.y};
}

/// The first photograph with the projected board, and the corners' residuals of all views,
/// magnified: what they have in common shows up as a pattern.
Picture overlay(const LensCalibration& c, const Chessboard& board, const Photographs& photographs) {
  constexpr double kFactor = 50.0;
  std::vector<OverlayLine> lines;
  for (std::size_t v = 0; v < c.views.size(); ++v)
    for (std::size_t i = 0; i < photographs.views[v].corners.size(); ++i) {
      const auto columns = static_cast<std::size_t>(board.columns);
      const auto at = [&](std::size_t k) {
        return seen_by(c, c.views[v],
                       board.square_m * Vec3(double(k % columns), double(k / columns), 0.0));
      };
      const PixelPosition here = at(i), seen = photographs.views[v].corners[i];
      lines.push_back({here,
                       {here.x_px + kFactor * (seen.x_px - here.x_px),
                        here.y_px + kFactor * (seen.y_px - here.y_px)},
                       {90, 170, 255}});
      if (v != 0) continue;
      if (i % columns + 1 < columns) lines.push_back({here, at(i + 1), {90, 255, 120}});
      if (i + columns < photographs.views[v].corners.size())
        lines.push_back({here, at(i + columns), {90, 255, 120}});
    }
  return line_overlay(
      photographs.first, lines, 1600,
      fmt::format("Green: the board of {} as the lens sees it. Blue: from projected "
                  "to found corner, all views, {:g} times magnified.",
                  photographs.views[0].name, kFactor));
}

nlohmann::json to_json(const LensCalibration& c, const Photographs& photographs) {
  nlohmann::json json{{"outcome", to_string(c.outcome)},
                      {"message", c.message},
                      {"least_determined", c.null_direction},
                      {"pixels", {photographs.width, photographs.height}},
                      {"pixel_centre", "(0.5, 0.5) is the centre of the top left pixel"},
                      {"rms_px", c.rms_px},
                      {"corner_u_px", c.corner_u_px},
                      {"condition", c.condition},
                      {"without_board", photographs.without}};
  for (const EstimatedParameter& p : c.estimated)
    json["parameters"].push_back(
        {{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"u", p.standard_uncertainty}});
  for (Eigen::Index i = 0; i < c.covariance.rows(); ++i) {
    nlohmann::json row = nlohmann::json::array();
    for (Eigen::Index k = 0; k < c.covariance.cols(); ++k) row.push_back(c.covariance(i, k));
    json["covariance"].push_back(row);
  }
  for (std::size_t v = 0; v < c.views.size(); ++v)
    json["views"].push_back({{"name", photographs.views[v].name},
                             {"rms_px", c.views[v].rms_px},
                             {"rotation_rad", c.views[v].rotation_rad},
                             {"translation_m", c.views[v].translation_m}});
  return json;
}

Report report_of(const LensCalibration& c, const Chessboard& board,
                 const Photographs& photographs) {
  const bool good = c.outcome == AlignmentOutcome::converged;
  const Agreement agreement = good ? Agreement::agrees : Agreement::fails;
  Report report;
  report.title = "Lens from photographs of a chessboard";
  report.subtitle = fmt::format("{} views of {} x {} corners", photographs.views.size(),
                                board.columns, board.rows);
  report.verdict = {agreement, good ? fmt::format("The lens is determined: corners are met within "
                                                  "{:.3g} px rms.",
                                                  c.rms_px)
                                    : c.message};
  report.checks = {{"lens determined", agreement, c.rms_px, 0.0, "px",
                    "reprojection rms; judged is whether the views determine the lens"}};
  report.key_numbers = {{"reprojection error", c.rms_px, "px", 3, "rms distance"}};
  if (!c.views.empty())
    report.sections.push_back(
        {"Overlay",
         {PictureRow{{{"Board and residuals", overlay(c, board, photographs),
                       "a photograph of the board, the projected board and residuals over it"}},
                     "",
                     {}}}});
  Table parameters{
      "Lens, standard uncertainties k = 1", {{"parameter"}, {"estimate"}, {"unit"}}, {}};
  for (const EstimatedParameter& p : c.estimated)
    parameters.rows.push_back({p.name, Cell(p.value, p.standard_uncertainty), p.unit});
  Table views{"Views", {{"photograph"}, {"rms", "px", 3, true}, {"distance", "m", 4}}, {}};
  for (std::size_t v = 0; v < c.views.size(); ++v)
    views.rows.push_back(
        {photographs.views[v].name, c.views[v].rms_px, c.views[v].translation_m[2]});
  report.sections.push_back({"Numbers", {parameters, views}});
  for (const std::string& name : photographs.without)
    report.provenance.push_back({"no board found in", name});
  return report;
}

}  // namespace

int calibrate_from_chessboard(const ChessboardArguments& arguments) {
  const Chessboard board = read_board(arguments);
  const Photographs photographs = find_corners(arguments, board);
  for (const std::string& name : photographs.without)
    fmt::print(stderr, "truebox: no {} board found in {}\n", arguments.corners, name);
  const LensCalibration c =
      calibrate_lens(board, photographs.width, photographs.height, photographs.views);
  const std::filesystem::path directory = arguments.directory;
  write_file_atomically(directory / "lens.json", to_json(c, photographs).dump(1) + "\n");
  write_report(directory, report_of(c, board, photographs));
  if (!c.views.empty()) {
    const Picture picture = overlay(c, board, photographs);
    write_file_atomically(directory / "overlay.png", picture.png.data(), picture.png.size());
  }
  fmt::print("{}{}\n", to_string(c.outcome), c.message.empty() ? "" : ": " + c.message);
  if (c.outcome == AlignmentOutcome::converged) {
    fmt::print("{} views, reprojection error {:.4f} px rms\n\n", c.views.size(), c.rms_px);
    for (const EstimatedParameter& p : c.estimated)
      fmt::print("{:<18} {:>13.6g} +- {:<10.2g} {}\n", p.name, p.value, p.standard_uncertainty,
                 p.unit == "1" ? "" : p.unit);
  }
  fmt::print("\n{}\n", (directory / "report.html").string());
  return c.outcome == AlignmentOutcome::converged ? kAgrees : kNotSolved;
}

}  // namespace truebox::app
