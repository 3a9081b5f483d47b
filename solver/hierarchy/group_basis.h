// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "mesh/smooth_field.h"
#include "transport/element_tree.h"

namespace truebox {

/// Polynomials of two variables up to this total degree live on flat groups.
inline constexpr int kMaxLinkDegree = 3;
inline constexpr int terms_of(int degree) { return (degree + 1) * (degree + 2) / 2; }
inline constexpr int kMaxTerms = terms_of(kMaxLinkDegree);

/// Degrees (in s, in t) of each basis function, by total degree: those of a lower degree are a
/// prefix. The last six complete the 4 x 4 products: they are left out, and say what that costs.
inline constexpr std::array<std::array<int, 2>, 16> kDegreesOfTerm = {{{0, 0},
                                                                       {1, 0},
                                                                       {0, 1},
                                                                       {2, 0},
                                                                       {1, 1},
                                                                       {0, 2},
                                                                       {3, 0},
                                                                       {2, 1},
                                                                       {1, 2},
                                                                       {0, 3},
                                                                       {3, 1},
                                                                       {2, 2},
                                                                       {1, 3},
                                                                       {3, 2},
                                                                       {2, 3},
                                                                       {3, 3}}};

/// The rectangle about a flat group: points are centre + s half_u + t half_v, s and t in [-1, 1].
struct GroupFrame {
  Vec3 centre = Vec3::Zero(), half_u = Vec3::Zero(), half_v = Vec3::Zero();  ///< m
  bool is_flat = false;  ///< else the group has the constant only

  std::array<double, 2> coordinates(const Vec3& point) const;
};

/// Basis functions of a parent in those of its child, direction by direction, exact: the two
/// rectangles have the same axes, so that a polynomial of the parent is one of the child.
///   P_k(s of the parent) = sum_l u[k][l] P_l(s of the child), l <= k.
struct FrameTransfer {
  std::array<std::array<float, 4>, 4> u{}, v{};
};

/// A tree of elements with polynomials on its flat groups, nested:
///   phi_k(x) = P_a(s) P_b(t), total degree <= kMaxLinkDegree; phi_0 = 1,
/// P_a Legendre polynomials, orthonormal for the mean over [-1, 1].
/// Source: Gortler, Schroeder, Cohen & Hanrahan (1993), wavelet radiosity; Hackbusch & Boerm
/// (2002), nested bases.
struct GroupBasis {
  ElementTree tree;
  std::vector<GroupFrame> frames;        ///< one a node
  std::vector<FrameTransfer> to_parent;  ///< one a node; nothing but phi_0 where either is not flat
  BandMatrix moments_m2;                 ///< integrals of phi over each patch, in its leaf's frame

  GroupBasis(const PatchMesh& mesh, ElementTree made);

  /// parent += what the child's moments (or values) are in the parent's basis, for the terms of
  /// `degree` and Width numbers each: 1, 2, 4 or 8.
  template <int Width>
  void push(std::size_t child, int degree, const double* of_child, double* of_parent) const;
  /// The transpose: child += what the parent's coefficients are in the child's basis.
  template <int Width>
  void pull(std::size_t child, int degree, const double* of_parent, double* of_child) const;

  std::size_t bytes() const;
};

}  // namespace truebox
