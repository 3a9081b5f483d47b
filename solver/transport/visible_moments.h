// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/polynomial_element.h"
#include "transport/visible_parts.h"

namespace truebox {

/// Moments of polynomial elements where other surfaces may stand between them: from every point the
/// source's visible part is exact (VisibleParts), and the kernel times each polynomial is
/// integrated over that part alone. As functions of the receiver's point these have kinks where
/// shadows begin: the receiver's rule decides how well they are met, not the polynomials' degree.
class VisibleMoments {
 public:
  VisibleMoments(const PatchMesh& mesh, const Scene& scene);

  /// Surfaces that may come between the two: an empty answer is certain.
  std::vector<const Blocker*> between(const PolynomialElement& i, const PolynomialElement& j) const;

  /// sum[f] += 1/pi int V cos_x cos_y / r^2 phi_f(y) dA_y from a point of the receiver.
  void add_gathered(const Vec3& point, const Vec3& normal, const PolynomialElement& source,
                    const std::vector<const Blocker*>& between, double* sum) const;

  /// As exchange_moments, V included: the smaller element receives, on parts with Gauss points.
  Eigen::MatrixXd exchange(const PolynomialElement& i, const PolynomialElement& j,
                           const std::vector<const Blocker*>& between) const;

 private:
  std::vector<Blocker> blockers_;
  double tolerance_m_ = 0.0;
};

/// Whether all of b lies in front of a's plane, and all of a in front of b's.
bool faces_wholly(const PolynomialElement& a, const PolynomialElement& b);

}  // namespace truebox
