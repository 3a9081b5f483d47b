// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/visibility.h"

namespace truebox {

std::uint64_t hash(std::uint64_t x);       ///< splitmix64 (Steele et al. 2014)
double unit_interval(std::uint64_t bits);  ///< the upper 53 bits as a number in [0, 1)

/// A point of a convex polygon, uniform for uniform (u, v): a triangle of the fan by area, then the
/// square-root map.
Vec3 sample_polygon(const Polygon& polygon, double u, double v);

/// Whether an element whose row of form factors is (nearly) empty lies under another surface: one
/// of opposite normal lies on it, or all of many cosine-distributed rays meet backs of surfaces.
bool is_buried(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
               std::size_t patch);

/// One flag an element, 0 where it is buried, from rays alone: that of `is_buried`, and eight
/// cosine-distributed ones that meet no lit side either. For methods that need to know before they
/// have rows.
std::vector<char> usable_patches(const PatchMesh& mesh, const Scene& scene,
                                 const Visibility& visibility, std::uint64_t seed);

/// Row sums below this share of the area make an element ask `is_buried`.
inline constexpr double kEmptyRow = 1e-4;
/// The same where rows are exact: at a block's outline what lies under it sees slivers.
inline constexpr double kNearlyEmptyRow = 0.1;
/// Exact rows of a closed scene that miss 1 by more than this are wrong for another reason than
/// their visibility's quadrature: they are not scaled.
inline constexpr double kUnmendableRow = 0.1;

/// Whether an element lies partly under another surface: its row lacks some of 1 in a closed scene,
/// and a surface crosses it. What its row sums to is then the area that is free, m^2: the element
/// counts with that, radiosity and irradiance are those of the free part.
bool is_partly_covered(const PatchMesh& mesh, const Scene& scene, std::size_t patch,
                       double row_sum);

/// One flag an element: usable, not partly covered, and its row not empty. Those are what can tell
/// whether the scene is closed: parts of a sunken block look out from below the floor.
std::vector<char> whole_patches(const PatchMesh& mesh, const Scene& scene,
                                const std::vector<char>& usable, const Eigen::VectorXd& row_sums);

/// What is free of an element of an open scene, whose row tells nothing of that, m^2: by `is_free`
/// at 32 x 32 points where a surface crosses it, to 2 % of its area, though no less than its row
/// sums to; all of it elsewhere.
double free_area_in_open_m2(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                            std::size_t patch, double row_sum_m2);

/// Whether a point of an element is free: one of 16 rays meets a lit side, and no surface of
/// opposite normal lies on it. Inside a solid and below a floor none does; what faces nothing but
/// backs and the dark outside counts as covered too: no light comes from there.
bool is_free(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
             std::size_t patch, const Vec3& point);

/// Cosine-distributed rays, 16 from every usable element: the scene is closed if none escapes.
struct ClosureTest {
  bool closed = false;
  std::size_t rays = 0;
};
ClosureTest test_closure(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                         const std::vector<char>& usable, std::uint64_t seed);
/// The same of the elements from `begin` to before `end` only.
ClosureTest test_closure(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                         const std::vector<char>& usable, std::uint64_t seed, std::size_t begin,
                         std::size_t end);

}  // namespace truebox
