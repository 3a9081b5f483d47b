// SPDX-License-Identifier: BSD-3-Clause
#include "scene/requirements.h"

#include <algorithm>
#include <cmath>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

struct Facet {
  const Polygon* polygon;
  Plane plane;
  bool is_opening;
  bool reflects;
};

std::vector<Facet> facets_of(const Scene& scene) {
  std::vector<Facet> facets;
  for (const Surface& surface : scene.surfaces) {
    const auto& rho = scene.material_of(surface).reflectance.values;
    const bool reflects = !surface.is_opening &&
                          (scene.material_of(surface).scattering != Scattering::lambertian ||
                           std::any_of(rho.begin(), rho.end(), [](double r) { return r > 0; }));
    for (const Polygon& piece : surface.pieces)
      facets.push_back({&piece, plane_of(piece), surface.is_opening, reflects});
  }
  return facets;
}

bool any_in_front(const Polygon& polygon, const Plane& plane, double tolerance) {
  return std::any_of(polygon.begin(), polygon.end(),
                     [&](const Vec3& v) { return plane.distance_m(v) > tolerance; });
}

bool any_behind(const Polygon& polygon, const Plane& plane, double tolerance) {
  return any_in_front(polygon, Plane{-plane.normal, -plane.offset_m}, tolerance);
}

// A flat surface that has the whole scene on one side cannot come between two points of it.
bool needs_occlusion(const std::vector<Facet>& facets, double tolerance) {
  for (const Facet& blocker : facets) {
    if (blocker.is_opening) continue;
    bool front = false, behind = false;
    for (const Facet& other : facets) {
      front |= any_in_front(*other.polygon, blocker.plane, tolerance);
      behind |= any_behind(*other.polygon, blocker.plane, tolerance);
    }
    if (front && behind) return true;
  }
  return false;
}

bool needs_interreflection(const std::vector<Facet>& facets, double tolerance) {
  for (const Facet& a : facets)
    for (const Facet& b : facets)
      if (a.reflects && b.reflects && any_in_front(*b.polygon, a.plane, tolerance) &&
          any_in_front(*a.polygon, b.plane, tolerance))
        return true;
  return false;
}

// Band b is `scale` times band a if every reflectance agrees and every emission is proportional.
bool proportional(const Scene& scene, std::size_t a, std::size_t b, double& scale) {
  scale = -1.0;
  for (const Material& m : scene.materials) {
    if (m.reflectance[a] != m.reflectance[b]) return false;
    for (const RefractiveIndex* index : {&m.refractive_index, &m.absorption_index})
      if (index->size() > 0 && (*index)[a] != (*index)[b]) return false;
    const double ea = m.exitance[a], eb = m.exitance[b];
    if (ea == 0.0 && eb == 0.0) continue;
    if (ea == 0.0) return false;
    if (scale < 0.0) scale = eb / ea;
    if (std::abs(eb - scale * ea) > 4e-16 * std::abs(eb)) return false;
  }
  if (scale < 0.0) scale = 1.0;
  return true;
}

void find_distinct_bands(const Scene& scene, Requirements& needs) {
  for (std::size_t b = 0; b < scene.bands.size(); ++b) {
    bool found = false;
    for (std::size_t k = 0; k < needs.distinct_bands.size() && !found; ++k) {
      double scale = 1.0;
      if (!proportional(scene, needs.distinct_bands[k], b, scale)) continue;
      needs.band_source.push_back(k);
      needs.band_scale.push_back(scale);
      found = true;
    }
    if (found) continue;
    needs.band_source.push_back(needs.distinct_bands.size());
    needs.band_scale.push_back(1.0);
    needs.distinct_bands.push_back(b);
  }
}

const char* described(Scattering scattering) {
  switch (scattering) {
    case Scattering::mirror: return "a mirror";
    case Scattering::rough_conductor: return "a rough conductor";
    case Scattering::dielectric: return "a dielectric";
    case Scattering::lambertian: break;
  }
  return "Lambertian";
}

const Surface* first_not_lambertian(const Scene& scene) {
  for (const Surface& surface : scene.surfaces)
    if (scene.material_of(surface).scattering != Scattering::lambertian) return &surface;
  return nullptr;
}

}  // namespace

void require_lambertian(const Scene& scene) {
  if (const Surface* surface = first_not_lambertian(scene))
    throw InputError(
        scene.path, 0,
        "Lambertian surfaces only, which is what radiosity can do (`truebox render "
        "--method path` traces paths instead)",
        "surface \"" + surface->name + "\", " + described(scene.material_of(*surface).scattering));
}

Requirements requirements(const Scene& scene) {
  Requirements needs;
  const std::vector<Facet> facets = facets_of(scene);
  const double tolerance = 1e-9 * scene.diameter_m();
  needs.occlusion = needs_occlusion(facets, tolerance);
  needs.interreflection = needs_interreflection(facets, tolerance);
  find_distinct_bands(scene, needs);
  if (const Surface* surface = first_not_lambertian(scene)) {
    needs.path_tracing = true;
    needs.reasons.push_back("path tracing: needed, surface \"" + surface->name + "\" is " +
                            described(scene.material_of(*surface).scattering) +
                            "; radiosity knows Lambertian surfaces only");
  }

  needs.reasons.push_back(
      needs.interreflection
          ? "interreflection: modelled, lit surfaces face each other"
          : "interreflection: left out, no reflecting surface faces another; this is exact");
  needs.reasons.push_back(
      needs.occlusion
          ? "occlusion: modelled, a surface has others on both of its sides"
          : "occlusion: left out, every surface has the whole scene on one side; exact");
  needs.reasons.push_back("bands: " + std::to_string(needs.distinct_bands.size()) + " of " +
                          std::to_string(scene.bands.size()) + " solved" +
                          (needs.distinct_bands.size() < scene.bands.size()
                               ? ", the others are exact multiples of these"
                               : ", no two are multiples of each other"));
  return needs;
}

}  // namespace truebox
