// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fit/view_blocks.h"
#include "transport/gather.h"

namespace truebox {

/// A rough, weakly reflecting layer on a Lambertian surface: facets of GGX with a reflectance k at
/// every angle, added to rho / pi:
///   f(o, i) = k D(m) G2(o, i) / (4 o_z i_z),   m half way between o and i,
/// D of Walter et al. (2007, eq. 33), G2 of Smith, height-correlated (Heitz 2014, eq. 99).
/// First order in k: of the light that meets the layer only what comes straight from a lamp is
/// followed, and only to the camera. Left out: the mirror image of lit walls (k times what they
/// send), what the layer takes from the body (k of it), Fresnel's rise towards grazing angles, and
/// the gloss' light on other surfaces.
class GlossLobe {
 public:
  explicit GlossLobe(double roughness) : alpha2_(roughness * roughness) {}

  /// f at k = 1, 1/sr; unit vectors away from the surface. 0 below its horizon.
  double value(const Vec3& normal, const Vec3& outgoing, const Vec3& incoming) const;
  double roughness() const;

 private:
  double alpha2_;
};

/// Radiosity (pi L) by which a camera sees each luminaire of unit exitance in the lobe of a block
/// at k = 1: the integral of f cos over its visible parts, with exact visibility of cells that are
/// small against the lobe. One value a luminaire (band of `lamp_scene`).
Eigen::VectorXd gloss_of(const PixelBlock& block, const GlossLobe& lobe, const PatchMesh& mesh,
                         const Scene& lamp_scene, const Gather& gather, Gather::Scratch& scratch);

}  // namespace truebox
