// SPDX-License-Identifier: BSD-3-Clause
#include "adaptive/goal.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "transport/visibility.h"

namespace truebox {
namespace {

using Eigen::Index;

// Errors of what is darker than this share of the mean count as if it were not.
constexpr double kDarkest = 1e-2;

bool reflects_somewhere(const Scene& scene, std::size_t material) {
  const auto& rho = scene.materials[material].reflectance.values;
  return std::any_of(rho.begin(), rho.end(), [](double r) { return r > 0.0; }) &&
         std::any_of(scene.surfaces.begin(), scene.surfaces.end(), [&](const Surface& surface) {
           return surface.material == material && !surface.is_opening;
         });
}

}  // namespace

Goal image_goal(const Scene& scene, const Camera& camera, int rays) {
  const PatchMesh pieces = uniform_mesh(scene, scene.diameter_m());
  const Visibility visibility(pieces, scene);
  Goal goal{Goal::Kind::image, {}, 0, 0};
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
  if (name == "irradiance") return {Goal::Kind::irradiance, {}, 0, 0};
  std::string choices = "everywhere, irradiance";
  for (const auto& [camera, description] : scene.cameras) {
    if (name == "camera:" + camera) return image_goal(scene, Camera(description));
    choices += ", camera:" + camera;
  }
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    if (scene.surfaces[s].is_opening) continue;
    if (name == "surface:" + scene.surfaces[s].name) return {Goal::Kind::surface, {}, s, 0};
    choices += ", surface:" + scene.surfaces[s].name;
  }
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    if (!reflects_somewhere(scene, m)) continue;
    const std::string of_material = "parameter:" + scene.materials[m].name;
    if (name != of_material && !name.starts_with(of_material + "@")) {
      choices += ", " + of_material;
      continue;
    }
    Goal goal{Goal::Kind::parameter, {}, 0, m};
    if (name == of_material) return goal;
    const auto camera = scene.cameras.find(name.substr(of_material.size() + 1));
    if (camera == scene.cameras.end()) continue;
    goal.points = image_goal(scene, Camera(camera->second)).points;
    return goal;
  }
  throw std::invalid_argument("nothing is named \"" + name + "\" here; there is " + choices);
}

namespace {

// Shares of elements in what counts, by area or by the points that are seen; they sum to 1.
Eigen::VectorXd shares_of_elements(const Goal& goal, const PatchMesh& mesh,
                                   const std::vector<char>& counts, const SmoothField& places) {
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(static_cast<Index>(mesh.size()));
  if (goal.points.empty())
    for (std::size_t i = 0; i < mesh.size(); ++i)
      if (counts[i]) weight[static_cast<Index>(i)] = mesh.patches[i].area_m2;
  for (const Goal::Point& point : goal.points) {
    const std::uint32_t i = places.find_patch(point.piece, point.position_m);
    if (counts[i]) weight[i] += 1.0;
  }
  const double sum = weight.sum();
  return sum > 0.0 ? Eigen::VectorXd(weight / sum) : weight;
}

}  // namespace

Eigen::VectorXd field_weights(const Goal& goal, const PatchMesh& mesh,
                              const std::vector<char>& counts, const SmoothField& places) {
  if (!goal.is_random()) return Eigen::VectorXd::Zero(static_cast<Index>(mesh.size()));
  return shares_of_elements(goal, mesh, counts, places);
}

BandMatrix inverse_irradiance(const Goal& goal, const PatchMesh& mesh,
                              const std::vector<char>& counts, const BandMatrix& irradiance) {
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(irradiance.cols());
  double lit_m2 = 0.0;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (!counts[i]) continue;
    mean += mesh.patches[i].area_m2 * irradiance.row(static_cast<Index>(i));
    lit_m2 += mesh.patches[i].area_m2;
  }
  BandMatrix inverse = BandMatrix::Zero(irradiance.rows(), irradiance.cols());
  if (lit_m2 == 0.0) return inverse;
  mean /= lit_m2;
  const bool is_to_mean = goal.kind == Goal::Kind::irradiance;
  for (Index i = 0; i < inverse.rows(); ++i)
    for (Index b = 0; b < inverse.cols(); ++b)
      if (counts[static_cast<std::size_t>(i)] && mean[b] > 0.0)
        inverse(i, b) =
            1.0 / (is_to_mean ? mean[b] : std::max(kDarkest * mean[b], irradiance(i, b)));
  return inverse;
}

BandMatrix dual_source(const Goal& goal, const PatchMesh& mesh, const std::vector<char>& counts,
                       const BandMatrix& irradiance, const SmoothField& places,
                       const BandMatrix& sensitivity, std::mt19937_64& random) {
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
  const BandMatrix relative = inverse_irradiance(goal, mesh, counts, irradiance);
  const Eigen::VectorXd weight = shares_of_elements(goal, mesh, counts, places);
  if (goal.kind == Goal::Kind::parameter) {
    const BandMatrix s = relative.cwiseProduct(sensitivity);
    const Eigen::RowVectorXd normal = weight.transpose() * s.cwiseAbs2();
    q = weight.asDiagonal() * s.cwiseProduct(relative);
    for (Index i = 0; i < q.rows(); ++i)
      for (Index b = 0; b < bands; ++b)
        q(i, b) = normal[b] > 0.0
                      ? q(i, b) / (normal[b] * mesh.patches[static_cast<std::size_t>(i)].area_m2)
                      : 0.0;
    return q;
  }
  for (Index i = 0; i < q.rows(); ++i)
    for (Index b = 0; b < bands; ++b)
      q(i, b) = ((random() >> 63) != 0 ? 1.0 : -1.0) * std::sqrt(weight[i]) * relative(i, b) /
                mesh.patches[static_cast<std::size_t>(i)].area_m2;
  return q;
}

}  // namespace truebox
