// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>

#include "path_tracer/owen_sobol.h"
#include "scene/scene.h"

namespace truebox {

/// How a surface scatters light in each band. Directions are unit vectors that point away from the
/// surface, in a frame whose z axis is the normal on the side the path arrived from.
///
/// Lambertian: f = rho / pi. Mirror: rho, or Fresnel's reflectance of n + i k. Rough conductor:
///   f = F(m.o) D(m) G2(o, i) / (4 o_z i_z),  m the facet normal half way between o and i,
/// D of GGX (Walter et al. 2007, eq. 33), G2 of Smith, height-correlated (Heitz 2014, eq. 99).
/// Light that would leave after a second facet is lost: at normal incidence 1.2 % of it with alpha
/// 0.1, 31 % with 0.5, ln 2 = 69 % with 1. Dielectric: Fresnel's share is reflected, the rest
/// refracted, its radiance times (n_near / n_far)^2 as paths run against the light. No absorption,
/// no polarisation.
class Bsdf {
 public:
  explicit Bsdf(const Material& material) : material_(&material) {}

  /// Whether light leaves in single directions only: nothing to evaluate, lamps cannot be aimed at.
  bool is_specular() const {
    return material_->scattering == Scattering::mirror ||
           material_->scattering == Scattering::dielectric;
  }

  /// f(o, i) i_z in each band, 1/sr. Zero for a specular one and below the horizon.
  void evaluate(const Vec3& outgoing, const Vec3& incoming, Eigen::Ref<Eigen::ArrayXd> f_cos) const;

  /// Probability density of `sample` for that direction, 1/sr.
  double density(const Vec3& outgoing, const Vec3& incoming) const;

  struct Sample {
    Vec3 incoming = Vec3::UnitZ();
    double density = 0.0;         ///< 1/sr; 0 for a single direction
    double relative_index = 1.0;  ///< n_far / n_near if the path went through, else 1
    bool passed = false;          ///< through to the other side
  };

  /// Draws where the light came from; `weight` becomes f cos / density. Nothing if all of it is
  /// lost. From inside a dielectric `from_inside` is set. Where refraction differs between bands a
  /// path can follow one of them: `only_band` (-1 as long as it follows all) is chosen then, with
  /// its weight made up for the others'.
  std::optional<Sample> sample(const Vec3& outgoing, bool from_inside, UnitPair direction,
                               UnitPair choice, int& only_band,
                               Eigen::Ref<Eigen::ArrayXd> weight) const;

 private:
  Sample through_dielectric(const Vec3& outgoing, bool from_inside, UnitPair choice, int& only_band,
                            Eigen::Ref<Eigen::ArrayXd> weight) const;
  void fresnel(double cos_incident, Eigen::Ref<Eigen::ArrayXd> reflectance) const;

  const Material* material_;
};

}  // namespace truebox
