// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hierarchy/group_basis.h"
#include "hierarchy/group_samples.h"
#include "radiometry/progress.h"
#include "transport/convex_occluder.h"
#include "transport/found_exchange.h"
#include "transport/pair_kernel.h"

namespace truebox {

/// Two groups of elements that exchange light as if the kernel between them were constant:
/// S_ij = kernel A_i A_j for every i in a and j in b, and the same from b to a.
struct Link {
  std::uint32_t a = 0, b = 0;  ///< into ElementTree::nodes
  float kernel_per_m2 = 0.0f;
  float deviation_per_m2 = 0.0f;  ///< of two elements: what its visible share may be wrong by, rms
};

/// Two flat groups between which the kernel is a polynomial on either:
///   S_ij = sum_kl c_kl m_ik m_jl, m the moments of the elements in the frames of a and b.
/// The c_kl, terms_of(degree) squared, m^-2, stand in Links::coefficients_per_m2 from `first` on,
/// those of one k next to each other.
struct PolynomialLink {
  std::uint32_t a = 0, b = 0;
  std::uint32_t degree = 1;
  std::size_t first = 0;
};

/// What is known of the radiosity when links are chosen, relative to the mean irradiance of each
/// band and the worst of the bands: one value a node.
struct NodeLight {
  std::vector<double> mean, spread;
};
NodeLight node_light(const ElementTree& tree, const Eigen::VectorXd& area_m2,
                     const BandMatrix& radiosity, const Eigen::VectorXd& mean_irradiance);

struct LinkOptions {
  /// A link may leave out this share of the mean irradiance, in the root mean square over all area:
  /// error of the receiver times the root of its share of the area.
  double error_of_a_link = 1e-5;
  int most_degree = kMaxLinkDegree;  ///< of the polynomials of a link; 0: constants alone
  int rays = 16;                     ///< of a pair of elements that something may stand between
  std::uint64_t seed = 1;
  std::size_t most_bytes = std::size_t{1} << 40;  ///< of links
  Progress progress;
};

/// What a refinement looked at.
struct LinkCounts {
  std::size_t tried = 0, hidden = 0, sampled = 0, rays = 0, outlined = 0;
  double sum_of_squares = 0.0;  ///< of the errors of all links, as in LinkOptions
};

struct Links {
  std::vector<Link> links;
  std::vector<PolynomialLink> polynomial;
  std::vector<float> coefficients_per_m2;
  LinkCounts counts;

  std::size_t size() const { return links.size() + polynomial.size(); }
  std::size_t bytes() const {
    return links.size() * sizeof(Link) + polynomial.size() * sizeof(PolynomialLink) +
           coefficients_per_m2.size() * sizeof(float);
  }
  void append(Links&& other);
};

/// Links between all groups that see each other, at the level at which what they leave out is
/// small: brightness times form-factor error (BF refinement), the receiver's spread and the spread
/// of the source's own radiosity apart; between flat groups as a polynomial of the lowest degree
/// that will do. Shafts drop groups that one blocker hides, and leave the few blockers that may
/// hide a part: the visible share of a rectangle or an element is that of exact outlines from
/// points of the other: 2 x 2 of groups, both ways; of elements 3 x 3, fewer where they matter
/// little. Faces of one convex block hide together. Where blockers are many or groups no
/// rectangles, rays between their points give it. Elements take the accurate kernel times their
/// visible share. std::length_error if they take more than most_bytes. Sources: Hanrahan, Salzman &
/// Aupperle (1991); Gortler, Schroeder, Cohen & Hanrahan (1993), higher degrees; Lischinski, Smits
/// & Greenberg (1994), error of a link; Haines & Wallace (1994), shafts.
class LinkRefinement {
 public:
  /// All must outlive this. `kernel_tolerance` is relative, of a pair of elements.
  LinkRefinement(const PatchMesh& mesh, const Visibility& visibility, const GroupBasis& basis,
                 const ShaftCulling& culling, double kernel_tolerance, std::uint64_t seed);

  /// `known` are links found before, sorted by (a, b): those of single elements need not be found
  /// again.
  Links refine(const NodeLight& light, const LinkOptions& options,
               std::span<const Link> known = {}) const;

 private:
  class Walk;
  void find_solids();
  struct Pair {
    std::uint32_t a, b;
  };

  const Visibility& visibility_;
  const GroupBasis& basis_;
  const ElementTree& tree_;
  const ShaftCulling& culling_;
  std::vector<GroupSamples> samples_;
  std::vector<PlanarPolygon> polygons_;
  PairKernel kernel_;
  std::vector<Blocker> blockers_;  // one a piece
  std::vector<ConvexOccluder> solids_;
  std::vector<std::uint32_t> solid_of_piece_;  // of pieces that can block
};

}  // namespace truebox
