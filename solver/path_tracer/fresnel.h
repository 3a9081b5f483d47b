// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace truebox {

/// Reflectance of a smooth interface for unpolarised light, exact (no Schlick approximation).
/// `cos_incident` in [0, 1]; `relative_index` = n of the far side / n of the near side. 1 beyond
/// the critical angle. Source: Born & Wolf (1999), 1.5.2, eqs. 32-36.
double fresnel_dielectric(double cos_incident, double relative_index);

/// The same of a metal of complex index n + i k in air. Source: Born & Wolf (1999), 14.2.
double fresnel_conductor(double cos_incident, double n, double k);

}  // namespace truebox
