// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <memory>
#include <optional>

#include "commands.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "probe_points.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox::app {
namespace {

struct ProbeArguments {
  PredictionArguments prediction;
  std::string points, areas, output;
  std::string within;  ///< a share: what is read from the field instead of gathered
};

struct ProbeArea {
  std::string name;
  int line = 0;
  Polygon polygon;  // m
};

// Parallelograms from (ox, oy, oz) along (ux, uy, uz) and (vx, vy, vz); a name counts once.
std::vector<ProbeArea> read_areas(const std::string& path, double metres_per_unit) {
  const TableFile table = read_table(path);
  const std::size_t name = table.column_index("name");
  std::vector<ProbeArea> areas;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const auto vector = [&](const char* x, const char* y, const char* z) -> Vec3 {
      return metres_per_unit * Vec3(table.number(row, table.column_index(x)),
                                    table.number(row, table.column_index(y)),
                                    table.number(row, table.column_index(z)));
    };
    const Vec3 o = vector("ox", "oy", "oz"), u = vector("ux", "uy", "uz"),
               v = vector("vx", "vy", "vz");
    if (!(u.cross(v).norm() > 1e-12 * u.norm() * v.norm()))
      throw InputError(path, table.row_lines[row], "an area spanned by u and v",
                       "parallel vectors");
    areas.push_back({table.rows[row][name], table.row_lines[row], {o, o + u, o + u + v, o + v}});
  }
  return areas;
}

std::vector<BoundedIrradiance> area_means(const Prediction& prediction, const std::string& path,
                                          const std::vector<ProbeArea>& areas) {
  std::vector<std::optional<BoundedIrradiance>> found(areas.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, areas.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Polygon& p = areas[i].polygon;
      found[i] = prediction.mean_irradiance_over(p);
      if (!found[i]) found[i] = prediction.mean_irradiance_over(Polygon(p.rbegin(), p.rend()));
    }
  });
  std::vector<BoundedIrradiance> means;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    if (!found[i])
      throw InputError(path, areas[i].line, "an area on a lit surface of the scene",
                       '"' + areas[i].name + "\" touches none");
    means.push_back(std::move(*found[i]));
  }
  return means;
}

// The piece of surface that a point lies on, facing its way: what a reconstruction knows.
std::optional<std::uint32_t> piece_at(const Prediction& prediction, const ProbePoint& point) {
  const PatchMesh& mesh = prediction.fine().mesh;
  const double tolerance_m = 1e-6 * prediction.scene().diameter_m();
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Polygon& polygon = mesh.pieces[p].polygon;
    const Plane& plane = mesh.pieces[p].plane;
    if (prediction.scene().surfaces[mesh.pieces[p].surface].is_opening ||
        plane.normal.dot(point.normal) < 1.0 - 1e-6 ||
        std::abs(plane.distance_m(point.position_m)) > tolerance_m)
      continue;
    bool is_inside = true;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vec3 along = (polygon[(k + 1) % polygon.size()] - polygon[k]).normalized();
      const Vec3 inwards = plane.normal.cross(along);
      is_inside = is_inside && inwards.dot(point.position_m - polygon[k]) > -tolerance_m;
    }
    if (is_inside) return p;
  }
  return std::nullopt;
}

struct Answers {
  std::vector<std::string> names;
  std::vector<BoundedIrradiance> irradiance;
  std::size_t read_from_field = 0;
};

bool is_within(const BoundedIrradiance& at, double share) {
  return (at.error_bound.array() <= share * at.value.array()).all();
}

Answers answers_of(const Prediction& prediction, const ProbeArguments& a) {
  const double unit_m = prediction.scene().metres_per_unit;
  const auto points = a.points.empty() ? std::vector<ProbePoint>{} : read_points(a.points, unit_m);
  Answers answers;
  answers.irradiance.resize(points.size());
  for (const ProbePoint& point : points) answers.names.push_back(point.name);
  const bool gathers = a.prediction.reconstruction.empty();
  const double within = a.within.empty() ? 0.0 : *share_of(a.within);
  std::vector<std::optional<std::uint32_t>> pieces(points.size());
  for (std::size_t i = 0; i < points.size() && (!gathers || within > 0.0); ++i) {
    pieces[i] = piece_at(prediction, points[i]);
    if (!pieces[i] && !gathers)
      throw InputError(a.points, 0,
                       "points on lit surfaces, their normals too, for --reconstruction",
                       '"' + points[i].name + "\" lies on none");
  }
  std::atomic<std::size_t> read_from_field = 0;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 1), [&](const auto& range) {
    Gather::Scratch scratch;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      BoundedIrradiance& at = answers.irradiance[i];
      if (pieces[i]) at = prediction.irradiance_on(*pieces[i], points[i].position_m, scratch);
      if (pieces[i] && (!gathers || is_within(at, within)))
        ++read_from_field;
      else
        at = prediction.irradiance_at(points[i].position_m, points[i].normal);
    }
  });
  answers.read_from_field = read_from_field;
  if (a.areas.empty()) return answers;
  const auto areas = read_areas(a.areas, unit_m);
  for (const ProbeArea& area : areas) answers.names.push_back(area.name);
  for (BoundedIrradiance& mean : area_means(prediction, a.areas, areas))
    answers.irradiance.push_back(std::move(mean));
  return answers;
}

RelativeBound largest_bound(const Scene& scene, const Answers& answers) {
  RelativeBound largest;
  for (std::size_t i = 0; i < answers.names.size(); ++i)
    for (std::size_t b = 0; b < scene.bands.size(); ++b) {
      const auto k = static_cast<Eigen::Index>(b);
      const double value = answers.irradiance[i].value[k];
      if (!(value > 0.0) || answers.irradiance[i].error_bound[k] <= largest.value * value) continue;
      largest.value = largest.in_order = answers.irradiance[i].error_bound[k] / value;
      largest.where = fmt::format("{}, {}", answers.names[i], name_of_band(scene, b));
    }
  return largest;
}

int probe(const ProbeArguments& a) {
  // Places are read first: a mistake there should not cost a solve. Their unit is the scene's.
  if (!a.points.empty()) read_points(a.points, 1.0);
  if (!a.areas.empty()) read_areas(a.areas, 1.0);
  PredictionArguments asked = a.prediction;
  std::optional<Answers> answers;
  asked.judge = [&](const Prediction& prediction) {
    return largest_bound(prediction.scene(), answers.emplace(answers_of(prediction, a)));
  };
  const auto predicted = predict(asked);
  if (predicted->prediction->outcome() != SolveOutcome::converged) {
    fmt::print(stderr, "truebox: the solver did not reach its bound\n");
    return kNotSolved;
  }
  if (!answers) answers = answers_of(*predicted->prediction, a);
  const WavelengthGrid& bands = predicted->scene.bands;
  std::string text = "name,band_nm,irradiance,error_bound\n";
  for (std::size_t i = 0; i < answers->names.size(); ++i)
    for (std::size_t b = 0; b < bands.size(); ++b) {
      const auto k = static_cast<Eigen::Index>(b);
      text += fmt::format("\"{}\",{},{:.9g},{:.3g}\n", answers->names[i], bands.centre_nm(b),
                          answers->irradiance[i].value[k], answers->irradiance[i].error_bound[k]);
    }
  const int code = predicted->misses_target ? kNotSolved : kAgrees;
  if (a.output.empty()) {
    fmt::print("{}", text);
    if (code != kAgrees) fmt::print(stderr, "truebox:{}", describe_target(*predicted));
    return code;
  }
  write_file_atomically(a.output, std::string("# quantity: irradiance\n# unit: ") +
                                      predicted->scene.exitance_unit() + "\n# source: truebox, " +
                                      predicted->scene.path + "\n" + text);
  const RelativeBound largest = largest_bound(predicted->scene, *answers);
  if (!a.within.empty())
    fmt::print("{} of {} points read from the field of their surface, the others gathered\n",
               answers->read_from_field, read_points(a.points, 1.0).size());
  fmt::print("{}{} places, {} bands; largest bound {:.2f} % of its irradiance{}\n",
             describe(*predicted), answers->names.size(), bands.size(), 100.0 * largest.value,
             largest.where.empty() ? "" : " (" + largest.where + ")");
  return code;
}

}  // namespace

void add_probe_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand("probe", "irradiance at points, with an error bound");
  auto arguments = std::make_shared<ProbeArguments>();
  add_prediction_options(*command, arguments->prediction);
  auto* places = command->add_option_group("places", "at least one");
  places->add_option("--points", arguments->points, "CSV: name,x,y,z,nx,ny,nz in the scene's unit");
  places->add_option(
      "--areas", arguments->areas,
      "CSV: name,ox,oy,oz,ux,uy,uz,vx,vy,vz, parallelograms on surfaces: their means");
  places->require_option(1, 2);
  command
      ->add_option("--within", arguments->within,
                   "read points on surfaces from the field there, where its own bound is no more "
                   "than this share of their irradiance (2%), and gather only the others: for "
                   "thousands of points")
      ->needs("--points")
      ->excludes("--reconstruction")
      ->check(check_share);
  command->add_option("-o,--output", arguments->output, "CSV: name,band_nm,irradiance,error_bound");
  command->footer(
      "Example: truebox probe reference/cornell_box/cornell_box.toml\n"
      "           --points reference/independent_renders/probe_points.csv -o irradiance.csv\n"
      "Points are gathered from all elements, some 5 to 100 ms each; with --reconstruction they "
      "are\n"
      "read from the field on their surface: at once, and less exact near edges. --within takes\n"
      "the field where its bound is good enough: truebox probe box.toml --points p.csv --within "
      "5%");
  command->callback([=, &chosen] { chosen = [=] { return probe(*arguments); }; });
}

}  // namespace truebox::app
