// SPDX-License-Identifier: BSD-3-Clause
#include "fit/view_blocks.h"

#include <Eigen/Dense>
#include <cmath>
#include <map>

#include "mesh/smooth_field.h"
#include "transport/visibility.h"

namespace truebox {
namespace {

constexpr int kNothing = -1;

struct Seen {
  std::vector<int> surface;  // of each pixel's centre; kNothing where no lit surface is
  std::vector<Visibility::Hit> hit;
};

int surface_at(const PatchMesh& mesh, const Visibility& visibility, const Camera& camera, double x,
               double y, Visibility::Hit& hit) {
  const auto ray = camera.ray({x, y});
  if (!ray) return kNothing;
  const auto found = visibility.first_hit(ray->origin_m, ray->direction);
  if (!found || !found->front) return kNothing;
  hit = *found;
  return static_cast<int>(mesh.pieces[found->piece].surface);
}

Seen look(const PatchMesh& mesh, const Visibility& visibility, const Camera& camera) {
  Seen seen;
  for (int y = 0; y < camera.height_px(); ++y)
    for (int x = 0; x < camera.width_px(); ++x) {
      Visibility::Hit hit;
      seen.surface.push_back(surface_at(mesh, visibility, camera, x + 0.5, y + 0.5, hit));
      seen.hit.push_back(hit);
    }
  return seen;
}

/// Whether the corners of the pixel, pushed outwards by the margin, see the same surface.
bool is_whole(const PatchMesh& mesh, const Visibility& visibility, const Camera& camera, int x,
              int y, int surface, int margin_px) {
  Visibility::Hit unused;
  for (const double dx : {-static_cast<double>(margin_px), 1.0 + margin_px})
    for (const double dy : {-static_cast<double>(margin_px), 1.0 + margin_px})
      if (surface_at(mesh, visibility, camera, x + dx, y + dy, unused) != surface) return false;
  return true;
}

}  // namespace

PixelBlocks pixel_blocks(const Scene& scene, const PatchMesh& mesh, const std::vector<char>& usable,
                         const Camera& camera, const PixelBlockOptions& options) {
  const Visibility visibility(mesh, scene);
  const SmoothField finder(mesh, usable,
                           BandMatrix::Zero(static_cast<Eigen::Index>(mesh.size()), 1));
  const Seen seen = look(mesh, visibility, camera);
  const int width = camera.width_px(), height = camera.height_px();
  PixelBlocks result;
  result.pixels_of_surface.assign(scene.surfaces.size(), 0);
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_element;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(x);
      const int surface = seen.surface[i];
      if (surface == kNothing) continue;
      ++result.pixels_of_surface[static_cast<std::size_t>(surface)];
      bool inside = true;
      for (int dy = -options.margin_px; dy <= options.margin_px && inside; ++dy)
        for (int dx = -options.margin_px; dx <= options.margin_px && inside; ++dx) {
          const int u = x + dx, v = y + dy;
          if (u < 0 || v < 0 || u >= width || v >= height) continue;
          inside = seen.surface[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(u)] == surface;
        }
      // Beyond the picture's own rim the corner test looks where the margin would.
      if (!inside ||
          !is_whole(mesh, visibility, camera, x, y, surface, std::min(options.margin_px, 1)))
        continue;
      const std::uint32_t element = finder.find_patch(seen.hit[i].piece, seen.hit[i].point);
      if (usable[element]) by_element[element].push_back(static_cast<std::uint32_t>(i));
    }
  for (auto& [element, pixels] : by_element) {
    PixelBlock block{element, std::move(pixels), {}, Vec3::Zero()};
    for (const std::uint32_t i : block.pixels)
      block.centre += seen.hit[i].point / static_cast<double>(block.pixels.size());
    const std::size_t n = std::min(block.pixels.size(), static_cast<std::size_t>(options.samples));
    for (std::size_t k = 0; k < n; ++k)  // evenly through the list: rows, and columns within rows
      block.points.push_back(
          seen.hit[block.pixels[(2 * k + 1) * block.pixels.size() / (2 * n)]].point);
    result.blocks.push_back(std::move(block));
  }
  return result;
}

SampledMean mean_over_block(const PixelBlock& block, const Eigen::VectorXd& values) {
  const Eigen::Index n = values.size();
  const double mean = values.mean();
  if (n < 5) return {mean, 0.0};
  Eigen::MatrixX3d positions(n, 3);
  for (Eigen::Index k = 0; k < n; ++k)
    positions.row(k) = block.points[static_cast<std::size_t>(k)].transpose();
  const Eigen::RowVector3d middle = positions.colwise().mean();
  positions.rowwise() -= middle;
  const Eigen::VectorXd rest = values.array() - mean;
  // Points lie on a plane up to rounding: without a threshold that rounding would be a direction.
  constexpr double kFlat = 1e-6;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> fit;
  fit.setThreshold(kFlat);
  const Eigen::Vector3d slope = fit.compute(positions).solve(rest);
  const double scatter = (rest - positions * slope).norm() / std::sqrt(static_cast<double>(n - 3));
  return {mean + (block.centre.transpose() - middle).dot(slope),
          scatter / std::sqrt(static_cast<double>(n))};
}

}  // namespace truebox
