// SPDX-License-Identifier: BSD-3-Clause
#include "transport/element_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace truebox {
namespace {

constexpr double kNormalsDiffer = 0.3;     // of a component: a group turns by less than 20 degrees
constexpr double kOneNormal = 1e-9;        // difference of unit vectors that is rounding
constexpr double kEverythingAhead = -1.0;  // offset of a plane without normal: all is in front

class Builder {
 public:
  Builder(const PatchMesh& mesh, ElementTree& tree) : mesh_(mesh), tree_(tree) {}

  std::uint32_t build(std::uint32_t begin, std::uint32_t end) {
    const auto index = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes.emplace_back(summarised(begin, end));
    if (end - begin == 1) {
      tree_.leaf_of[tree_.order[begin]] = index;
      return index;
    }
    const std::uint32_t middle = split(begin, end);
    const std::uint32_t left = build(begin, middle), right = build(middle, end);
    tree_.nodes[index].left = left;
    tree_.nodes[index].right = right;
    return index;
  }

 private:
  const Patch& patch(std::uint32_t place) const { return mesh_.patches[tree_.order[place]]; }
  const Vec3& normal(std::uint32_t place) const { return mesh_.plane_of(patch(place)).normal; }

  ElementNode summarised(std::uint32_t begin, std::uint32_t end) const {
    ElementNode node;
    node.begin = begin;
    node.end = end;
    Vec3 weighted = Vec3::Zero();
    for (std::uint32_t k = begin; k < end; ++k) {
      const double area = patch(k).area_m2;
      node.area_m2 += area;
      node.centre += area * patch(k).centroid;
      weighted += area * normal(k);
      for (std::uint32_t v : mesh_.corners_of(patch(k))) node.box.extend(mesh_.vertices[v]);
    }
    node.centre /= node.area_m2;
    node.normal = weighted.norm() > 0.0 ? Vec3(weighted.normalized()) : normal(begin);
    node.one_normal = true;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::uint32_t k = begin; k < end && node.one_normal; ++k) {
      node.one_normal = (normal(k) - node.normal).norm() < kOneNormal;
      for (std::uint32_t v : mesh_.corners_of(patch(k))) {
        const double height = node.normal.dot(mesh_.vertices[v]);
        low = std::min(low, height);
        high = std::max(high, height);
      }
    }
    node.horizon =
        node.one_normal ? Plane{node.normal, low} : Plane{Vec3::Zero(), kEverythingAhead};
    node.is_flat = node.one_normal && high - low < 1e-7 * node.box.diagonal().norm();
    find_corners(node);
    for (std::uint32_t c = 0; c < node.corner_count; ++c)
      node.radius_m = std::max(node.radius_m, (node.corners[c] - node.centre).norm());
    return node;
  }

  void find_corners(ElementNode& node) const {
    if (!node.is_flat) {
      for (std::uint32_t c = 0; c < 8; ++c)
        node.corners[c] = node.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(c));
      node.corner_count = 8;
      return;
    }
    const auto corners = mesh_.corners_of(patch(node.begin));
    if (node.end - node.begin == 1 && corners.size() <= node.corners.size()) {
      for (std::uint32_t v : corners) node.corners[node.corner_count++] = mesh_.vertices[v];
      return;
    }
    const Vec3 u = (mesh_.vertices[corners[1]] - mesh_.vertices[corners[0]]).normalized();
    const Vec3 v = node.normal.cross(u);
    Eigen::AlignedBox2d in_plane;
    for (std::uint32_t k = node.begin; k < node.end; ++k)
      for (std::uint32_t c : mesh_.corners_of(patch(k))) {
        const Vec3 from_centre = mesh_.vertices[c] - node.centre;
        in_plane.extend(Eigen::Vector2d(u.dot(from_centre), v.dot(from_centre)));
      }
    const auto at = [&](double x, double y) -> Vec3 { return node.centre + x * u + y * v; };
    node.corners[0] = at(in_plane.min().x(), in_plane.min().y());
    node.corners[1] = at(in_plane.max().x(), in_plane.min().y());
    node.corners[2] = at(in_plane.max().x(), in_plane.max().y());
    node.corners[3] = at(in_plane.min().x(), in_plane.max().y());
    node.corner_count = 4;
  }

  // Halves the longest side of the centroids' box, or of the normals' where they differ.
  std::uint32_t split(std::uint32_t begin, std::uint32_t end) {
    Eigen::AlignedBox3d places, normals;
    for (std::uint32_t k = begin; k < end; ++k) {
      places.extend(patch(k).centroid);
      normals.extend(normal(k));
    }
    const bool by_normal = normals.sizes().maxCoeff() > kNormalsDiffer;
    const Eigen::AlignedBox3d& box = by_normal ? normals : places;
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const double middle = box.center()[axis];
    const auto coordinate = [&](std::uint32_t p) {
      return by_normal ? mesh_.plane_of(mesh_.patches[p]).normal[axis]
                       : mesh_.patches[p].centroid[axis];
    };
    const auto first = tree_.order.begin() + begin, last = tree_.order.begin() + end;
    auto cut =
        std::stable_partition(first, last, [&](std::uint32_t p) { return coordinate(p) < middle; });
    if (cut == first || cut == last) cut = first + (last - first) / 2;  // all in one place
    return static_cast<std::uint32_t>(cut - tree_.order.begin());
  }

  const PatchMesh& mesh_;
  ElementTree& tree_;
};

}  // namespace

ElementTree element_tree(const PatchMesh& mesh, std::vector<std::uint32_t> patches) {
  ElementTree tree;
  tree.order = std::move(patches);
  tree.leaf_of.assign(mesh.size(), 0);
  tree.nodes.reserve(2 * tree.order.size());
  Builder(mesh, tree).build(0, static_cast<std::uint32_t>(tree.order.size()));
  return tree;
}

ElementTree element_tree(const PatchMesh& mesh) {
  std::vector<std::uint32_t> all(mesh.size());
  std::iota(all.begin(), all.end(), 0u);
  return element_tree(mesh, std::move(all));
}

}  // namespace truebox
