// SPDX-License-Identifier: BSD-3-Clause
#include "export/solution_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace truebox {
namespace {

using Eigen::VectorXd;

struct CornerValue {
  VectorXd radiosity, error_bound;
};

// Values at the corners of all elements, in the order of mesh.corners.
std::vector<CornerValue> corner_values(const Prediction& prediction) {
  const PatchMesh& mesh = prediction.fine().mesh;
  const Scene& scene = prediction.scene();
  const auto bands = static_cast<Eigen::Index>(scene.bands.size());
  std::vector<CornerValue> values(mesh.corners.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.size()), [&](const auto& range) {
    Gather::Scratch scratch;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Patch& patch = mesh.patches[i];
      const Surface& surface = scene.surfaces[mesh.surface_of(patch)];
      if (surface.is_opening || !prediction.fine().usable[i]) continue;
      const Material& material = scene.material_of(surface);
      const Eigen::Map<const VectorXd> rho(material.reflectance.values.data(), bands);
      const Eigen::Map<const VectorXd> own(material.exitance.values.data(), bands);
      for (std::uint32_t k = 0; k < patch.corner_count; ++k) {
        const std::size_t c = patch.first_corner + k;
        const Vec3& corner = mesh.vertices[mesh.corners[c]];
        const BoundedIrradiance light = prediction.irradiance_on(
            patch.piece, corner + 1e-3 * (patch.centroid - corner), scratch);
        values[c] = {own + rho.cwiseProduct(light.value), rho.cwiseProduct(light.error_bound)};
      }
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
  const std::vector<CornerValue> values = corner_values(prediction);
  SolutionSurface result;
  std::vector<std::vector<std::uint32_t>> vertices_at(mesh.vertices.size());
  std::vector<std::size_t> corner_of;  // of each vertex, the corner whose value it carries
  std::vector<std::uint32_t> outline;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const Patch& patch = mesh.patches[i];
    if (values[patch.first_corner].radiosity.size() == 0) continue;
    outline.clear();
    for (std::uint32_t k = 0; k < patch.corner_count; ++k) {
      const std::size_t c = patch.first_corner + k;
      auto& candidates = vertices_at[mesh.corners[c]];
      const auto shared = std::find_if(candidates.begin(), candidates.end(), [&](std::uint32_t v) {
        return continuous(values[corner_of[v]], values[c]);
      });
      if (shared != candidates.end()) {
        outline.push_back(*shared);
        continue;
      }
      outline.push_back(static_cast<std::uint32_t>(corner_of.size()));
      candidates.push_back(outline.back());
      corner_of.push_back(c);
      result.positions_m.push_back(mesh.vertices[mesh.corners[c]]);
    }
    for (std::size_t k = 0; k < outline.size(); ++k) {
      result.outlines.insert(result.outlines.end(),
                             {outline[k], outline[(k + 1) % outline.size()]});
      if (k < 2) continue;
      result.triangles.insert(result.triangles.end(), {outline[0], outline[k - 1], outline[k]});
      result.surface.push_back(static_cast<std::uint32_t>(mesh.surface_of(patch)));
    }
  }
  const auto rows = static_cast<Eigen::Index>(corner_of.size());
  const auto bands = static_cast<Eigen::Index>(prediction.scene().bands.size());
  result.radiosity.resize(rows, bands);
  result.error_bound.resize(rows, bands);
  for (Eigen::Index v = 0; v < rows; ++v) {
    const CornerValue& value = values[corner_of[static_cast<std::size_t>(v)]];
    result.radiosity.row(v) = value.radiosity.transpose();
    result.error_bound.row(v) = value.error_bound.transpose();
  }
  return result;
}

}  // namespace truebox
