// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "mesh/patch_mesh.h"

namespace truebox {

inline bool is_contact(const PatchMesh& mesh, std::uint32_t patch, const Vec3& a, const Vec3& b) {
  for (const ContactLine& line : mesh.pieces[mesh.patches[patch].piece].contacts) {
    const Vec3 along = (line.to - line.from).normalized();
    const auto distance_m = [&](const Vec3& x) { return along.cross(x - line.from).norm(); };
    if (distance_m(a) < 1e-9 && distance_m(b) < 1e-9) return true;
  }
  return false;
}

// Walks along every edge that an element has with its neighbours, just inside on either side: the
// largest jump between what the two say, relative to the field's size.
template <class Field>
double worst_crack(const PatchMesh& mesh, const Field& field, std::size_t& edges_walked) {
  double worst = 0.0;
  edges_walked = 0;
  Eigen::VectorXd here(1), there(1);
  const auto walk = [&](std::uint32_t p, std::uint32_t q, const Vec3& a, const Vec3& b) {
    ++edges_walked;
    for (int k = 1; k < 8; ++k) {
      const Vec3 x = a + k / 8.0 * (b - a);
      field.evaluate(p, x, here);
      field.evaluate(q, x, there);
      worst = std::max(worst, std::abs(here[0] - there[0]));
    }
  };
  for (std::uint32_t p = 0; p < mesh.size(); ++p)
    for (std::uint32_t q = 0; q < mesh.size(); ++q) {
      if (p == q || mesh.patches[p].piece != mesh.patches[q].piece) continue;
      // An edge of p that lies in an edge of q, whole; across contact lines jumps are wanted.
      const auto of_p = mesh.corners_of(mesh.patches[p]), of_q = mesh.corners_of(mesh.patches[q]);
      for (std::size_t k = 0; k < of_p.size(); ++k)
        for (std::size_t l = 0; l < of_q.size(); ++l) {
          const Vec3 &a = mesh.vertices[of_p[k]], &b = mesh.vertices[of_p[(k + 1) % of_p.size()]];
          const Vec3 &c = mesh.vertices[of_q[l]], &d = mesh.vertices[of_q[(l + 1) % of_q.size()]];
          const Vec3 along = (d - c).normalized();
          const auto lies_on = [&](const Vec3& x) {
            const double t = along.dot(x - c);
            return t > -1e-9 && t < (d - c).norm() + 1e-9 && (x - c - t * along).norm() < 1e-9;
          };
          if (lies_on(a) && lies_on(b) && !is_contact(mesh, p, a, b)) walk(p, q, a, b);
        }
    }
  return worst;
}

}  // namespace truebox
