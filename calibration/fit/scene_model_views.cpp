// SPDX-License-Identifier: BSD-3-Clause
// What cameras and other readers see of a scene model.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "fit/gloss_lobe.h"
#include "fit/scene_model.h"

namespace truebox {

using Eigen::Index;

std::size_t SceneModel::add_view(const CameraDescription& camera,
                                 const std::function<bool(int x, int y)>& uses) {
  PixelWindowOptions how;
  how.margin_px = options_.margin_px;
  how.tile_px = options_.tile_px;
  how.uses = uses;
  return add_windows(camera,
                     pixel_windows(lamp_scene_, mesh_, factors_.usable, Camera(camera), how));
}

std::size_t SceneModel::add_windows(const CameraDescription& camera, PixelWindows windows) {
  std::vector<ViewBlock> seen = see(camera, views(), windows.windows);
  blocks_.insert(blocks_.end(), std::make_move_iterator(seen.begin()),
                 std::make_move_iterator(seen.end()));
  pixels_of_surface_.push_back(windows.pixels_of_surface);
  windows_.push_back(std::move(windows));
  return views() - 1;
}

void SceneModel::clear_views() {
  blocks_.clear();
  windows_.clear();
  pixels_of_surface_.clear();
}

void SceneModel::move_views(const std::vector<CameraDescription>& cameras) {
  std::vector<ViewBlock> all;
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    std::vector<ViewBlock> seen = see(cameras[v], v, windows_[v].windows);
    std::move(seen.begin(), seen.end(), std::back_inserter(all));
  }
  blocks_ = std::move(all);
}

std::vector<ViewBlock> SceneModel::see(const CameraDescription& description, std::size_t view,
                                       const std::vector<PixelWindow>& windows) const {
  const Camera camera(description);
  Gather::Scratch scratch;
  std::vector<ViewBlock> all;
  for (const PixelWindow& window : windows) {
    if (options_.progress && all.size() % 64 == 0)
      options_.progress("light at the pixels",
                        static_cast<double>(all.size()) / static_cast<double>(windows.size()));
    ViewBlock block{
        .view = view, .pixels = window.pixels, .parts = {}, .is_mixed = window.is_mixed()};
    const auto seen =
        window.is_mixed()
            ? seen_pieces(mesh_, lamp_scene_, camera, window)
            : std::vector<PixelBlock>{seen_piece(mesh_, camera, window, options_.samples)};
    for (const PixelBlock& piece : seen) block.parts.push_back(part_of(piece, scratch));
    if (!seen.empty()) {
      block.element = finder_->find_patch(seen.front().piece, seen.front().centre);
      block.surface = block.parts.front().surface;
    }
    all.push_back(std::move(block));
  }
  return all;
}

double ViewBlock::sampling_u() const {
  double light = 0.0, sum = 0.0;
  for (const ViewPart& p : parts) {
    light += p.share * p.direct.sum();
    sum += std::pow(p.share * p.direct.sum() * p.sampling_u, 2);
  }
  return light > 0.0 ? std::sqrt(sum) / light : 0.0;
}

ViewPart SceneModel::part_of(const PixelBlock& pixels, Gather::Scratch& scratch) const {
  ViewPart part{.surface = mesh_.pieces[pixels.piece].surface,
                .share = pixels.share,
                .direct = {},
                .weights = {},
                .gloss = {}};
  const Vec3& normal = mesh_.pieces[pixels.piece].plane.normal;
  const auto n = static_cast<Index>(pixels.points.size());
  BandMatrix light = BandMatrix::Zero(n, direct_.cols());
  Eigen::VectorXd at_point(direct_.cols());
  for (Index k = 0; k < n; ++k) {
    at_point.setZero();
    gather_->add_direct(pixels.points[static_cast<std::size_t>(k)], normal, at_point, scratch);
    light.row(k) = at_point.transpose();
  }
  part.direct = Eigen::VectorXd::Zero(direct_.cols());
  for (Index l = 0; l < direct_.cols(); ++l)
    part.direct[l] = mean_over_block(pixels, light.col(l)).value;
  const SampledMean all = mean_over_block(pixels, light.rowwise().sum());
  part.sampling_u = all.value > 0.0 ? all.standard_uncertainty / all.value : 0.0;
  if (pixels.weights.empty() && options_.tile_px == 0) {
    // Nothing moves: the element's own plane, which jumps between elements and is the more exact.
    part.weights = plane_weights(finder_->find_patch(pixels.piece, pixels.centre), pixels.centre);
  } else if (pixels.weights.empty()) {
    part.weights = field_weights(pixels.piece, pixels.centre);
  } else {
    for (std::size_t k = 0; k < pixels.points.size(); ++k)
      for (const auto& [element, weight] : field_weights(pixels.piece, pixels.points[k]))
        part.weights.emplace_back(element, pixels.weights[k] * weight);
  }
  const std::size_t material = material_of(part);
  if (material < options_.roughness.size() && options_.roughness[material] > 0.0)
    part.gloss = gloss_of(pixels, GlossLobe(options_.roughness[material]), mesh_, lamp_scene_,
                          *gather_, scratch);
  return part;
}

std::size_t SceneModel::add_elements() {
  pixels_of_surface_.emplace_back(scene_->surfaces.size(), 0);
  windows_.emplace_back();
  for (std::uint32_t i = 0; i < mesh_.size(); ++i) {
    const std::size_t s = mesh_.surface_of(mesh_.patches[i]);
    if (!factors_.usable[i] || scene_->surfaces[s].is_opening ||
        scene_->material_of(scene_->surfaces[s]).emits())
      continue;
    ++pixels_of_surface_.back()[s];
    blocks_.push_back({.view = views() - 1,
                       .element = i,
                       .surface = s,
                       .pixels = {},
                       .parts = {{.surface = s,
                                  .direct = direct_.row(static_cast<Index>(i)).transpose(),
                                  .weights = {{i, 1.0}},
                                  .gloss = {}}}});
  }
  return views() - 1;
}

std::size_t SceneModel::add_surface_means() {
  pixels_of_surface_.emplace_back(scene_->surfaces.size(), 0);
  windows_.emplace_back();
  for (std::size_t s = 0; s < scene_->surfaces.size(); ++s) {
    ViewBlock block{.view = views() - 1, .surface = s, .pixels = {}, .parts = {}};
    ViewPart part{
        .surface = s, .direct = Eigen::VectorXd::Zero(direct_.cols()), .weights = {}, .gloss = {}};
    double area = 0.0;
    for (std::uint32_t i = 0; i < mesh_.size(); ++i) {
      if (!factors_.usable[i] || mesh_.surface_of(mesh_.patches[i]) != s) continue;
      if (part.weights.empty()) block.element = i;
      part.weights.emplace_back(i, mesh_.patches[i].area_m2);
      part.direct += mesh_.patches[i].area_m2 * direct_.row(static_cast<Index>(i)).transpose();
      area += mesh_.patches[i].area_m2;
    }
    if (scene_->surfaces[s].is_opening || area <= 0.0) continue;
    for (auto& [element, weight] : part.weights) weight /= area;
    part.direct /= area;
    block.parts.push_back(std::move(part));
    ++pixels_of_surface_.back()[s];
    blocks_.push_back(std::move(block));
  }
  return views() - 1;
}

// I(x) = I_i + grad . (x - c_i), the gradient by least squares over the neighbours across an edge,
// as in finite volumes: second order in the element size. Source: Barth (1991), AIAA 91-0278.
std::vector<std::pair<std::uint32_t, double>> SceneModel::plane_weights(std::uint32_t element,
                                                                        const Vec3& at) const {
  const auto& around = neighbours_[element];
  const Patch& patch = mesh_.patches[element];
  const Vec3& normal = mesh_.plane_of(patch).normal;
  const Vec3 axis_u = normal.unitOrthogonal(), axis_v = normal.cross(axis_u);
  Eigen::MatrixX2d offsets(static_cast<Index>(around.size()), 2);
  for (Index k = 0; k < offsets.rows(); ++k) {
    const Vec3 d = mesh_.patches[around[static_cast<std::size_t>(k)]].centroid - patch.centroid;
    offsets.row(k) << d.dot(axis_u), d.dot(axis_v);
  }
  std::vector<std::pair<std::uint32_t, double>> weights{{element, 1.0}};
  const Eigen::Matrix2d normal_matrix = offsets.transpose() * offsets;
  const double trace = normal_matrix.trace();
  // Neighbours on one line give no gradient across it.
  if (around.size() < 2 || normal_matrix.determinant() < 1e-3 * trace * trace) return weights;
  const Eigen::Vector2d step((at - patch.centroid).dot(axis_u), (at - patch.centroid).dot(axis_v));
  const Eigen::VectorXd share = offsets * normal_matrix.inverse() * step;
  for (Index k = 0; k < share.size(); ++k) {
    weights.emplace_back(around[static_cast<std::size_t>(k)], share[k]);
    weights[0].second -= share[k];
  }
  return weights;
}

// Continuous where elements meet: sum_c lambda_c(x) times the mean of the planes of the elements
// about corner c, lambda_c Wachspress coordinates (1975) of x in its element. A camera that moves
// by a fraction of a pixel must not change the light by more than a fraction.
std::vector<std::pair<std::uint32_t, double>> SceneModel::field_weights(std::uint32_t piece,
                                                                        const Vec3& at) const {
  const std::uint32_t element = finder_->find_patch(piece, at);
  const auto corners = mesh_.corners_of(mesh_.patches[element]);
  const Vec3& normal = mesh_.plane_of(mesh_.patches[element]).normal;
  const std::size_t n = corners.size();
  const auto corner = [&](std::size_t k) -> const Vec3& { return mesh_.vertices[corners[k % n]]; };
  const auto area = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    return std::max(0.0, normal.dot((b - a).cross(c - a)));
  };
  std::vector<double> share(n);
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    share[k] = area(corner(k + n - 1), corner(k), corner(k + 1));
    for (std::size_t j = 0; j < n; ++j)
      if (j != k && j != (k + n - 1) % n) share[k] *= area(at, corner(j), corner(j + 1));
    sum += share[k];
  }
  if (!(sum > 0.0)) return plane_weights(element, at);
  std::map<std::uint32_t, double> planes;  // element -> how much its plane counts
  for (std::size_t k = 0; k < n; ++k) {
    const auto& around = elements_of_corner_[corners[k]];
    for (const std::uint32_t e : around)
      planes[e] += share[k] / (sum * static_cast<double>(around.size()));
  }
  std::map<std::uint32_t, double> all;
  for (const auto& [e, of_plane] : planes)
    for (const auto& [source, weight] : plane_weights(e, at)) all[source] += of_plane * weight;
  return {all.begin(), all.end()};
}

}  // namespace truebox
