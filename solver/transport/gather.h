// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "mesh/patch_mesh.h"
#include "mesh/smooth_field.h"
#include "transport/visible_parts.h"

namespace truebox {

/// Irradiance gathered at a point by exact visibility: each source polygon is clipped by the
/// shadows of its blockers, then Lambert's formula; no sampling, no noise.
class Gather {
 public:
  /// Working memory, one a thread.
  struct Scratch {
    VisibleParts parts;
    Polygon polygon;
    std::vector<const Blocker*> blockers;
    std::vector<std::uint32_t> in_view;
    std::vector<PointShadow> shadows;  ///< of a point, of those in view
  };

  Gather(const PatchMesh& mesh, const Scene& scene, bool occlusion);

  /// Visible view factor from a surface element to a convex polygon on `piece`, in [0, 1].
  double visible_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                        std::uint32_t piece, Scratch& scratch) const;
  /// The same where no other pieces than `between` may block.
  double visible_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                        std::uint32_t piece, std::span<const std::uint32_t> between,
                        Scratch& scratch) const;

  /// A part of a polygon cut again and again, the same whoever looks at it.
  struct Part {
    Vec3 centre;
    int depth = 0;           ///< how often the polygon was cut in four to get there
    std::uint64_t path = 1;  ///< four bits a cut, which of the parts; 0 where those do not suffice
  };
  /// Cuts a polygon on `piece` until each part is shorter than `near_field` times its distance from
  /// the point, and hands on each part's visible factor. Only pieces of `between` may block.
  using VisitPart = std::function<void(double factor, const Part& part)>;
  void visit_parts(const Vec3& point, const Vec3& normal, const Polygon& polygon,
                   std::uint32_t piece, double near_field, std::span<const std::uint32_t> between,
                   const VisitPart& visit, Scratch& scratch) const;

  /// Mean visible factor from an element to a whole luminous piece, where no other pieces than
  /// `between` may block: closed form if none, otherwise 4 x 4 Gauss points of exact visibility.
  double mean_factor(std::uint32_t patch, std::uint32_t luminaire,
                     std::span<const std::uint32_t> between, Scratch& scratch) const;

  /// Adds the direct irradiance of all luminaires, W m^-2 nm^-1, one value a band of the scene.
  void add_direct(const Vec3& point, const Vec3& normal, Eigen::Ref<Eigen::VectorXd> irradiance,
                  Scratch& scratch) const;

  /// Radiosity (one value a band) that leaves a point of an element; `depth` says how often the
  /// element was cut in four to get there.
  using SourceAt = std::function<void(std::uint32_t patch, const Vec3& point, int depth,
                                      Eigen::Ref<Eigen::VectorXd> value)>;

  /// Irradiance at a point from each surface, surfaces x bands. Far elements send their mean
  /// `radiosity` (elements x bands); an element longer than kNearField of its distance is split
  /// until it is short, and its parts send what `source_at` says of their centroids.
  BandMatrix from_surfaces(const Vec3& point, const Vec3& normal, const BandMatrix& radiosity,
                           const SourceAt& source_at, Scratch& scratch) const;

  static constexpr double kNearField = 0.5;

 private:
  struct PartWalk;
  void cast_shadows(const Vec3& point, std::span<const std::uint32_t> between,
                    Scratch& scratch) const;
  double factor_between_shadows(const Vec3& point, const Vec3& normal,
                                std::span<const Vec3> polygon, std::uint32_t piece,
                                std::span<const std::uint32_t> between, Scratch& scratch) const;
  void keep_in_view(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                    std::uint32_t piece, std::span<const std::uint32_t> between,
                    Scratch& scratch) const;
  double factor_of_visible_parts(const Vec3& point, const Vec3& normal,
                                 std::span<const Vec3> polygon, const Plane& plane,
                                 Scratch& scratch) const;
  void add_if_between(std::size_t blocker, const Vec3& point, const Plane& horizon,
                      std::span<const Vec3> polygon, std::uint32_t piece, Scratch& scratch) const;

  const PatchMesh& mesh_;
  const Scene& scene_;
  std::vector<Blocker> blockers_;
  std::vector<std::uint32_t> blocker_piece_;  ///< pieces that may block anything
  std::vector<std::uint32_t>
      blocker_of_;  ///< of each piece, into blockers_; kNone if it blocks nothing
  std::vector<std::uint32_t> luminous_pieces_;
  double tolerance_m_ = 0.0;
};

}  // namespace truebox
