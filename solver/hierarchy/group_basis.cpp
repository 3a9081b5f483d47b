// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/group_basis.h"

#include "transport/legendre.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr auto kNone = static_cast<std::uint32_t>(-1);

// Index of the term with degrees (a, b), of the first kMaxTerms.
constexpr std::array<std::array<int, 4>, 4> kTermOfDegrees = [] {
  std::array<std::array<int, 4>, 4> index{};
  for (int k = 0; k < 16; ++k)
    index[static_cast<std::size_t>(kDegreesOfTerm[k][0])]
         [static_cast<std::size_t>(kDegreesOfTerm[k][1])] = k;
  return index;
}();

// Orthonormal on [-1, 1] for the mean over it.
std::array<double, 4> legendre_at(double s) {
  std::array<double, 4> values;
  legendre(0.5 * (s + 1.0), kMaxLinkDegree, values.data());
  return values;
}

// Axes of a plane that all groups in it share.
struct Axes {
  Vec3 origin, u, v;
};

Axes axes_of(const PatchMesh& mesh, const ElementTree& tree, const ElementNode& node) {
  const auto corners = mesh.corners_of(mesh.patches[tree.order[node.begin]]);
  const Vec3 u = (mesh.vertices[corners[1]] - mesh.vertices[corners[0]]).normalized();
  return {node.centre, u, node.normal.cross(u)};
}

std::array<std::array<float, 4>, 4> transfer(double offset, double scale) {
  const GaussRule& rule = gauss_rule(4);
  std::array<std::array<double, 4>, 4> sums{};
  for (std::size_t q = 0; q < 4; ++q) {
    const double s = 2.0 * rule.nodes[q] - 1.0;
    const auto child = legendre_at(s), parent = legendre_at(offset + scale * s);
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t l = 0; l <= k; ++l) sums[k][l] += rule.weights[q] * parent[k] * child[l];
  }
  std::array<std::array<float, 4>, 4> result{};
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t l = 0; l <= k; ++l) result[k][l] = static_cast<float>(sums[k][l]);
  return result;
}

FrameTransfer transfer_between(const GroupFrame& child, const GroupFrame& parent) {
  FrameTransfer result;
  if (!child.is_flat || !parent.is_flat) {
    result.u[0][0] = result.v[0][0] = 1.0f;
    return result;
  }
  const auto offset = parent.coordinates(child.centre);
  result.u = transfer(offset[0], child.half_u.norm() / parent.half_u.norm());
  result.v = transfer(offset[1], child.half_v.norm() / parent.half_v.norm());
  return result;
}

// Integrals of the basis over a polygon: quads of its fan, 4 x 4 Gauss points, exact.
void add_moments(const GroupFrame& frame, const Polygon& p, const Vec3& normal,
                 Eigen::Ref<Eigen::RowVectorXd> moments) {
  const GaussRule& rule = gauss_rule(4);
  for (std::size_t c = 1; c + 1 < p.size(); c += 2) {
    const std::array<Vec3, 4> q = {p[0], p[c], p[c + 1], c + 2 < p.size() ? p[c + 2] : p[0]};
    for (std::size_t k = 0; k < 16; ++k) {
      const double x = rule.nodes[k % 4], y = rule.nodes[k / 4];
      const Vec3 at = (1 - y) * ((1 - x) * q[0] + x * q[1]) + y * ((1 - x) * q[3] + x * q[2]);
      const Vec3 dx = (1 - y) * (q[1] - q[0]) + y * (q[2] - q[3]);
      const Vec3 dy = (1 - x) * (q[3] - q[0]) + x * (q[2] - q[1]);
      const double weight = rule.weights[k % 4] * rule.weights[k / 4] * normal.dot(dx.cross(dy));
      const auto st = frame.coordinates(at);
      const auto ps = legendre_at(st[0]), pt = legendre_at(st[1]);
      for (Eigen::Index t = 0; t < kMaxTerms; ++t) {
        const auto [a, b] = kDegreesOfTerm[static_cast<std::size_t>(t)];
        moments[t] += weight * ps[static_cast<std::size_t>(a)] * pt[static_cast<std::size_t>(b)];
      }
    }
  }
}

// Calls `use` with a term of the parent, one of the child, and the factor between them.
template <class Use>
void for_each_factor(const FrameTransfer& t, int degree, const Use& use) {
  for (int k = 0; k < terms_of(degree); ++k) {
    const auto a = static_cast<std::size_t>(kDegreesOfTerm[static_cast<std::size_t>(k)][0]);
    const auto b = static_cast<std::size_t>(kDegreesOfTerm[static_cast<std::size_t>(k)][1]);
    for (std::size_t c = 0; c <= a; ++c)
      for (std::size_t d = 0; d <= b; ++d)
        use(k, kTermOfDegrees[c][d],
            static_cast<double>(t.u[a][c]) * static_cast<double>(t.v[b][d]));
  }
}

}  // namespace

std::array<double, 2> GroupFrame::coordinates(const Vec3& point) const {
  const Vec3 d = point - centre;
  return {d.dot(half_u) / half_u.squaredNorm(), d.dot(half_v) / half_v.squaredNorm()};
}

GroupBasis::GroupBasis(const PatchMesh& mesh, ElementTree made)
    : tree(std::move(made)), frames(tree.nodes.size()), to_parent(tree.nodes.size()) {
  const std::size_t count = tree.nodes.size();
  std::vector<std::uint32_t> axes_at(count, kNone), parent(count, kNone);
  std::vector<Axes> axes;
  for (std::size_t k = 0; k < count; ++k) {
    const ElementNode& node = tree.nodes[k];
    if (node.is_flat && axes_at[k] == kNone) {
      axes_at[k] = static_cast<std::uint32_t>(axes.size());
      axes.push_back(axes_of(mesh, tree, node));
    }
    if (node.is_leaf()) continue;
    parent[node.left] = parent[node.right] = static_cast<std::uint32_t>(k);
    axes_at[node.left] = axes_at[node.right] = axes_at[k];
  }
  std::vector<Eigen::AlignedBox2d> boxes(count);
  for (std::size_t k = count; k-- > 0;) {
    const ElementNode& node = tree.nodes[k];
    if (axes_at[k] == kNone) continue;
    const Axes& at = axes[axes_at[k]];
    if (node.is_leaf())
      for (std::uint32_t c : mesh.corners_of(mesh.patches[tree.order[node.begin]])) {
        const Vec3 d = mesh.vertices[c] - at.origin;
        boxes[k].extend(Eigen::Vector2d(at.u.dot(d), at.v.dot(d)));
      }
    else
      boxes[k] = boxes[node.left].merged(boxes[node.right]);
    const Eigen::Vector2d middle = boxes[k].center(), half = 0.5 * boxes[k].sizes();
    frames[k] = {at.origin + middle.x() * at.u + middle.y() * at.v, half.x() * at.u,
                 half.y() * at.v, true};
  }
  for (std::size_t k = 1; k < count; ++k)
    to_parent[k] = transfer_between(frames[k], frames[parent[k]]);
  moments_m2 = BandMatrix::Zero(static_cast<Eigen::Index>(mesh.size()), kMaxTerms);
  Polygon polygon;
  for (std::uint32_t patch : tree.order) {
    const GroupFrame& frame = frames[tree.leaf_of[patch]];
    moments_m2(patch, 0) = mesh.patches[patch].area_m2;
    if (!frame.is_flat) continue;
    moments_m2(patch, 0) = 0.0;
    mesh.polygon_of(mesh.patches[patch], polygon);
    add_moments(frame, polygon, mesh.plane_of(mesh.patches[patch]).normal, moments_m2.row(patch));
  }
}

template <int Width>
void GroupBasis::push(std::size_t child, int degree, const double* of_child,
                      double* of_parent) const {
  for_each_factor(to_parent[child], degree, [&](int parent_term, int child_term, double factor) {
    for (int i = 0; i < Width; ++i)
      of_parent[parent_term * Width + i] += factor * of_child[child_term * Width + i];
  });
}

template <int Width>
void GroupBasis::pull(std::size_t child, int degree, const double* of_parent,
                      double* of_child) const {
  for_each_factor(to_parent[child], degree, [&](int parent_term, int child_term, double factor) {
    for (int i = 0; i < Width; ++i)
      of_child[child_term * Width + i] += factor * of_parent[parent_term * Width + i];
  });
}

template void GroupBasis::push<1>(std::size_t, int, const double*, double*) const;
template void GroupBasis::push<2>(std::size_t, int, const double*, double*) const;
template void GroupBasis::push<4>(std::size_t, int, const double*, double*) const;
template void GroupBasis::push<8>(std::size_t, int, const double*, double*) const;
template void GroupBasis::pull<1>(std::size_t, int, const double*, double*) const;
template void GroupBasis::pull<2>(std::size_t, int, const double*, double*) const;
template void GroupBasis::pull<4>(std::size_t, int, const double*, double*) const;
template void GroupBasis::pull<8>(std::size_t, int, const double*, double*) const;

std::size_t GroupBasis::bytes() const {
  return tree.nodes.size() * (sizeof(ElementNode) + sizeof(GroupFrame) + sizeof(FrameTransfer)) +
         static_cast<std::size_t>(moments_m2.size()) * sizeof(double);
}

}  // namespace truebox
