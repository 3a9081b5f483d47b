// SPDX-License-Identifier: BSD-3-Clause
#include "discontinuity/discontinuity_mesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "discontinuity/line_selection.h"
#include "mesh/uniform_cells.h"

namespace truebox {
namespace {

constexpr double kSnap = 0x1p-24;      // of a piece's diameter: corners closer than that are one
constexpr double kLongest = 1.5;       // edge of a triangle, in edges of a square element
constexpr double kShareOfLines = 0.5;  // of the cells, those that following the lines alone takes
constexpr double kThinnest = 0.03;     // width of a face, in distances that lines keep apart
constexpr int kBisections = 8;

double total_exitance(const Material& material) {
  return std::accumulate(material.exitance.values.begin(), material.exitance.values.end(), 0.0);
}

// What the luminaires send, spread over all surfaces, W m^-2 nm^-1 summed over the bands.
double mean_direct_irradiance(const Scene& scene) {
  double area_m2 = 0.0, flux = 0.0;
  for (const Surface& surface : scene.surfaces)
    for (const Polygon& piece : surface.pieces) {
      const double part_m2 = area_vector(piece).norm();
      area_m2 += part_m2;
      if (!surface.is_opening) flux += part_m2 * total_exitance(scene.material_of(surface));
    }
  return flux / area_m2;
}

// Halves triangles across their longest edges, cuts quads into grids, until no edge is longer than
// about `edge_m`.
void add_refined(const Polygon& cell, double edge_m, std::vector<Polygon>& refined) {
  if (cell.size() == 4) {
    const std::vector<Polygon> grid = uniform_cells(cell, edge_m);
    refined.insert(refined.end(), grid.begin(), grid.end());
    return;
  }
  int longest = 0;
  double length_m = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    if (const double edge = (cell[(k + 1) % 3] - cell[k]).norm(); edge > length_m)
      length_m = edge, longest = static_cast<int>(k);
  if (length_m <= kLongest * edge_m) {
    refined.push_back(cell);
    return;
  }
  const auto [first, second] = CellTree::halves(cell, longest);
  add_refined(first, edge_m, refined);
  add_refined(second, edge_m, refined);
}

// Corners on the piece's outline are put there exactly, so that areas add up to its own.
Vec3 on_outline(const Vec3& x, const Polygon& outline, double tolerance_m) {
  for (const Vec3& corner : outline)
    if ((corner - x).norm() < tolerance_m) return corner;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Vec3 along = outline[(k + 1) % outline.size()] - outline[k];
    const Vec3 foot = outline[k] + along.dot(x - outline[k]) / along.squaredNorm() * along;
    if ((foot - x).norm() < tolerance_m) return foot;
  }
  return x;
}

// Of the thinnest cell: area over longest extent.
double least_width_m(const std::vector<PlanePolygon>& cells) {
  double least_m = std::numeric_limits<double>::infinity();
  for (const PlanePolygon& cell : cells) {
    double twice_m2 = 0.0, extent_m = 0.0;
    for (std::size_t k = 1; k < cell.size(); ++k) {
      twice_m2 += cross(cell[k - 1] - cell[0], cell[k] - cell[0]);
      for (std::size_t j = 0; j < k; ++j) extent_m = std::max(extent_m, (cell[k] - cell[j]).norm());
    }
    least_m = std::min(least_m, 0.5 * twice_m2 / extent_m);
  }
  return least_m;
}

// The lines of a grid, of the lowest rank: elements are squares away from lines that are followed.
void add_guides(const PlanePolygon& outline, double edge_m, std::vector<RankedLine>& lines) {
  PlanePolygon q = outline;
  if (q.size() != 4) {  // its box instead
    Eigen::AlignedBox2d box;
    for (const Vec2& x : outline) box.extend(x);
    q = {box.corner(box.BottomLeft), box.corner(box.BottomRight), box.corner(box.TopRight),
         box.corner(box.TopLeft)};
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec2 &a = q[k], &b = q[k + 1], &c = q[k + 2], &d = q[(k + 3) % 4];
    const auto count = std::max(1l, std::lround(std::max((b - a).norm(), (c - d).norm()) / edge_m));
    for (long i = 1; i < count; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(count);
      lines.push_back({{(1.0 - t) * a + t * b, (1.0 - t) * d + t * c}, 0.0, false});
    }
  }
}

class Cells {
 public:
  Cells(const Scene& scene, const std::vector<std::vector<DiscontinuityLine>>& lines,
        double apart_m)
      : lines_(lines), apart_m_(apart_m) {
    for (const Surface& surface : scene.surfaces)
      for (const Polygon& polygon : surface.pieces) {
        outlines_.push_back(polygon);
        opening_.push_back(surface.is_opening);
      }
  }

  // Of each piece, following the lines that are at least this strong; edges of about `edge_m`.
  std::vector<std::vector<Polygon>> cells(double strength, double edge_m) const {
    std::vector<std::vector<Polygon>> all(outlines_.size());
    tbb::parallel_for(std::size_t{0}, outlines_.size(), [&](std::size_t p) {
      const double length_m = opening_[p] ? 2.0 * edge_m : edge_m;
      const std::vector<Polygon> faces = faces_of(p, strength, length_m);
      if (faces.empty()) all[p] = uniform_cells(outlines_[p], length_m);
      for (const Polygon& face : faces) add_refined(face, length_m, all[p]);
    });
    return all;
  }

 private:
  // None where no line is.
  std::vector<Polygon> faces_of(std::size_t p, double strength, double edge_m) const {
    const Polygon& polygon = outlines_[p];
    const PlaneFrame frame(polygon);
    PlanePolygon outline;
    for (const Vec3& v : polygon) outline.push_back(frame.flat(v));
    std::vector<RankedLine> ranked;
    for (const DiscontinuityLine& line : lines_[p])
      if (line.order == 0 || line.strength >= strength)
        ranked.push_back(
            {{frame.flat(line.from), frame.flat(line.to)}, line.strength, line.order == 0});
    if (ranked.empty()) return {};
    std::stable_sort(ranked.begin(), ranked.end(), [](const RankedLine& a, const RankedLine& b) {
      return a.must_be != b.must_be ? a.must_be : a.rank > b.rank;
    });
    const auto musts = static_cast<std::size_t>(
        std::count_if(ranked.begin(), ranked.end(), [](const auto& line) { return line.must_be; }));
    const std::size_t without_guides = ranked.size();
    add_guides(outline, edge_m, ranked);
    const double snap_m = kSnap * diameter_m(polygon);
    // Three lines that almost meet leave a splinter, whose form factors cost more than all others:
    // then without guides, then with ever fewer lines.
    for (std::size_t count = ranked.size();;) {
      ranked.resize(count);
      const auto flat =
          cells_between_lines(outline, selected_lines(outline, ranked, apart_m_), snap_m);
      if (count == musts || least_width_m(flat) > kThinnest * apart_m_)
        return in_space(flat, frame, polygon, 2.0 * snap_m);
      count = count > without_guides ? without_guides : std::max(musts, count * 3 / 4);
    }
  }

  static std::vector<Polygon> in_space(const std::vector<PlanePolygon>& cells,
                                       const PlaneFrame& frame, const Polygon& outline,
                                       double reach_m) {
    std::vector<Polygon> faces;
    for (const PlanePolygon& flat : cells) {
      Polygon& face = faces.emplace_back();
      for (const Vec2& x : flat) face.push_back(on_outline(frame.in_space(x), outline, reach_m));
    }
    return faces;
  }

  const std::vector<std::vector<DiscontinuityLine>>& lines_;
  double apart_m_;
  std::vector<Polygon> outlines_;
  std::vector<char> opening_;
};

std::size_t count_of(const std::vector<std::vector<Polygon>>& cells) {
  std::size_t count = 0;
  for (const auto& of_piece : cells) count += of_piece.size();
  return count;
}

}  // namespace

namespace {

// Every pair of a piece and a luminaire looks at every blocker, and every line they have in
// common does so a hundred times: minutes, beyond that.
constexpr std::size_t kMostLooks = 2000000;

void require_few_pairs(const Scene& scene) {
  std::size_t lamps = 0, count = 0;
  for (const Surface& surface : scene.surfaces) {
    count += surface.pieces.size();
    if (scene.material_of(surface).emits()) lamps += surface.pieces.size();
  }
  if (static_cast<double>(count) * static_cast<double>(count) * static_cast<double>(lamps) >
      static_cast<double>(kMostLooks))
    throw std::length_error("lines of " + std::to_string(lamps) + " luminaires on " +
                            std::to_string(count) +
                            " pieces of surface are too many to look for: leave out "
                            "--discontinuities");
}

}  // namespace

std::vector<std::vector<DiscontinuityLine>> lines_of_light(const Scene& scene,
                                                           const DiscontinuityOptions& options) {
  require_few_pairs(scene);
  const PatchMesh pieces = uniform_mesh(scene, scene.diameter_m());
  const Gather gather(pieces, scene, true);
  const ShaftCulling culling(pieces, scene, true);
  const LineOptions line_options{edge_for_count(scene, options.cells),
                                 mean_direct_irradiance(scene), options.least_strength};
  std::vector<std::vector<DiscontinuityLine>> lines(pieces.pieces.size());
  tbb::parallel_for(std::size_t{0}, lines.size(), [&](std::size_t p) {
    if (!scene.surfaces[pieces.pieces[p].surface].is_opening)
      lines[p] = discontinuity_lines(scene, pieces, static_cast<std::uint32_t>(p), gather, culling,
                                     line_options);
  });
  return lines;
}

namespace {

FollowedLines counted(const std::vector<std::vector<DiscontinuityLine>>& lines, double weakest) {
  FollowedLines count;
  for (const auto& of_piece : lines)
    for (const DiscontinuityLine& line : of_piece)
      ++(line.order == 0 || line.strength >= weakest ? count.of_order[line.order] : count.left_out);
  return count;
}

}  // namespace

CellTree discontinuity_cells(const Scene& scene, const DiscontinuityOptions& options,
                             FollowedLines* followed) {
  const double edge_m = edge_for_count(scene, options.cells);
  const auto lines = lines_of_light(scene, options);
  std::vector<double> strengths;
  for (const auto& of_piece : lines)
    for (const DiscontinuityLine& line : of_piece)
      if (line.order > 0) strengths.push_back(line.strength);
  std::sort(strengths.begin(), strengths.end(), std::greater<>());
  const Cells cells(scene, lines, options.apart * edge_m);
  // The strongest, as many as there is room for.
  const auto most = static_cast<std::size_t>(kShareOfLines * static_cast<double>(options.cells));
  std::size_t count = strengths.size();
  const auto weakest = [&] {
    return count > 0 ? strengths[count - 1] : std::numeric_limits<double>::infinity();
  };
  while (count > 0 && count_of(cells.cells(weakest(), scene.diameter_m())) > most)
    count = count * 3 / 4;
  if (followed) *followed = counted(lines, weakest());
  double low = std::log(0.3 * edge_m), high = std::log(4.0 * edge_m);
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (low + high);
    (count_of(cells.cells(weakest(), std::exp(middle))) > options.cells ? low : high) = middle;
  }
  return CellTree(scene, cells.cells(weakest(), std::exp(high)));
}

std::unique_ptr<Prediction> predict_along_discontinuities(const Scene& scene,
                                                          const PredictOptions& options,
                                                          FollowedLines* followed) {
  DiscontinuityOptions discontinuity;
  discontinuity.cells = std::max<std::size_t>(1, options.elements / 16);
  const CellTree cells = discontinuity_cells(scene, discontinuity, followed);
  PredictOptions on_cells = options;
  on_cells.mesh_of_grid = [&cells](int grid) { return cells.mesh(grid); };
  return std::make_unique<Prediction>(scene, on_cells);
}

}  // namespace truebox
