// SPDX-License-Identifier: BSD-3-Clause
#include "export/solution_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "mesh/hanging_vertices.h"

namespace truebox {
namespace {

using Eigen::VectorXd;

struct CornerValue {
  VectorXd radiosity, error_bound;
};

constexpr std::uint32_t kCentre = 0xffffffffu;

// Where an element's value is wanted: at its corners and at those of its neighbours, on other walls
// as well, that hang in its edges, in order; then at its centre if any hang there, for triangles
// around it.
struct Place {
  std::uint32_t patch, vertex;  // into PatchMesh::vertices, or kCentre
};

std::vector<Place> places_of(const PatchMesh& mesh, const std::vector<char>& is_shown) {
  const Seams between = seams(mesh, is_shown);
  std::vector<std::vector<HangingVertex>> hanging(mesh.size());
  for (const HangingVertex& h : between.hanging) hanging[h.patch].push_back(h);
  std::vector<Place> places;
  for (std::uint32_t i = 0; i < mesh.size(); ++i) {
    if (!is_shown[i]) continue;
    const auto corners = mesh.corners_of(mesh.patches[i]);
    for (std::uint32_t k = 0; k < corners.size(); ++k) {
      places.push_back({i, between.places[corners[k]]});
      for (const HangingVertex& h : hanging[i])
        if (h.corner == k) places.push_back({i, h.vertex});
    }
    if (!hanging[i].empty()) places.push_back({i, kCentre});
  }
  return places;
}

Vec3 position_m(const PatchMesh& mesh, const Place& place) {
  return place.vertex == kCentre ? mesh.patches[place.patch].centroid : mesh.vertices[place.vertex];
}

std::vector<CornerValue> values_at(const Prediction& prediction, const std::vector<Place>& places) {
  const PatchMesh& mesh = prediction.fine().mesh;
  const Scene& scene = prediction.scene();
  const auto bands = static_cast<Eigen::Index>(scene.bands.size());
  std::vector<CornerValue> values(places.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size()), [&](const auto& range) {
    Gather::Scratch scratch;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Patch& patch = mesh.patches[places[i].patch];
      const Material& material = scene.material_of(scene.surfaces[mesh.surface_of(patch)]);
      const Eigen::Map<const VectorXd> rho(material.reflectance.values.data(), bands);
      const Eigen::Map<const VectorXd> own(material.exitance.values.data(), bands);
      const Vec3 x = position_m(mesh, places[i]);
      const BoundedIrradiance light =
          prediction.irradiance_on(patch.piece, x + 1e-3 * (patch.centroid - x), scratch);
      values[i] = {own + rho.cwiseProduct(light.value), rho.cwiseProduct(light.error_bound)};
    }
  });
  return values;
}

// Continuous if no band differs by more than 2 % of the largest: the corners are looked at a
// thousandth of an element inside, so that a smooth field differs by far less.
bool continuous(const CornerValue& a, const CornerValue& b) {
  const double size = std::max(a.radiosity.maxCoeff(), b.radiosity.maxCoeff());
  return (a.radiosity - b.radiosity).cwiseAbs().maxCoeff() <= 0.02 * size;
}

}  // namespace

SolutionSurface solution_surface(const Prediction& prediction) {
  const PatchMesh& mesh = prediction.fine().mesh;
  std::vector<char> is_shown = prediction.fine().usable;
  for (std::size_t i = 0; i < mesh.size(); ++i)
    is_shown[i] &= !prediction.scene().surfaces[mesh.surface_of(mesh.patches[i])].is_opening;
  const std::vector<Place> places = places_of(mesh, is_shown);
  const std::vector<CornerValue> values = values_at(prediction, places);
  SolutionSurface result;
  // Walls that meet share the place of a vertex, not the vertex.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> vertices_at;
  std::vector<std::size_t> place_of;  // of each vertex, the place whose value it carries
  const auto vertex_of = [&](std::size_t p) {
    const auto added = static_cast<std::uint32_t>(place_of.size());
    if (places[p].vertex != kCentre) {
      auto& candidates = vertices_at[{mesh.patches[places[p].patch].piece, places[p].vertex}];
      const auto shared = std::find_if(candidates.begin(), candidates.end(), [&](std::uint32_t v) {
        return continuous(values[place_of[v]], values[p]);
      });
      if (shared != candidates.end()) return *shared;
      candidates.push_back(added);
    }
    place_of.push_back(p);
    result.positions_m.push_back(position_m(mesh, places[p]));
    return added;
  };
  std::vector<std::uint32_t> outline;
  for (std::size_t p = 0; p < places.size();) {
    const std::uint32_t patch = places[p].patch;
    outline.clear();
    std::uint32_t centre = kCentre;
    for (; p < places.size() && places[p].patch == patch; ++p)
      (places[p].vertex == kCentre ? centre : outline.emplace_back()) = vertex_of(p);
    const std::size_t n = outline.size();
    for (std::size_t k = 0; k < n; ++k) {
      result.outlines.insert(result.outlines.end(), {outline[k], outline[(k + 1) % n]});
      const bool in_fan = centre == kCentre && (k == 0 || k + 1 == n);
      if (in_fan) continue;  // the edges at the fan's own corner have no triangle of their own
      result.triangles.insert(result.triangles.end(), {centre == kCentre ? outline[0] : centre,
                                                       outline[k], outline[(k + 1) % n]});
      result.surface.push_back(static_cast<std::uint32_t>(mesh.surface_of(mesh.patches[patch])));
    }
  }
  const auto rows = static_cast<Eigen::Index>(place_of.size());
  const auto bands = static_cast<Eigen::Index>(prediction.scene().bands.size());
  result.radiosity.resize(rows, bands);
  result.error_bound.resize(rows, bands);
  for (Eigen::Index v = 0; v < rows; ++v) {
    const CornerValue& value = values[place_of[static_cast<std::size_t>(v)]];
    result.radiosity.row(v) = value.radiosity.transpose();
    result.error_bound.row(v) = value.error_bound.transpose();
  }
  return result;
}

}  // namespace truebox
