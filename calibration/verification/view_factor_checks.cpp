// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <optional>

#include "provenance/provenance.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"
#include "transport/form_factor.h"
#include "transport/view_factors.h"
#include "verification/accuracy_check.h"
#include "verification/view_factor_scenes.h"

namespace truebox {
namespace {

// "[(x,y,z) (x,y,z) ...]": reads one bracket from `at`, leaves `at` behind it.
Polygon read_polygon(const std::string& text, std::size_t& at) {
  Polygon polygon;
  const std::size_t end = text.find(']', at);
  std::size_t open = text.find('(', at);
  for (; open < end; open = text.find('(', open + 1)) {
    const char* cursor = text.c_str() + open + 1;
    Vec3 v;
    for (int k = 0; k < 3; ++k) {
      char* next = nullptr;
      v[k] = std::strtod(cursor, &next);
      cursor = next + 1;
    }
    polygon.push_back(v);
  }
  at = end + 1;
  return polygon;
}

using Outlines = std::vector<SceneOutline>;

// "A1 [outline] | [hole] ; A2 [outline]"
Outlines read_regions(const std::string& text) {
  Outlines regions;
  std::size_t at = text.find('[');
  bool is_hole = false;
  while (at != std::string::npos) {
    Polygon polygon = read_polygon(text, at);
    if (is_hole)
      regions.back().holes.push_back(std::move(polygon));
    else
      regions.push_back({{}, std::move(polygon), {}});
    const std::size_t next = text.find('[', at);
    is_hole =
        next != std::string::npos && text.substr(at, next - at).find('|') != std::string::npos;
    at = next;
  }
  return regions;
}

// The table gives outlines, not sides: each is turned to face the other.
void face(SceneOutline& a, const Vec3& point) {
  if (plane_of(a.outline).distance_m(point) < 0.0) std::reverse(a.outline.begin(), a.outline.end());
}

// "A1 [...] ; A2 [...] ; blocker [...] ; blocker [...]"
Outlines polygon_scene(const TableFile& table, std::size_t row) {
  auto regions = read_regions(table.rows[row][1]);
  if (regions.size() < 2)
    throw InputError(table.path, table.row_lines[row], "two polygons A1 and A2, and blockers",
                     table.rows[row][1]);
  face(regions[0], centroid(regions[1].outline));
  face(regions[1], centroid(regions[0].outline));
  for (std::size_t k = 0; k < regions.size(); ++k)
    regions[k].name = k == 0 ? "A1" : k == 1 ? "A2" : "blocker";
  return regions;
}

Polygon regular_polygon(double radius, double z, int corners, bool facing_up) {
  Polygon polygon;
  for (int k = 0; k < corners; ++k) {
    const double phi = 2.0 * std::numbers::pi * (facing_up ? k : -k) / corners;
    polygon.push_back({radius * std::cos(phi), radius * std::sin(phi), z});
  }
  return polygon;
}

Outlines discs_scene(double radius_1, double radius_2, double distance, int corners) {
  return {{"A1", regular_polygon(radius_1, 0.0, corners, true), {}},
          {"A2", regular_polygon(radius_2, distance, corners, false), {}}};
}

// A globe of flat quads with its axis towards the disc; one slice of it, and the whole disc.
Outlines sphere_scene(double radius, double disc_radius, double distance, int corners) {
  Outlines scene;
  const auto at = [&](int latitude, int longitude) -> Vec3 {
    const double theta = std::numbers::pi * latitude / corners;
    const double phi = 2.0 * std::numbers::pi * longitude / corners;
    return radius *
           Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  };
  for (int k = 0; k < corners; ++k) {
    Polygon tile = {at(k, 0), at(k + 1, 0), at(k + 1, 1), at(k, 1)};
    if (k == 0) tile.erase(tile.begin());
    if (k == corners - 1) tile.erase(tile.begin() + 2);
    scene.push_back({"A1", tile, {}});
  }
  scene.push_back({"A2", regular_polygon(disc_radius, distance, corners, false), {}});
  return scene;
}

// The element is a square from x = 0: it may touch a wall there.
Outlines element_scene(double edge, const Polygon& wall) {
  const double h = 0.5 * edge;
  return {{"A1", {{0, -h, 0}, {edge, -h, 0}, {edge, h, 0}, {0, h, 0}}, {}}, {"A2", wall, {}}};
}

double factor_of(const Outlines& outlines, const ViewFactorOptions& options) {
  const ViewFactors factors(scene_of(outlines));
  return factors.between(0, 1, options).exchange_area_m2 / factors.area_m2(0);
}

// Polygons with n corners stand for round shapes: what they are off by is a series in 1/n^2, which
// Romberg's extrapolation removes (Romberg 1955).
double round_limit(const std::function<Outlines(int)>& with_corners) {
  constexpr int kLevels = 4;
  double table[kLevels];
  for (int level = 0; level < kLevels; ++level) {
    table[level] = factor_of(with_corners(16 << level), {});
    for (int k = level - 1; k >= 0; --k)
      table[k] = table[k + 1] + (table[k + 1] - table[k]) / (std::pow(4.0, level - k) - 1.0);
  }
  return table[0];
}

struct NamedScene {
  const char* name;
  double relative_tolerance;  // of the extrapolation
  std::function<Outlines(int corners)> scene;
};

// Rows whose geometry is words. Their scenes have `corners` where the shape is round.
const std::vector<NamedScene>& described_scenes() {
  static const std::vector<NamedScene> kScenes = {
      {"discs_r1_r1_h3", 1e-8, [](int n) { return discs_scene(1.0, 1.0, 3.0, n); }},
      {"discs_r1_r2_h1", 1e-8, [](int n) { return discs_scene(1.0, 2.0, 1.0, n); }},
      // Tiles on the sphere's outline see a part of the disc: their series is less even.
      {"sphere_to_disc", 1e-6, [](int n) { return sphere_scene(0.25, 1.0, 1.0, n); }},
  };
  return kScenes;
}

constexpr double kElementEdge = 1e-5;  // of a square that stands for an element in scene files
constexpr double kFarWall = 1e5;       // stands for an infinite wall

std::optional<Polygon> wall_of_element(const std::string& name, double far) {
  if (name == "element_to_square_centre")
    return Polygon{{-0.5, 0.5, 1}, {0.5, 0.5, 1}, {0.5, -0.5, 1}, {-0.5, -0.5, 1}};
  if (name == "element_to_halfspace_wall")
    return Polygon{{0, -far, 0}, {0, far, 0}, {0, far, far}, {0, -far, far}};
  return std::nullopt;
}

AccuracyCheck check_row(const TableFile& table, std::size_t row) {
  const std::string& name = table.rows[row][0];
  const double certified = table.number(row, table.column_index("value"));
  AccuracyCheck check{"viewfactors", name, 0.0, certified, 1e-9 * certified, "1", {}};
  check.reason = "1e-9 relative, also at the extremes and behind blockers";
  if (table.rows[row][1].starts_with("A1 [")) {
    ViewFactorOptions options;
    options.relative_tolerance = 1e-10;
    check.computed = factor_of(polygon_scene(table, row), options);
    return check;
  }
  if (const auto wall = wall_of_element(name, kFarWall)) {
    // A limit: the element lies just off the wall, and sees 1e-6 / 1e5 less of it.
    check.computed = point_to_polygon({1e-6, 0, 0}, Vec3::UnitZ(), *wall);
    return check;
  }
  for (const NamedScene& described : described_scenes())
    if (name == described.name) {
      check.computed = round_limit(described.scene);
      check.allowed = described.relative_tolerance * certified;
      check.reason = "extrapolated from polygons with 16 to 128 corners";
      return check;
    }
  throw InputError(table.path, table.row_lines[row], "polygons, or a row with a scene of its own",
                   table.rows[row][1]);
}

TableFile certified_table(const std::filesystem::path& reference_dir) {
  TableFile table = read_table(reference_dir / "analytic" / "view_factors.csv");
  require_provenance(table);
  return table;
}

}  // namespace

Scene scene_of(const std::vector<SceneOutline>& outlines) {
  Scene scene;
  scene.bands = WavelengthGrid::from_centres({550.0});
  scene.materials = {{"black", Reflectance(1, 0.0), RadiantExitance(1, 0.0)}};
  for (const SceneOutline& part : outlines) {
    if (scene.surfaces.empty() || scene.surfaces.back().name != part.name)
      scene.surfaces.push_back({part.name, 0, {}});
    for (Polygon& piece : convex_pieces(part.outline, part.holes))
      scene.surfaces.back().pieces.push_back(std::move(piece));
  }
  return scene;
}

std::vector<AccuracyCheck> check_view_factors(const std::filesystem::path& reference_dir) {
  const TableFile table = certified_table(reference_dir);
  std::vector<AccuracyCheck> checks;
  for (std::size_t row = 0; row < table.rows.size(); ++row) checks.push_back(check_row(table, row));
  return checks;
}

std::vector<CertifiedScene> view_factor_scenes(const std::filesystem::path& reference_dir,
                                               int corners) {
  const TableFile table = certified_table(reference_dir);
  std::vector<CertifiedScene> scenes;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    CertifiedScene certified{table.rows[row][0], {}, 0.0, 1e-9};
    certified.view_factor = table.number(row, table.column_index("value"));
    if (table.rows[row][1].starts_with("A1 [")) {
      certified.outlines = polygon_scene(table, row);
    } else if (const auto wall = wall_of_element(certified.name, 1e4 * kElementEdge)) {
      certified.outlines = element_scene(kElementEdge, *wall);
      certified.relative_model_error = 2e-4;
    } else {
      for (const NamedScene& described : described_scenes())
        if (certified.name == described.name) certified.outlines = described.scene(corners);
      certified.relative_model_error = 30.0 / (corners * corners);
    }
    scenes.push_back(std::move(certified));
  }
  return scenes;
}

}  // namespace truebox
