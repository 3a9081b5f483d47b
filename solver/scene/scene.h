// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "radiometry/spectral.h"
#include "radiometry/wavelength_grid.h"
#include "scene/camera_description.h"
#include "scene/polygon.h"

namespace truebox {

/// How a surface scatters. Radiosity knows the first only; the others need path tracing.
enum class Scattering {
  lambertian,
  mirror,           ///< ideal; `reflectance` at every angle, or Fresnel's of a smooth conductor
  rough_conductor,  ///< GGX facets of `roughness`, Fresnel's reflectance of n + i k
  dielectric,       ///< a smooth, clear interface: n behind the polygon, 1 on its lit side
};

/// Optical properties of a surface, one value a band. Opaque unless it is a dielectric; the back of
/// an opaque surface is black.
struct Material {
  std::string name;
  Reflectance reflectance;   ///< 0 <= rho < 1; of a Lambertian surface or a mirror
  RadiantExitance exitance;  ///< own emission, W m^-2 nm^-1 (or relative, where its source says so)
  TabulatedSpectrum exitance_spectrum = {};  ///< as its source tabulates it: finer than the bands
  Scattering scattering = Scattering::lambertian;
  RefractiveIndex refractive_index = {};  ///< n, empty where it means nothing
  RefractiveIndex absorption_index = {};  ///< k of conductors
  double roughness = 0.0;                 ///< GGX alpha of a rough conductor

  bool emits() const;
};

/// A flat part of the scene. A non-planar quad is cut along its 0-2 diagonal, a hole is cut out:
/// `pieces` are planar and convex.
struct Surface {
  std::string name;
  std::size_t material = 0;
  std::vector<Polygon> pieces;
  bool is_opening = false;  ///< nothing is there: light leaves, cameras and rays pass
  bool two_sided = false;   ///< the second half of `pieces` are the backs of the first
};

/// Surfaces, their materials in each band, and the cameras that look at them. SI units.
struct Scene {
  std::string path;               ///< the file it came from
  double metres_per_unit = 1.0;   ///< of the file's length unit
  std::string length_unit = "m";  ///< as the file wrote it
  WavelengthGrid bands;
  bool is_total = false;    ///< one band over all wavelengths: W m^-2 instead of W m^-2 nm^-1
  bool is_thermal = false;  ///< a material emits by its temperature: heat is exchanged
  std::vector<Material> materials;
  std::vector<Surface> surfaces;  ///< openings last
  std::map<std::string, CameraDescription> cameras;

  const Material& material_of(const Surface& surface) const { return materials[surface.material]; }
  double diameter_m() const;  ///< diagonal of the bounding box of the surfaces
  /// Unit of radiosity and irradiance.
  const char* exitance_unit() const { return is_total ? "W m^-2" : Radiosity::unit(); }
};

/// The same scene in some of its bands only, in that order.
Scene in_bands(const Scene& scene, const std::vector<std::size_t>& bands);

/// The same, the bands named by their centres (within 0.01 nm). std::invalid_argument if one is
/// missing.
Scene in_bands_at(const Scene& scene, const std::vector<double>& centres_nm);

}  // namespace truebox
