// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "hierarchy/group_samples.h"
#include "radiometry/progress.h"
#include "transport/form_factor.h"
#include "transport/found_exchange.h"

namespace truebox {

/// Two groups of elements that exchange light as if the kernel between them were constant:
/// S_ij = kernel A_i A_j for every i in a and j in b, and the same from b to a.
struct Link {
  std::uint32_t a = 0, b = 0;  ///< into ElementTree::nodes
  float kernel_per_m2 = 0.0f;
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
  /// Touching elements to 1e-4 by contour integrals, a hundred times slower than Lambert's formula
  /// from 4 x 4 points, which is good to about 1e-2 there.
  bool accurate_elements = false;
  int rays = 16;  ///< of a pair of elements that something may stand between
  std::uint64_t seed = 1;
  std::size_t most_links = std::size_t{1} << 31;
  Progress progress;
};

struct Links {
  std::vector<Link> links;
  std::size_t tried = 0, hidden = 0, sampled = 0, rays = 0;
  double sum_of_squares = 0.0;  ///< of the errors of all links, as in LinkOptions
};

/// Links between all groups that see each other, at the level at which what they leave out is
/// small: brightness times form-factor error (BF refinement), the receiver's spread and the spread
/// of the source's own radiosity apart. Shafts drop groups that one blocker hides and spare rays
/// where nothing is between; otherwise rays between points of the groups give the visible share.
/// Elements that are not grouped take the accurate kernel times their visible share.
/// std::length_error if there are more than most_links.
/// Sources: Hanrahan, Salzman & Aupperle (1991); Lischinski, Smits & Greenberg (1994), error of a
/// link; Haines & Wallace (1994), shafts.
class LinkRefinement {
 public:
  /// All must outlive this.
  LinkRefinement(const PatchMesh& mesh, const Visibility& visibility, const ElementTree& tree,
                 const ShaftCulling& culling, std::uint64_t seed);

  Links refine(const NodeLight& light, const LinkOptions& options) const;

 private:
  class Walk;
  struct Pair {
    std::uint32_t a, b;
  };

  const Visibility& visibility_;
  const ElementTree& tree_;
  const ShaftCulling& culling_;
  std::vector<GroupSamples> samples_;
  std::vector<PlanarPolygon> polygons_;
};

}  // namespace truebox
