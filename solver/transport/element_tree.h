// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "transport/shaft_culling.h"

namespace truebox {

/// A group of elements with nearly one normal; their places may differ: part of a wall, or the
/// lids of many small boxes.
struct ElementNode {
  std::uint32_t begin = 0, end = 0;   ///< into ElementTree::order
  std::uint32_t left = 0, right = 0;  ///< into ElementTree::nodes, larger than the node's own index
  Vec3 centre = Vec3::Zero();         ///< area-weighted, m
  Vec3 normal = Vec3::UnitZ();        ///< area-weighted mean, unit
  double area_m2 = 0.0;
  double radius_m = 0.0;  ///< of the corners about the centre
  bool one_normal = false;
  bool is_flat = false;  ///< one normal, one plane
  std::uint32_t corner_count = 0;
  std::array<Vec3, 8> corners;  ///< of a rectangle about a flat group, of a box about another
  Plane horizon;
  Eigen::AlignedBox3d box;

  bool is_leaf() const { return left == 0; }
  ShaftEnd end_of_shaft() const { return {{corners.data(), corner_count}, horizon, box, is_flat}; }
};

/// A binary tree over all elements of a mesh: first by normal, then by place, halving the longest
/// side. One tree serves surfaces and clusters: a cluster's constant means the same for all of its
/// elements only where their cosines agree. Sources: Hanrahan, Salzman & Aupperle (1991); Smits,
/// Arvo & Greenberg (1994), clusters; Walter et al. (2005), trees over places and normals.
struct ElementTree {
  std::vector<ElementNode> nodes;      ///< the root first, parents before children
  std::vector<std::uint32_t> order;    ///< patches, those of a node next to each other
  std::vector<std::uint32_t> leaf_of;  ///< of each patch, into nodes

  std::span<const std::uint32_t> patches_of(const ElementNode& node) const {
    return {order.data() + node.begin, node.end - node.begin};
  }
};

/// `patches`: those to hold, all of the mesh in most cases; not empty.
ElementTree element_tree(const PatchMesh& mesh, std::vector<std::uint32_t> patches);
ElementTree element_tree(const PatchMesh& mesh);

}  // namespace truebox
