// SPDX-License-Identifier: BSD-3-Clause
#include "adaptive/goal.h"

#include <cmath>
#include <stdexcept>

#include "transport/visibility.h"

namespace truebox {
namespace {

using Eigen::Index;

// Errors of what is darker than this share of the mean count as if it were not.
constexpr double kDarkest = 1e-2;

}  // namespace

Goal image_goal(const Scene& scene, const Camera& camera, int rays) {
  const PatchMesh pieces = uniform_mesh(scene, scene.diameter_m());
  const Visibility visibility(pieces, scene);
  Goal goal{Goal::Kind::image, {}, 0};
  const double step_px =
      std::sqrt(static_cast<double>(camera.width_px()) * camera.height_px() / std::max(1, rays));
  for (double y = 0.5 * step_px; y < camera.height_px(); y += step_px)
    for (double x = 0.5 * step_px; x < camera.width_px(); x += step_px) {
      const auto ray = camera.ray({x, y});
      if (!ray) continue;
      const auto hit = visibility.first_hit(ray->origin_m, ray->direction);
      if (hit && hit->front) goal.points.push_back({hit->piece, hit->point});
    }
  if (goal.points.empty()) throw std::invalid_argument("the camera sees no lit surface");
  return goal;
}

Goal goal_of_name(const std::string& name, const Scene& scene) {
  if (name == "everywhere") return {};
  std::string choices = "everywhere";
  for (const auto& [camera, description] : scene.cameras) {
    if (name == "camera:" + camera) return image_goal(scene, Camera(description));
    choices += ", camera:" + camera;
  }
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    if (scene.surfaces[s].is_opening) continue;
    if (name == "surface:" + scene.surfaces[s].name) return {Goal::Kind::surface, {}, s};
    choices += ", surface:" + scene.surfaces[s].name;
  }
  throw std::invalid_argument("nothing is named \"" + name + "\" here; there is " + choices);
}

Eigen::VectorXd field_weights(const Goal& goal, const PatchMesh& mesh,
                              const std::vector<char>& counts, const SmoothField& places) {
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(static_cast<Index>(mesh.size()));
  if (goal.kind == Goal::Kind::everywhere) {
    for (std::size_t i = 0; i < mesh.size(); ++i)
      if (counts[i]) weight[static_cast<Index>(i)] = mesh.patches[i].area_m2;
  } else if (goal.kind == Goal::Kind::image) {
    for (const Goal::Point& point : goal.points) {
      const std::uint32_t i = places.find_patch(point.piece, point.position_m);
      if (counts[i]) weight[i] += 1.0;
    }
  }
  const double sum = weight.sum();
  return sum > 0.0 ? Eigen::VectorXd(weight / sum) : weight;
}

BandMatrix inverse_irradiance(const PatchMesh& mesh, const std::vector<char>& counts,
                              const BandMatrix& irradiance) {
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(irradiance.cols());
  double lit_m2 = 0.0;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (!counts[i]) continue;
    mean += mesh.patches[i].area_m2 * irradiance.row(static_cast<Index>(i));
    lit_m2 += mesh.patches[i].area_m2;
  }
  BandMatrix inverse = BandMatrix::Zero(irradiance.rows(), irradiance.cols());
  if (lit_m2 == 0.0) return inverse;
  mean *= kDarkest / lit_m2;
  for (Index i = 0; i < inverse.rows(); ++i)
    for (Index b = 0; b < inverse.cols(); ++b)
      if (counts[static_cast<std::size_t>(i)] && mean[b] > 0.0)
        inverse(i, b) = 1.0 / std::max(mean[b], irradiance(i, b));
  return inverse;
}

BandMatrix dual_source(const Goal& goal, const PatchMesh& mesh, const std::vector<char>& counts,
                       const BandMatrix& irradiance, const SmoothField& places,
                       std::mt19937_64& random) {
  const Index bands = irradiance.cols();
  BandMatrix q = BandMatrix::Zero(irradiance.rows(), bands);
  if (goal.kind == Goal::Kind::surface) {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(bands);
    const auto is_in = [&](std::size_t i) {
      return counts[i] && mesh.surface_of(mesh.patches[i]) == goal.surface;
    };
    for (std::size_t i = 0; i < mesh.size(); ++i)
      if (is_in(i)) sum += mesh.patches[i].area_m2 * irradiance.row(static_cast<Index>(i));
    for (std::size_t i = 0; i < mesh.size(); ++i)
      if (is_in(i))
        q.row(static_cast<Index>(i)) = (sum.array() > 0.0).select(sum.array().inverse(), 0.0);
    return q;
  }
  const BandMatrix relative = inverse_irradiance(mesh, counts, irradiance);
  const Eigen::VectorXd weight = field_weights(goal, mesh, counts, places);
  for (Index i = 0; i < q.rows(); ++i)
    for (Index b = 0; b < bands; ++b)
      q(i, b) = ((random() >> 63) != 0 ? 1.0 : -1.0) * std::sqrt(weight[i]) * relative(i, b) /
                mesh.patches[static_cast<std::size_t>(i)].area_m2;
  return q;
}

}  // namespace truebox
