// SPDX-License-Identifier: BSD-3-Clause
#include "adaptive/adapt_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "adaptive/cell_errors.h"
#include "discontinuity/discontinuity_mesh.h"

namespace truebox {
namespace {

constexpr double kGrowth = 1.7;    // of the cells, a solve
constexpr double kFirstShare = 8;  // of the cells asked for, in the first mesh
constexpr std::size_t kBands = 6;

// Evenly spread over those that need solving and are lit.
Scene in_a_few_bands(const Scene& scene, const Requirements& needs) {
  std::vector<std::size_t> lit;
  for (std::size_t b : needs.distinct_bands)
    if (std::any_of(scene.materials.begin(), scene.materials.end(),
                    [&](const Material& m) { return m.exitance[b] > 0.0; }))
      lit.push_back(b);
  if (lit.empty()) lit = needs.distinct_bands;
  std::vector<std::size_t> chosen;
  const std::size_t count = std::min(kBands, lit.size());
  for (std::size_t k = 0; k < count; ++k)
    chosen.push_back(lit[(2 * k + 1) * lit.size() / (2 * count)]);
  return in_bands(scene, chosen);
}

CellTree first_cells(const Scene& scene, std::size_t count, bool discontinuities,
                     FollowedLines& lines) {
  if (!discontinuities) return CellTree(scene, edge_for_count(scene, count));
  DiscontinuityOptions options;
  options.cells = count;
  return discontinuity_cells(scene, options, &lines);
}

}  // namespace

AdaptedMesh adapt_mesh(const Scene& scene, const AdaptOptions& options) {
  const Requirements needs = requirements(scene);
  const Scene few = in_a_few_bands(scene, needs);
  const auto first = static_cast<std::size_t>(static_cast<double>(options.cells) / kFirstShare);
  FollowedLines lines;
  CellTree cells =
      first_cells(scene, std::max<std::size_t>(1, first), options.discontinuities, lines);
  AdaptedMesh result{cells, cells, {}, lines};
  if (!needs.interreflection) return result;
  std::mt19937_64 random(options.seed);
  while (cells.size() < options.cells) {
    const auto errors = cell_errors(cells, few, needs, options.goal, options.form_factors, random);
    double square = 0.0;
    for (const CellError& e : errors) square += e.square;
    result.steps.push_back({cells.size(), std::sqrt(square)});
    std::vector<std::size_t> order(errors.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto gain = [&](std::size_t i) { return errors[i].square - errors[i].halved_square; };
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return gain(a) > gain(b); });
    const auto wanted = static_cast<std::size_t>(kGrowth * static_cast<double>(cells.size())) + 1;
    const std::size_t before = cells.size();
    for (std::size_t i : order) {
      if (cells.size() >= std::min(wanted, options.cells) || !(gain(i) > 0.0)) break;
      cells.halve(i, errors[i].direction);
      if (4 * cells.size() <= options.cells) result.coarse = cells;
    }
    if (cells.size() == before) break;  // nothing left to gain
  }
  result.fine = cells;
  return result;
}

}  // namespace truebox
