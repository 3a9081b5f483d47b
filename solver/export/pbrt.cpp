// SPDX-License-Identifier: BSD-3-Clause
// pbrt-v4. Units, read from its sources (lights.cpp, film.h):
// - an area light's spectrum L is divided by sum(L ybar) over the whole nm from 360 to 830, so that
//   scale = 1 means 1 nit: `scale` must bring the sum back;
// - the spectral film multiplies its buckets by integral(ybar) = 106.856895 nm: `scale` is divided
//   by it, and the buckets are then spectral radiance;
// - R, G, B come out as imaging ratio (ISO / 100) times integral(L xbar..zbar), without that
//   factor: ISO brings it back, and they equal the R, G, B of `truebox render`;
// - float16 unless told otherwise; 5 reflections unless told otherwise; camera space is
//   left-handed, hence the mirror; `diffuse` and `conductor` reflect from both sides, roughness is
//   GGX alpha only with remaproughness off, and a conductor of given reflectance has it along the
//   normal only (materials.cpp).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "export/parts.h"
#include "image/image_file.h"
#include "image/spectral_image.h"

namespace truebox::exporting {
namespace {

constexpr double kCieYIntegral_nm = 106.856895;  // pbrt-v4, util/spectrum.h

// pbrt's own sum: its ybar stands at whole wavelengths.
double photometric_sum(const Steps& radiance, const Observer& observer) {
  double sum = 0.0;
  for (int nm = 360; nm <= 830; ++nm) sum += radiance.at(nm) * observer.y_bar.at(nm);
  return sum;
}

std::string pairs(const Steps& steps) {
  std::string text;
  for (std::size_t k = 0; k < steps.nm.size(); ++k)
    text += fmt::format(" {:.9g} {:.9g}", steps.nm[k], steps.value[k]);
  return text;
}

std::string quoted(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20 ? '_' : c;
  return out;
}

bool equal_widths(const WavelengthGrid& bands) {
  const auto [first, last] =
      std::minmax_element(bands.widths_nm().begin(), bands.widths_nm().end());
  return *last - *first < 1e-6;
}

std::string camera_and_film(const Scene& scene, const CameraDescription& c, int buckets) {
  const double from = band_edges_nm(scene.bands, 0)[0];
  const double to = band_edges_nm(scene.bands, scene.bands.size() - 1)[1];
  const double x = 0.5 * c.film_m[0] / c.focal_length_m, y = 0.5 * c.film_m[1] / c.focal_length_m;
  const Vec3 at = c.position_m + c.direction.normalized() * scene.diameter_m();
  return fmt::format(
      "Scale -1 1 1\nLookAt {:.9g} {:.9g} {:.9g}  {:.9g} {:.9g} {:.9g}  {:.9g} {:.9g} {:.9g}\n"
      "# a field of 90 degrees: the screen window is in tangents\n"
      "Camera \"perspective\" \"float fov\" [ 90 ]\n"
      "  \"float screenwindow\" [ {:.9g} {:.9g} {:.9g} {:.9g} ]\n"
      "Film \"spectral\" \"string filename\" [ \"pbrt.exr\" ]\n"
      "  \"integer xresolution\" [ {} ] \"integer yresolution\" [ {} ]\n"
      "  \"float lambdamin\" [ {:.9g} ] \"float lambdamax\" [ {:.9g} ] \"integer nbuckets\" [ {} "
      "]\n"
      "  \"bool savefp16\" [ false ] \"string sensor\" [ \"cie1931\" ] \"float iso\" [ {:.9g} ]\n",
      c.position_m.x(), c.position_m.y(), c.position_m.z(), at.x(), at.y(), at.z(), c.up.x(),
      c.up.y(), c.up.z(), -x, x, -y, y, c.pixels[0], c.pixels[1], from, to, buckets,
      100.0 * kCieYIntegral_nm);
}

std::string shape(const std::vector<Triangle>& triangles) {
  std::string indices, points;
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    indices += fmt::format(" {} {} {}", 3 * k, 3 * k + 1, 3 * k + 2);
    for (const Vec3& v : triangles[k])
      points += fmt::format("  {:.9g} {:.9g} {:.9g}", v.x(), v.y(), v.z());
  }
  return fmt::format("  Shape \"trianglemesh\" \"integer indices\" [{} ]\n    \"point3 P\" [{} ]\n",
                     indices, points);
}

std::string material_line(const Scene& scene, const Material& m) {
  const auto of_bands = [&](const char* name, const std::vector<double>& values) {
    return fmt::format("  \"spectrum {}\" [{} ]\n", name, pairs(stepped(scene.bands, values)));
  };
  const auto named = [&](const char* type, const std::string& parameters) {
    return fmt::format("MakeNamedMaterial \"{}\" \"string type\" [ \"{}\" ]\n{}", quoted(m.name),
                       type, parameters);
  };
  switch (m.scattering) {
    case Scattering::lambertian: break;
    case Scattering::mirror:
    case Scattering::rough_conductor:
      if (m.refractive_index.values.empty())
        refuse_material(scene, m,
                        "a mirror of given refractive_index and absorption_index (pbrt knows no "
                        "reflectance that is the same at every angle)",
                        "a reflectance");
      return named("conductor",
                   of_bands("eta", m.refractive_index.values) +
                       of_bands("k", m.absorption_index.values) +
                       fmt::format("  \"float roughness\" [ {:.9g} ] \"bool remaproughness\" [ "
                                   "false ]\n",
                                   m.roughness));
    case Scattering::dielectric:
      return named("dielectric", of_bands("eta", m.refractive_index.values));
  }
  return named("diffuse", of_bands("reflectance", m.reflectance.values));
}

}  // namespace

ExportSummary write_pbrt(const Scene& scene, const std::filesystem::path& target,
                         const ExportOptions& options) {
  ExportSummary summary;
  const auto file = file_of(target, {".pbrt"}, "scene.pbrt");
  const CameraDescription* camera = chosen_camera(scene, options.camera);
  const double from = band_edges_nm(scene.bands, 0)[0];
  const double to = band_edges_nm(scene.bands, scene.bands.size() - 1)[1];
  const bool one_bucket_a_band = equal_widths(scene.bands);
  const int buckets = one_bucket_a_band
                          ? static_cast<int>(scene.bands.size())
                          : std::clamp(static_cast<int>(std::lround(to - from)), 1, 2000);
  std::string text =
      "# " + quoted(scene.path) + ": lengths in m, radiances in W m^-2 sr^-1 nm^-1\n";
  if (camera) text += camera_and_film(scene, *camera, buckets);
  text +=
      "PixelFilter \"box\" \"float xradius\" [ 0.5 ] \"float yradius\" [ 0.5 ]\n"
      "Sampler \"independent\" \"integer pixelsamples\" [ 256 ]\n"
      "Integrator \"path\" \"integer maxdepth\" [ 100 ]\nWorldBegin\n";
  for (std::size_t m = 0; m < scene.materials.size(); ++m)
    text += material_line(scene, scene.materials[m]);
  for (const Surface& surface : scene.surfaces) {
    if (surface.is_opening) continue;
    const Material& material = scene.material_of(surface);
    text += "AttributeBegin  # " + quoted(surface.name) + "\n";
    text += fmt::format("  NamedMaterial \"{}\"\n", quoted(material.name));
    if (material.emits()) {
      const Steps radiance = stepped(scene.bands, emitted_radiance(material));
      text += fmt::format(
          "  # scale = sum(L ybar) / {}\n  AreaLightSource \"diffuse\" \"float scale\" [ {:.9g} ]\n"
          "    \"bool twosided\" [ {} ] \"spectrum L\" [{} ]\n",
          kCieYIntegral_nm, photometric_sum(radiance, options.observer) / kCieYIntegral_nm,
          surface.two_sided, pairs(radiance));
    }
    text += shape(triangles_of(surface)) + "AttributeEnd\n";
  }
  write_file_atomically(file, text);
  summary.files = {file};
  summary.notes = {
      fmt::format("Render: pbrt --spp 1024 --outfile pbrt.exr {}", file.string()),
      "Compare: truebox compare pbrt.exr RENDER.exr; buckets are mean radiances, "
      "W m^-2 sr^-1 nm^-1, and R, G, B are those of truebox render.",
      "pbrt's surfaces reflect from both sides; here the back of a one-sided surface is black. "
      "The two differ where light reaches a back."};
  if (!one_bucket_a_band)
    summary.notes.push_back(
        "The bands are not equally wide, so the film has buckets of about 1 nm; the one at a "
        "band's "
        "centre is the band.");
  if (!camera) summary.notes.push_back("The scene has no camera, so neither has the file.");
  return summary;
}

}  // namespace truebox::exporting
