// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "scene/scene.h"
#include "transport/convex_occluder.h"
#include "transport/form_factor.h"
#include "transport/visible_parts.h"

namespace truebox {

/// The methods of the field, one interface.
enum class ViewFactorMethod {
  planned,           ///< for each pair of pieces the one that reaches the tolerance at least cost
  analytic,          ///< nothing between: where something may be, the bound is the whole answer
  exact_visibility,  ///< the source clipped by its blockers, adaptive on the receiver; no noise
  ray_casting,       ///< low-discrepancy rays between the two, with a standard error
  nusselt,           ///< visible parts projected to the hemisphere, then to the disc; as polygons
  hemicube,          ///< pixels of half a cube about points of one of the two
  hidden,            ///< answer of the planner: one blocker hides all
};
inline constexpr ViewFactorMethod kViewFactorMethods[] = {
    ViewFactorMethod::planned,     ViewFactorMethod::analytic, ViewFactorMethod::exact_visibility,
    ViewFactorMethod::ray_casting, ViewFactorMethod::nusselt,  ViewFactorMethod::hemicube};

/// "planned", "analytic", "exact-visibility", "ray-casting", "nusselt", "hemicube", "hidden".
std::string_view name_of(ViewFactorMethod method);
/// The other way; nothing for a name that is none, or for "hidden", which cannot be asked for.
std::optional<ViewFactorMethod> view_factor_method(std::string_view name);

struct ViewFactorOptions {
  ViewFactorMethod method = ViewFactorMethod::planned;
  double relative_tolerance = 1e-9;          ///< of analytic and exact visibility
  std::size_t most_evaluations = 2'000'000;  ///< of exact visibility, each pair of pieces
  int rays = 1024;                           ///< of ray casting, each pair of pieces
  std::uint64_t seed = 1;                    ///< of ray casting
  int arcs = 32;                             ///< of Nusselt's analog: chords an edge
  int resolution = 128;                      ///< of the hemicube: pixels along its edge, even
};

/// A view factor as exchange area S = A_i F_ij (m^2), with what it can be wrong by.
struct ViewFactorEstimate {
  double exchange_area_m2 = 0.0;
  /// |error| is at most this; where there is noise, three standard errors are in it.
  double error_bound_m2 = 0.0;
  double standard_error_m2 = 0.0;                       ///< k = 1; 0 for methods without noise
  double aliasing_bound_m2 = 0.0;                       ///< of the hemicube, in the bound
  ViewFactorMethod method = ViewFactorMethod::planned;  ///< what was used
  std::size_t evaluations = 0;                          ///< points, rays or pixels
  bool converged = true;                                ///< the tolerance asked for was reached
};

/// View factors between the surfaces of a scene, occlusion included:
///   A_i F_ij = 1/pi integral_i integral_j V cos_i cos_j / r^2 dA_j dA_i.
/// Surfaces may be concave, have holes, be bent or two-sided: they are sums over convex pieces, and
/// a surface may see itself. Openings are seen but do not block; blocks hide as convex solids
/// (convex_occluder) where exact visibility is found, polygon by polygon elsewhere. Coordinates are shifted to the
/// scene's centre first, so a far origin costs no digits beyond those of the file's own numbers.
class ViewFactors {
 public:
  explicit ViewFactors(const Scene& scene);

  std::size_t size() const { return pieces_of_.size(); }
  /// Area that sends light, both sides of a two-sided surface, m^2.
  double area_m2(std::size_t surface) const { return area_m2_[surface]; }

  /// Symmetric in its surfaces, ray casting too. Thread safe.
  ViewFactorEstimate between(std::size_t i, std::size_t j, const ViewFactorOptions& options) const;

 private:
  struct Piece {
    PlanarPolygon polygon;
    Blocker blocker;
    Eigen::AlignedBox3d box;
    bool is_opening = false;
  };

  ViewFactorEstimate between_pieces(std::uint32_t p, std::uint32_t q,
                                    const ViewFactorOptions& options) const;
  // What stands between two pieces: solids, and those of their faces that may hide something.
  struct Between {
    std::vector<const ConvexOccluder*> solids;
    std::vector<const Blocker*> faces;
  };

  void find_solids();
  bool find_between(std::uint32_t p, std::uint32_t q, Between& between) const;

  std::vector<Piece> pieces_;
  std::vector<ConvexOccluder> solids_;        // members are pieces
  std::vector<std::uint32_t> solid_of_piece_;
  std::vector<std::vector<std::uint32_t>> pieces_of_;  // of each surface
  std::vector<double> area_m2_;
  double tolerance_m_ = 0.0;  // of touching and coplanar pieces
};

/// What an element in the middle of one surface (the centroid of its largest piece) sees of
/// another.
struct PointView {
  Vec3 point = Vec3::Zero(), normal = Vec3::UnitZ();
  std::vector<Polygon> visible;
  double factor = 0.0;  ///< of the element, by Lambert's formula
};
PointView view_from_centre(const Scene& scene, std::size_t from, std::size_t to);

}  // namespace truebox
