// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "rays/triangle_rays.h"
#include "scene/scene.h"
#include "sensor/camera.h"

namespace truebox {

/// An open box of 2 m with a cube that stands in it, turned; the camera looks in along +z.
inline Scene test_box() {
  Scene scene;
  scene.materials.resize(1);
  const auto add = [&](const std::string& name, std::vector<Vec3> outline) {
    Surface surface;
    surface.name = name;
    surface.pieces = {std::move(outline)};
    scene.surfaces.push_back(std::move(surface));
  };
  add("floor", {{-1, 0, 0}, {-1, 0, 2}, {1, 0, 2}, {1, 0, 0}});
  add("ceiling", {{-1, 2, 0}, {1, 2, 0}, {1, 2, 2}, {-1, 2, 2}});
  add("back", {{-1, 0, 2}, {-1, 2, 2}, {1, 2, 2}, {1, 0, 2}});
  add("right", {{-1, 0, 0}, {-1, 2, 0}, {-1, 2, 2}, {-1, 0, 2}});
  add("left", {{1, 0, 0}, {1, 0, 2}, {1, 2, 2}, {1, 2, 0}});
  const double c = 0.35 * std::cos(0.5), s = 0.35 * std::sin(0.5);
  const Vec3 corner[] = {
      {0.3 + c, 0, 1.1 + s}, {0.3 - s, 0, 1.1 + c}, {0.3 - c, 0, 1.1 - s}, {0.3 + s, 0, 1.1 - c}};
  const Vec3 up(0, 0.6, 0);
  add("cube top", {corner[3] + up, corner[2] + up, corner[1] + up, corner[0] + up});
  for (int k = 0; k < 4; ++k) {
    const Vec3 &a = corner[k], &b = corner[(k + 1) % 4];
    add("cube side " + std::to_string(k), {a, b, b + up, a + up});
  }
  return scene;
}

inline CameraDescription test_camera(int width = 480, int height = 400) {
  CameraDescription camera;
  camera.position_m = {0.15, 1.1, -3.0};
  camera.direction = Vec3(-0.03, -0.02, 1.0);
  camera.up = Vec3(0.02, 1.0, 0.0);
  camera.film_m = {0.024, 0.024 * height / width};
  camera.focal_length_m = 0.030;
  camera.pixels = {width, height};
  return camera;
}

/// Light of a surface at a point; surface -1 is what lies beyond the scene.
using Shade = std::function<double(int surface, const Vec3& point)>;

/// Each surface its own grey, evenly.
inline double even_shade(int surface, const Vec3&) {
  static const double kGrey[] = {0.55, 0.75, 0.65, 0.25, 0.40, 0.85, 0.30, 0.50, 0.20, 0.60};
  return surface < 0 ? 0.05 : kGrey[surface % 10];
}

/// The picture a camera takes of a scene, every pixel the mean over its square: one ray where its
/// corners and centre see one surface, else `samples` low-discrepancy ones (Roberts' R2 sequence,
/// shifted by pixel). Simulated, and without any solution of light transport.
inline Image edge_picture(const Scene& scene, const CameraDescription& description,
                          const Shade& shade, double noise, std::uint64_t seed, int samples = 256) {
  const Camera camera(description);
  std::vector<TriangleGroup> groups(scene.surfaces.size());
  for (std::size_t s = 0; s < groups.size(); ++s)
    for (const Polygon& piece : scene.surfaces[s].pieces)
      for (const Triangle& t : fan(piece)) groups[s].triangles.push_back(t);
  const TriangleRays rays(groups);
  struct Seen {
    int surface = -1;
    double light = 0.0;
  };
  const auto look = [&](double x, double y) -> Seen {
    const auto ray = camera.ray({x, y});
    const auto hit = ray ? rays.first_hit(ray->origin_m, ray->direction, 1) : std::nullopt;
    if (!hit) return {-1, shade(-1, Vec3::Zero())};
    const int surface = static_cast<int>(hit->group);
    return {surface, shade(surface, ray->origin_m + hit->distance_m * ray->direction)};
  };
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const int w = camera.width_px(), h = camera.height_px();
  std::vector<int> corners(static_cast<std::size_t>((w + 1) * (h + 1)));
  for (int y = 0; y <= h; ++y)
    for (int x = 0; x <= w; ++x)
      corners[static_cast<std::size_t>(y * (w + 1) + x)] = look(x, y).surface;
  Image image(w, h);
  auto& out = image.add_channel("Y").samples;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const Seen centre = look(x + 0.5, y + 0.5);
      const auto k = static_cast<std::size_t>(y * (w + 1) + x);
      double light = centre.light;
      const auto row = static_cast<std::size_t>(w + 1);
      if (corners[k] != centre.surface || corners[k + 1] != centre.surface ||
          corners[k + row] != centre.surface || corners[k + row + 1] != centre.surface) {
        double u = uniform(random), v = uniform(random), sum = 0.0;
        for (int i = 0; i < samples; ++i) {
          u = std::fmod(u + 0.7548776662466927, 1.0);
          v = std::fmod(v + 0.5698402909980532, 1.0);
          sum += look(x + u, y + v).light;
        }
        light = sum / samples;
      }
      out[image.index(x, y)] = static_cast<float>(light + noise * normal(random));
    }
  return image;
}

/// The picture with white noise.
inline Image noisy(const Image& exact, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Image image = exact;
  for (float& v : image.channels[0].samples) v += static_cast<float>(noise * normal(random));
  return image;
}

/// Root mean square distance in the picture between where two cameras see a scene's corners.
inline double corner_error_px(const Scene& scene, const CameraDescription& a,
                              const CameraDescription& b) {
  double sum = 0.0, n = 0.0;
  const Camera first(a), second(b);
  for (const Surface& surface : scene.surfaces)
    for (const Vec3& v : surface.pieces[0]) {
      const auto p = first.project(v), q = second.project(v);
      if (p.outcome != LensOutcome::ok || q.outcome != LensOutcome::ok) continue;
      sum += std::pow(p.position.x_px - q.position.x_px, 2) +
             std::pow(p.position.y_px - q.position.y_px, 2);
      n += 1.0;
    }
  return std::sqrt(sum / n);
}

}  // namespace truebox
