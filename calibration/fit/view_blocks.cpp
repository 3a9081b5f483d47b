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

/// What every pixel's centre sees.
class Look {
 public:
  Look(const Scene& scene, const PatchMesh& mesh, const Camera& camera)
      : mesh_(mesh), camera_(camera), visibility_(mesh, scene) {
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x) {
        Visibility::Hit hit;
        surface_.push_back(surface_at(x + 0.5, y + 0.5, hit));
        hit_.push_back(hit);
      }
  }

  int width() const { return camera_.width_px(); }
  int height() const { return camera_.height_px(); }
  std::uint32_t index(int x, int y) const {
    return static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(width()) +
           static_cast<std::uint32_t>(x);
  }
  bool is_inside(int x, int y) const { return x >= 0 && y >= 0 && x < width() && y < height(); }
  int surface(int x, int y) const { return surface_[index(x, y)]; }
  const Visibility::Hit& hit(std::uint32_t i) const { return hit_[i]; }

  /// Whether the neighbours within the margin, and the pixel's corners pushed outwards by it, see
  /// the same surface. Beyond the picture's own rim the corners look where the margin would.
  bool is_whole(int x, int y, int margin_px) const {
    const int surface = surface_[index(x, y)];
    for (int v = y - margin_px; v <= y + margin_px; ++v)
      for (int u = x - margin_px; u <= x + margin_px; ++u)
        if (is_inside(u, v) && surface_[index(u, v)] != surface) return false;
    const double out = std::min(margin_px, 1);
    Visibility::Hit unused;
    for (const double dx : {-out, 1.0 + out})
      for (const double dy : {-out, 1.0 + out})
        if (surface_at(x + dx, y + dy, unused) != surface) return false;
    return true;
  }

 private:
  int surface_at(double x, double y, Visibility::Hit& hit) const {
    const auto ray = camera_.ray({x, y});
    if (!ray) return kNothing;
    const auto found = visibility_.first_hit(ray->origin_m, ray->direction);
    if (!found || !found->front) return kNothing;
    hit = *found;
    return static_cast<int>(mesh_.pieces[found->piece].surface);
  }

  const PatchMesh& mesh_;
  const Camera& camera_;
  Visibility visibility_;
  std::vector<int> surface_;  // of each pixel's centre; kNothing where no lit surface is
  std::vector<Visibility::Hit> hit_;
};

/// Whether an edge runs through the tile or along its rim, and nothing but lit surfaces is near.
bool holds_edge(const Look& look, const PixelRectangle& tile, int margin_px) {
  const auto [left, top, width, height] = tile;
  const int reach = std::max(1, margin_px), first = look.surface(left, top);
  bool mixed = false;
  for (int y = top - reach; y < top + height + reach; ++y)
    for (int x = left - reach; x < left + width + reach; ++x) {
      if (!look.is_inside(x, y) || look.surface(x, y) == kNothing) return false;
      const bool is_near = x >= left - 1 && y >= top - 1 && x <= left + width && y <= top + height;
      mixed = mixed || (is_near && look.surface(x, y) != first);
    }
  return mixed;
}

}  // namespace

PixelWindows pixel_windows(const Scene& scene, const PatchMesh& mesh,
                           const std::vector<char>& usable, const Camera& camera,
                           const PixelWindowOptions& options) {
  const Look look(scene, mesh, camera);
  const SmoothField finder(mesh, usable,
                           BandMatrix::Zero(static_cast<Eigen::Index>(mesh.size()), 1));
  PixelWindows result;
  result.pixels_of_surface.assign(scene.surfaces.size(), 0);
  std::vector<char> in_tile(
      static_cast<std::size_t>(look.width()) * static_cast<std::size_t>(look.height()), 0);
  std::vector<PixelWindow> tiles;
  const auto uses = [&](int x, int y) { return !options.uses || options.uses(x, y); };
  for (int top = 0; options.tile_px > 0 && top < look.height(); top += options.tile_px)
    for (int left = 0; left < look.width(); left += options.tile_px) {
      const PixelRectangle tile{left, top, std::min(options.tile_px, look.width() - left),
                                std::min(options.tile_px, look.height() - top)};
      if (!holds_edge(look, tile, options.margin_px)) continue;
      PixelWindow window;
      for (int y = top; y < top + tile[3]; ++y)
        for (int x = left; x < left + tile[2]; ++x) {
          in_tile[look.index(x, y)] = 1;
          if (!uses(x, y)) continue;
          window.pixels.push_back(look.index(x, y));
          if (options.uses) window.mixed.push_back({x, y, 1, 1});
        }
      if (!options.uses) window.mixed = {tile};
      if (!window.pixels.empty()) tiles.push_back(std::move(window));
    }
  std::map<std::uint32_t, PixelWindow> by_element;
  for (int y = 0; y < look.height(); ++y)
    for (int x = 0; x < look.width(); ++x) {
      const std::uint32_t i = look.index(x, y);
      const int surface = look.surface(x, y);
      if (surface == kNothing) continue;
      ++result.pixels_of_surface[static_cast<std::size_t>(surface)];
      if (!uses(x, y) || in_tile[i] || !look.is_whole(x, y, options.margin_px)) continue;
      const std::uint32_t element = finder.find_patch(look.hit(i).piece, look.hit(i).point);
      if (!usable[element]) continue;
      by_element[element].piece = look.hit(i).piece;
      by_element[element].pixels.push_back(i);
    }
  for (auto& [element, window] : by_element) result.windows.push_back(std::move(window));
  for (PixelWindow& tile : tiles) result.windows.push_back(std::move(tile));
  return result;
}

PixelBlock seen_piece(const PatchMesh& mesh, const Camera& camera, const PixelWindow& window,
                      int samples) {
  const Plane& plane = mesh.pieces[window.piece].plane;
  const auto width = static_cast<std::uint32_t>(camera.width_px());
  PixelBlock block;
  block.piece = window.piece;
  std::vector<Vec3> points;
  for (const std::uint32_t i : window.pixels) {
    const auto ray = camera.ray({i % width + 0.5, i / width + 0.5});
    if (!ray) continue;
    const double t = -plane.distance_m(ray->origin_m) / plane.normal.dot(ray->direction);
    points.push_back(ray->origin_m + t * ray->direction);
    block.eye = ray->origin_m;
  }
  for (const Vec3& p : points) block.centre += p / static_cast<double>(points.size());
  const std::size_t n = std::min(points.size(), static_cast<std::size_t>(samples));
  for (std::size_t k = 0; k < n; ++k)  // evenly through the list: rows, and columns within rows
    block.points.push_back(points[(2 * k + 1) * points.size() / (2 * n)]);
  return block;
}

SampledMean mean_over_block(const PixelBlock& block, const Eigen::VectorXd& values) {
  const Eigen::Index n = values.size();
  if (!block.weights.empty()) {
    const Eigen::Map<const Eigen::VectorXd> w(block.weights.data(), n);
    const double mean = w.dot(values);
    const double variance = w.dot((values.array() - mean).square().matrix());
    return {mean, std::sqrt(variance / static_cast<double>(n))};
  }
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
