// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdlib>

#include "provenance/provenance.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"
#include "transport/form_factor.h"
#include "verification/accuracy_check.h"

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

struct Region {
  Polygon outline;
  std::vector<Polygon> holes;
};

// "A1 [outline] | [hole] ; A2 [outline]"
std::vector<Region> read_regions(const std::string& text) {
  std::vector<Region> regions;
  std::size_t at = text.find('[');
  bool is_hole = false;
  while (at != std::string::npos) {
    Polygon polygon = read_polygon(text, at);
    if (is_hole)
      regions.back().holes.push_back(std::move(polygon));
    else
      regions.push_back({std::move(polygon), {}});
    const std::size_t next = text.find('[', at);
    is_hole =
        next != std::string::npos && text.substr(at, next - at).find('|') != std::string::npos;
    at = next;
  }
  return regions;
}

// The table gives outlines, not sides: each is turned to face the other.
void face(Region& a, const Vec3& point) {
  if (plane_of(a.outline).distance_m(point) < 0.0) std::reverse(a.outline.begin(), a.outline.end());
}

double exchange_of(const Region& a, const Region& b) {
  double sum = 0.0;
  for (const Polygon& p : convex_pieces(a.outline, a.holes))
    for (const Polygon& q : convex_pieces(b.outline, b.holes))
      sum += exchange_area_m2(PlanarPolygon(p), PlanarPolygon(q), 1e-13);
  return sum;
}

double area_of(const Region& region) {
  double area = area_vector(region.outline).norm();
  for (const Polygon& hole : region.holes) area -= area_vector(hole).norm();
  return area;
}

}  // namespace

std::vector<AccuracyCheck> check_view_factors(const std::filesystem::path& reference_dir) {
  const TableFile table = read_table(reference_dir / "analytic" / "view_factors.csv");
  require_provenance(table);
  const std::size_t value = table.column_index("value");
  std::vector<AccuracyCheck> checks;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::string& geometry = table.rows[row][1];
    if (!geometry.starts_with("A1 [") || geometry.find("blocker") != std::string::npos) continue;
    auto regions = read_regions(geometry);
    if (regions.size() != 2)
      throw InputError(table.path, table.row_lines[row], "two polygons A1 and A2", geometry);
    face(regions[0], centroid(regions[1].outline));
    face(regions[1], centroid(regions[0].outline));
    AccuracyCheck check{"viewfactors", table.rows[row][0], 0, table.number(row, value), 0, "1", {}};
    check.computed = exchange_of(regions[0], regions[1]) / area_of(regions[0]);
    check.allowed = 1e-9 * check.certified;
    check.reason = "1e-9 relative at the extremes";
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace truebox
