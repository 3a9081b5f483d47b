// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/scene_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr int kSteps = 256;  // along an edge, to find its length in the picture

double distance_px(PixelPosition a, PixelPosition b) {
  return std::hypot(a.x_px - b.x_px, a.y_px - b.y_px);
}

}  // namespace

std::vector<EdgeSample> cleared(const std::vector<EdgeSample>& samples, double clearance_px) {
  constexpr double kSame_px = 0.25;
  std::vector<EdgeSample> kept;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    bool clear = true;
    for (std::size_t j = 0; j < samples.size() && clear; ++j) {
      const EdgeSample &a = samples[i], &b = samples[j];
      if (a.edge == b.edge) continue;
      const double dx = b.position.x_px - a.position.x_px, dy = b.position.y_px - a.position.y_px;
      const double across = std::abs(dx * a.normal[0] + dy * a.normal[1]);
      const double along = std::abs(dx * a.normal[1] - dy * a.normal[0]);
      if (along > a.half_length_px + b.half_length_px) continue;
      const bool parallel = std::abs(a.normal[0] * b.normal[1] - a.normal[1] * b.normal[0]) < 0.01;
      if (parallel && across < kSame_px)
        clear = a.edge < b.edge;
      else if (across < clearance_px && along < a.half_length_px + clearance_px)
        clear = false;
    }
    if (clear) kept.push_back(samples[i]);
  }
  return kept;
}

SceneEdges::SceneEdges(const Scene& scene) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  std::vector<TriangleGroup> groups(scene.surfaces.size());
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    names_.push_back(surface.name);
    if (surface.is_opening) continue;
    for (const Polygon& piece : surface.pieces) {
      for (const Triangle& triangle : fan(piece)) groups[s].triangles.push_back(triangle);
      for (const Vec3& vertex : piece) {
        low = low.cwiseMin(vertex);
        high = high.cwiseMax(vertex);
      }
    }
  }
  if (!(low[0] <= high[0])) throw InputError(scene.path, 0, "a scene with surfaces", "none");
  diagonal_m_ = (high - low).norm();
  centre_m_ = 0.5 * (low + high);
  rays_ = std::make_unique<TriangleRays>(groups);
  const double same_m = 1e-6 * diagonal_m_;
  const auto same = [&](const Vec3& a, const Vec3& b) { return (a - b).norm() < same_m; };
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    if (scene.surfaces[s].is_opening) continue;
    for (const Polygon& piece : scene.surfaces[s].pieces)
      for (std::size_t k = 0; k < piece.size(); ++k) {
        const Vec3 &a = piece[k], &b = piece[(k + 1) % piece.size()];
        if (same(a, b)) continue;
        auto found = std::find_if(edges_.begin(), edges_.end(), [&](const SceneEdge& e) {
          return (same(a, e.from_m) && same(b, e.to_m)) || (same(b, e.from_m) && same(a, e.to_m));
        });
        if (found == edges_.end()) found = edges_.insert(edges_.end(), SceneEdge{a, b, {}});
        if (std::find(found->surfaces.begin(), found->surfaces.end(), s) == found->surfaces.end())
          found->surfaces.push_back(s);
      }
  }
}

std::string SceneEdges::surface_name(int surface) const {
  return surface < 0 ? "nothing" : names_[static_cast<std::size_t>(surface)];
}

std::string SceneEdges::border_name(const EdgeSample& sample) const {
  std::string a = surface_name(sample.sides[0]), b = surface_name(sample.sides[1]);
  if (b < a) std::swap(a, b);
  return a + "/" + b;
}

SceneEdges::Probe SceneEdges::probe(const Camera& camera, PixelPosition position) const {
  const auto ray = camera.ray(position);
  if (!ray) return {};
  const auto hit = rays_->first_hit(ray->origin_m, ray->direction, 1);
  if (!hit) return {};
  return {static_cast<int>(hit->group), hit->distance_m};
}

void SceneEdges::sample(std::size_t index, const Camera& camera, const EdgeSampling& sampling,
                        std::vector<EdgeSample>& samples) const {
  const SceneEdge& edge = edges_[index];
  const auto point = [&](double t) -> Vec3 { return edge.from_m + t * (edge.to_m - edge.from_m); };
  const auto on_film = [&](PixelPosition p) {
    const double m = sampling.margin_px;
    return p.x_px > -m && p.y_px > -m && p.x_px < camera.width_px() + m &&
           p.y_px < camera.height_px() + m;
  };
  // Length along the picture up to each step; pieces off the film or behind the camera have none.
  std::vector<double> lengths(kSteps + 1, 0.0);
  auto last = camera.project(point(0.0));
  for (int i = 1; i <= kSteps; ++i) {
    const auto next = camera.project(point(double(i) / kSteps));
    const bool seen = last.outcome == LensOutcome::ok && next.outcome == LensOutcome::ok &&
                      (on_film(last.position) || on_film(next.position));
    const auto k = static_cast<std::size_t>(i);
    lengths[k] = lengths[k - 1] + (seen ? distance_px(last.position, next.position) : 0.0);
    last = next;
  }
  const auto count = static_cast<int>(lengths.back() / sampling.spacing_px);
  if (count < 1) return;
  const double spacing_px = lengths.back() / count;
  for (int n = 0; n < count; ++n) {
    const double target = (n + 0.5) * spacing_px;
    const auto step = static_cast<std::size_t>(
        std::upper_bound(lengths.begin(), lengths.end(), target) - lengths.begin());
    const double share = (target - lengths[step - 1]) / (lengths[step] - lengths[step - 1]);
    const double t = (static_cast<double>(step) - 1.0 + share) / kSteps;
    EdgeSample s;
    s.edge = index;
    s.point_m = point(t);
    s.half_length_px = 0.5 * spacing_px;
    const auto here = camera.project(s.point_m);
    const auto before = camera.project(point(t - 0.25 / kSteps));
    const auto after = camera.project(point(t + 0.25 / kSteps));
    if (here.outcome != LensOutcome::ok || before.outcome != LensOutcome::ok ||
        after.outcome != LensOutcome::ok || !on_film(here.position))
      continue;
    const double length = distance_px(before.position, after.position);
    if (!(length > 0.0)) continue;
    s.position = here.position;
    s.normal = {-(after.position.y_px - before.position.y_px) / length,
                (after.position.x_px - before.position.x_px) / length};
    const double d = sampling.probe_px;
    const Probe sides[] = {
        probe(camera, {here.position.x_px - d * s.normal[0], here.position.y_px - d * s.normal[1]}),
        probe(camera,
              {here.position.x_px + d * s.normal[0], here.position.y_px + d * s.normal[1]})};
    if (sides[0].surface == sides[1].surface) continue;
    const double here_m = camera.camera_from_world(s.point_m).norm();
    bool own = false;
    for (const Probe& side : sides)
      for (const std::size_t surface : edge.surfaces)
        // A ray that far off meets its surface nearer or farther where that is steep.
        own |= side.surface == static_cast<int>(surface) &&
               std::abs(side.distance_m - here_m) < 0.02 * here_m;
    if (!own) continue;
    s.sides = {sides[0].surface, sides[1].surface};
    samples.push_back(s);
  }
}

std::vector<EdgeSample> SceneEdges::visible(const Camera& camera,
                                            const EdgeSampling& sampling) const {
  std::vector<EdgeSample> samples;
  for (std::size_t e = 0; e < edges_.size(); ++e) sample(e, camera, sampling, samples);
  return sampling.clearance_px > 0.0 ? cleared(samples, sampling.clearance_px) : samples;
}

}  // namespace truebox
