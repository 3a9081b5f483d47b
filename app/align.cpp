// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "align_chessboard.h"
#include "align_files.h"
#include "align_light.h"
#include "align_render.h"
#include "commands.h"
#include "document/writers.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"
#include "scene/scene_file.h"

namespace truebox::app {
namespace {

struct AlignArguments {
  std::vector<std::string> files;  // SCENE or RENDER and PHOTO, or photographs of a chessboard
  ChessboardArguments chessboard;
  RenderOptionsOfAlign render;
  LightArguments light;
  std::string photograph, points, directory = "aligned";
  std::string lens = "radial";
  AlignmentOptions options;
  bool no_search = false;
};

std::vector<PointObservation> read_picked_points(const std::string& path, double metres_per_unit) {
  const TableFile table = read_table(path);
  const auto column = [&](const char* name) { return table.column_index(name); };
  const std::size_t name = column("name"), x = column("x"), y = column("y"), z = column("z"),
                    px = column("x_px"), py = column("y_px");
  std::vector<PointObservation> points;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    PointObservation point;
    point.name = table.rows[row][name];
    point.point_m =
        metres_per_unit * Vec3(table.number(row, x), table.number(row, y), table.number(row, z));
    point.position = {table.number(row, px), table.number(row, py)};
    point.u_px = table.has_column("u_px") ? table.number(row, column("u_px")) : 1.0;
    if (!(point.u_px > 0.0))
      throw InputError(path, table.row_lines[row], "a standard uncertainty u_px above 0",
                       std::to_string(point.u_px));
    points.push_back(std::move(point));
  }
  return points;
}

void print_found(const BoxAlignment& found) {
  fmt::print("{}", to_string(found.outcome));
  if (found.outcome != AlignmentOutcome::converged) {
    fmt::print(": {}\n", found.message);
    return;
  }
  fmt::print(
      ": {:.0f} % of the predicted edges found, {:.3g} px rms; by cameras fitted without "
      "the border in question {:.3g} px{}\n\n",
      100.0 * found.matched_share, found.rms_px, found.cross_validated_rms_px,
      std::isfinite(found.held_out_rms_px)
          ? fmt::format("; held out {:.3g} px", found.held_out_rms_px)
          : "");
  for (const EstimatedParameter& p : found.estimated)
    fmt::print("{:<18} {:>13.6g} +- {:<10.2g} {}\n", p.name, p.value, p.standard_uncertainty,
               p.unit == "1" ? "" : p.unit);
  fmt::print("\n{:<34} {:>9} {:>9} {:>9} {:>12}\n", "border", "seen", "mean/px", "rms/px",
             "left out/px");
  for (const BorderStatistics& b : found.borders)
    fmt::print("{:<34} {:>9} {:>9.3f} {:>9.3f} {:>12}\n", b.border + (b.held_out ? " *" : ""),
               fmt::format("{}/{}", b.matched, b.predicted), b.mean_px, b.rms_px,
               std::isfinite(b.cross_validated_rms_px)
                   ? fmt::format("{:.3f}", b.cross_validated_rms_px)
                   : "-");
  for (const BorderStatistics& b : found.borders)
    if (b.held_out) {
      fmt::print("* held out\n");
      break;
    }
}

AlignmentSubject read_subject(const AlignArguments& a) {
  if (is_picture_file(a.files[0])) return read_render(a.files[0], a.render);
  const auto belongs_to_render = [&](const char* option, const std::string& value) {
    if (!value.empty())
      throw InputError(a.files[0], 0, std::string("a render with ") + option, "a scene file");
  };
  belongs_to_render("--scene", a.render.scene);
  belongs_to_render("--aov", a.render.aovs);
  AlignmentSubject subject;
  subject.path = a.files[0];
  subject.scene = read_scene(a.files[0]);
  subject.guess = find_camera(*subject.scene, a.render.camera);
  return subject;
}

void write_results(const AlignArguments& a, const AlignmentSubject& subject,
                   const BoxAlignment& found, const Image& photograph,
                   const PhotometricRefinement* light) {
  const std::filesystem::path directory = a.directory;
  write_file_atomically(directory / "alignment.json",
                        alignment_json(found, subject, a.photograph, light));
  const Picture overlay = alignment_overlay(found, photograph);
  write_file_atomically(directory / "overlay.png", overlay.png.data(), overlay.png.size());
  write_report(directory, alignment_report(found, subject, photograph, a.photograph, light));
  if (found.outcome != AlignmentOutcome::converged) return;
  if (subject.view)
    write_mapping(directory, *subject.view, light ? light->parameters : found.parameters,
                  photograph, a.photograph);
  if (subject.kind() == "print") return;  // no camera of any scene
  write_file_atomically(directory / "camera.toml",
                        camera_toml(light ? light->camera : found.camera, "aligned",
                                    subject.scene ? subject.scene->metres_per_unit : 1.0));
}

int align(AlignArguments a) {
  if (!a.chessboard.corners.empty()) {
    a.chessboard.photographs = a.files;
    a.chessboard.directory = a.directory;
    return calibrate_from_chessboard(a.chessboard);
  }
  if (a.files.size() != 2)
    throw InputError("align", 0, "a scene file or a render, and a photograph",
                     std::to_string(a.files.size()) + " files");
  a.photograph = a.files[1];
  const AlignmentSubject subject = read_subject(a);
  if (!a.points.empty()) {
    if (!subject.scene) throw InputError(a.points, 0, "a scene with picked points", "a render");
    a.options.points = read_picked_points(a.points, subject.scene->metres_per_unit);
  }
  const Image photograph = read_image(a.photograph);
  a.options.lens = a.lens == "fixed"  ? LensFreedom::fixed
                   : a.lens == "full" ? LensFreedom::full
                                      : LensFreedom::radial;
  a.options.search = !a.no_search;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  a.options.progress = [&](const std::string& stage, double share) {
    if (terminal) fmt::print(stderr, "\r\033[K{} {:.0f} %", stage, 100.0 * share);
  };
  const BoxAlignment found = align_subject(subject, photograph, a.options);
  std::optional<PhotometricRefinement> light;
  if (a.light.wanted)
    light = refine_by_light(a.light, subject, found, photograph, a.options.progress);
  if (terminal) fmt::print(stderr, "\r\033[K");
  write_results(a, subject, found, photograph, light ? &*light : nullptr);
  print_found(found);
  if (light) print_light(*light);
  fmt::print("\n{}\n", (std::filesystem::path(a.directory) / "report.html").string());
  if (found.outcome != AlignmentOutcome::converged) return kNotSolved;
  return light && light->outcome != AlignmentOutcome::converged ? kWarning : kAgrees;
}

void add_light_options(CLI::App& command, LightArguments& light) {
  auto* wanted = command.add_flag(
      "--photometric", light.wanted,
      "then refine the camera by the light between the edges: of the RENDER, or of a prediction");
  command.add_option("--gains", light.gains, "gain and offset free for each band, or each surface")
      ->check(CLI::IsMember({"band", "surface"}))
      ->capture_default_str()
      ->needs(wanted);
  command.add_option("--mask", light.mask, "image of the photograph's size, 0: pixel not used")
      ->needs(wanted);
  command.add_option("--elements", light.elements, "of the prediction for a scene")
      ->check(CLI::Range(std::size_t{50}, std::size_t{1000000}))
      ->capture_default_str()
      ->needs(wanted);
}

}  // namespace

void add_align_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "align", "camera pose and lens from the edges of a known box, with their uncertainties");
  auto a = std::make_shared<AlignArguments>();
  command
      ->add_option("FILES", a->files,
                   "SCENE PHOTO: a scene file with the box and a camera as the guess, and a "
                   "photograph of that box; RENDER PHOTO: a picture of the box, its camera as the "
                   "guess; or IMAGES of a --chessboard")
      ->required();
  auto* chessboard =
      command->add_option("--chessboard", a->chessboard.corners,
                          "inner corners of a board, 9x6: lens from photographs of it");
  command->add_option("--square", a->chessboard.square, "length of its squares, 25mm")
      ->needs(chessboard);
  command->add_option("--camera", a->render.camera, "the guess, a camera of the scene file");
  command->add_option("--scene", a->render.scene,
                      "of a RENDER that does not say which scene it shows, or another one");
  command->add_option("--aov", a->render.aovs,
                      "where a RENDER's pixels lie (render --aov): the edges sought are then the "
                      "render's own, shadows' among them; without scene or AOVs a RENDER is taken "
                      "for a flat print");
  add_light_options(*command, a->light);
  command->add_option("-o,--output", a->directory, "directory to write into")
      ->capture_default_str();
  command->add_option("--lens", a->lens, "distortion to estimate: fixed, radial (k1 k2), full")
      ->check(CLI::IsMember({"fixed", "radial", "full"}))
      ->capture_default_str();
  command
      ->add_option("--focal-u", a->options.focal_u,
                   "relative standard uncertainty of the guess's focal length; 0: known")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      ->add_option("--principal-point-u", a->options.principal_point_u,
                   "that of the principal point, of the picture's width; 0: known")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      ->add_option("--dimensions-u", a->options.stretch_u,
                   "relative standard uncertainty of the scene's extents along x, y and z, which "
                   "are then estimated; 0: known")
      ->check(CLI::Range(0.0, 0.5))
      ->capture_default_str();
  command->add_option("--ignore", a->options.ignore,
                      "borders not to look for, as \"floor/nothing\" or \"*/nothing\"");
  command->add_option("--hold-out", a->options.hold_out,
                      "borders to judge by, not to fit, written likewise");
  command->add_option("--points", a->points,
                      "picked points, CSV: name,x,y,z (scene's unit),x_px,y_px[,u_px]");
  command->add_flag("--no-search", a->no_search, "the guess is right within some pixels");
  command
      ->add_option("--most-pixels", a->options.most_px,
                   "larger photographs are averaged down to this many a side")
      ->check(CLI::Range(200, 20000))
      ->capture_default_str();
  command->footer(
      "Example:\n"
      "  truebox render reference/cornell_box/cornell_box.toml --camera front -o box.exr\n"
      "  truebox align reference/cornell_box/cornell_box.toml box.exr --camera front -o aligned\n"
      "  truebox align box.exr photograph.jpg --photometric -o aligned\n"
      "  truebox align --chessboard 9x6 --square 25mm reference/chessboard_opencv/left*.jpg -o "
      "lens\n"
      "writes alignment.json, camera.toml, overlay.png, report.html; for a render also\n"
      "photo_from_render.exr and photograph.exr, the photograph in the render's pixels. Exit code\n"
      "5 if the photograph shows no such box or does not determine the camera, 1 if the light\n"
      "contradicts the edges (their camera is kept)");
  command->callback([a, &chosen] { chosen = [a] { return align(*a); }; });
}

}  // namespace truebox::app
