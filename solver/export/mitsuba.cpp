// SPDX-License-Identifier: BSD-3-Clause
// Mitsuba 3, a spectral variant. Units, read from its sources (specfilm.cpp, xml.cpp, 3.x):
// - a spectrum given inline inside an emitter is divided by integral(ybar) = 106.75 nm; an object
//   <spectrum type="irregular"> is taken as it stands, so that is what is written;
// - specfilm's channel j is integral(response_j(lambda) L(lambda) dlambda), not normalised: a
//   response of 1/width in a band makes it the band's mean radiance;
// - float16 unless told otherwise; `diffuse`, `conductor` and `area` act on the side of the normal
//   only; `conductor` without material or eta is an ideal mirror; `dielectric` takes one number for
//   its index, and means air of 1.000277 outside unless told otherwise.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "export/parts.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox::exporting {
namespace {

std::string spectrum(const char* indent, const std::string& name, const std::vector<double>& nm,
                     const std::vector<double>& values) {
  return fmt::format(
      "{0}<spectrum type=\"irregular\" name=\"{1}\">\n"
      "{0}  <string name=\"wavelengths\" value=\"{2}\"/>\n"
      "{0}  <string name=\"values\" value=\"{3}\"/>\n{0}</spectrum>\n",
      indent, name, joined(nm, ", "), joined(values, ", "));
}

// "band_400_000nm": a name may hold no dot. `truebox compare` maps it back to S0.400,000nm.
std::string band_channel(double nm) {
  std::string name = fmt::format("band_{:.3f}nm", nm);
  name[name.find('.')] = '_';
  return name;
}

std::string film(const WavelengthGrid& bands, const CameraDescription& camera) {
  std::string text = fmt::format(
      "    <film type=\"specfilm\">\n      <integer name=\"width\" value=\"{}\"/>\n"
      "      <integer name=\"height\" value=\"{}\"/>\n"
      "      <string name=\"component_format\" value=\"float32\"/>\n"
      "      <rfilter type=\"box\"/>\n",
      camera.pixels[0], camera.pixels[1]);
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const auto [from, to] = band_edges_nm(bands, b);
    const double mean = 1.0 / (to - from), flank = 0.005;
    text += spectrum("      ", band_channel(bands.centre_nm(b)),
                     {from - flank, from + flank, to - flank, to + flank}, {0.0, mean, mean, 0.0});
  }
  return text + "    </film>\n";
}

std::string sensor(const Scene& scene, const CameraDescription& c) {
  const double pixel_x_m = c.film_m[0] / c.pixels[0], pixel_y_m = c.film_m[1] / c.pixels[1];
  if (std::abs(pixel_x_m / pixel_y_m - 1.0) > 1e-6)
    throw InputError(scene.path, 0, "a camera with square pixels (Mitsuba knows no other)",
                     fmt::format("{:g} x {:g} um", 1e6 * pixel_x_m, 1e6 * pixel_y_m));
  const double fov_deg =
      2.0 * std::atan(0.5 * c.film_m[0] / c.focal_length_m) * 180.0 / std::numbers::pi;
  const Vec3 target = c.position_m + c.direction.normalized() * scene.diameter_m();
  return fmt::format(
      "  <sensor type=\"perspective\">\n    <string name=\"fov_axis\" value=\"x\"/>\n"
      "    <float name=\"fov\" value=\"{:.12g}\"/>\n"
      "    <float name=\"near_clip\" value=\"{:.6g}\"/>\n"
      "    <float name=\"far_clip\" value=\"{:.6g}\"/>\n    <transform name=\"to_world\">\n"
      "      <lookat origin=\"{:.9g}, {:.9g}, {:.9g}\" target=\"{:.9g}, {:.9g}, {:.9g}\" "
      "up=\"{:.9g}, {:.9g}, {:.9g}\"/>\n    </transform>\n"
      "    <sampler type=\"independent\">\n"
      "      <integer name=\"sample_count\" value=\"$spp\"/>\n    </sampler>\n{}  </sensor>\n",
      fov_deg, 1e-5 * scene.diameter_m(), 1e3 * scene.diameter_m(), c.position_m.x(),
      c.position_m.y(), c.position_m.z(), target.x(), target.y(), target.z(), c.up.x(), c.up.y(),
      c.up.z(), film(scene.bands, c));
}

std::string ply(const std::vector<Triangle>& triangles) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment lengths in m\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nelement face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      3 * triangles.size(), triangles.size());
  for (const Triangle& t : triangles)
    for (const Vec3& v : t) text += fmt::format("{:.9g} {:.9g} {:.9g}\n", v.x(), v.y(), v.z());
  for (std::size_t k = 0; k < triangles.size(); ++k)
    text += fmt::format("3 {} {} {}\n", 3 * k, 3 * k + 1, 3 * k + 2);
  return text;
}

// Plugin and parameters. `roughconductor` has Fresnel's reflectance of eta + i k over GGX facets
// with Smith's masking, as the scene's own.
std::pair<const char*, std::string> scatterer(const Scene& scene, const Material& m) {
  const auto of_bands = [&](const char* name, const std::vector<double>& values) {
    const Steps steps = stepped(scene.bands, values);
    return spectrum("    ", name, steps.nm, steps.value);
  };
  const auto constants = [&] {
    return of_bands("eta", m.refractive_index.values) + of_bands("k", m.absorption_index.values);
  };
  switch (m.scattering) {
    case Scattering::lambertian: break;
    case Scattering::mirror:
      if (!m.refractive_index.values.empty()) return {"conductor", constants()};
      return {"conductor", of_bands("specular_reflectance", m.reflectance.values)};
    case Scattering::rough_conductor:
      return {"roughconductor", fmt::format("    <string name=\"distribution\" value=\"ggx\"/>\n"
                                            "    <float name=\"alpha\" value=\"{:.9g}\"/>\n",
                                            m.roughness) +
                                    constants()};
    case Scattering::dielectric:
      return {"dielectric", fmt::format("    <float name=\"int_ior\" value=\"{:.9g}\"/>\n"
                                        "    <float name=\"ext_ior\" value=\"1\"/>\n",
                                        common_refractive_index(scene, m, "Mitsuba"))};
  }
  return {"diffuse", of_bands("reflectance", m.reflectance.values)};
}

std::string bsdf(const Scene& scene, std::size_t material, bool two_sided) {
  const Material& m = scene.materials[material];
  const std::string id = safe_name(m.name, material);
  const auto [type, content] = scatterer(scene, m);
  if (!two_sided)
    return fmt::format("  <bsdf type=\"{}\" id=\"{}\">\n{}  </bsdf>\n", type, id, content);
  return fmt::format(
      "  <bsdf type=\"twosided\" id=\"{}_two_sided\">\n    <bsdf type=\"{}\">\n{}    </bsdf>\n"
      "  </bsdf>\n",
      id, type, content);
}

}  // namespace

ExportSummary write_mitsuba(const Scene& scene, const std::filesystem::path& target,
                            const ExportOptions& options) {
  ExportSummary summary;
  const auto file = file_of(target, {".xml"}, "scene.xml");
  const std::string folder = file.stem().string() + "_meshes";
  const CameraDescription* camera = chosen_camera(scene, options.camera);
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- {}: lengths in m, radiances in "
      "W m^2 sr^1 nm^1 (each in the denominator). Needs a spectral variant. -->\n"
      "<scene version=\"3.0.0\">\n  <default name=\"spp\" value=\"256\"/>\n"
      "  <integrator type=\"path\">\n    <integer name=\"max_depth\" value=\"-1\"/>\n"
      "    <integer name=\"rr_depth\" value=\"20\"/>\n  </integrator>\n",
      xml_text(scene.path));
  if (camera) text += sensor(scene, *camera);
  std::vector<std::array<bool, 2>> written(scene.materials.size());
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    if (surface.is_opening) continue;
    const Material& material = scene.material_of(surface);
    if (surface.two_sided && material.emits())
      throw InputError(scene.path, 0, "lights that shine to one side (Mitsuba knows no other)",
                       "the two-sided light \"" + surface.name + "\"");
    bool& is_written = written[surface.material][surface.two_sided ? 1 : 0];
    if (!is_written) text += bsdf(scene, surface.material, surface.two_sided);
    is_written = true;
    const std::string name = safe_name(surface.name, s);
    text += fmt::format(
        "  <shape type=\"ply\" id=\"{0}\">\n"
        "    <string name=\"filename\" value=\"{1}/{0}.ply\"/>\n"
        "    <boolean name=\"face_normals\" value=\"true\"/>\n    <ref id=\"{2}{3}\"/>\n",
        name, xml_text(folder), safe_name(material.name, surface.material),
        surface.two_sided ? "_two_sided" : "");
    if (material.emits()) {
      const Steps radiance = stepped(scene.bands, emitted_radiance(material));
      text += "    <emitter type=\"area\">\n" +
              spectrum("      ", "radiance", radiance.nm, radiance.value) + "    </emitter>\n";
    }
    text += "  </shape>\n";
    summary.files.push_back(file.parent_path() / folder / (name + ".ply"));
    write_file_atomically(summary.files.back(), ply(triangles_of(surface)));
  }
  write_file_atomically(file, text + "</scene>\n");
  summary.files.insert(summary.files.begin(), file);
  summary.notes = {
      fmt::format("Render: mitsuba -m scalar_spectral -D spp=1024 -o mitsuba.exr {}",
                  file.string()),
      "Compare: truebox compare mitsuba.exr RENDER.exr --test-channels 'S0.{nm}nm=band_{nm}nm'; "
      "each channel is the mean radiance of its band, W m^-2 sr^-1 nm^-1."};
  if (!camera) summary.notes.push_back("The scene has no camera, so neither has the file.");
  return summary;
}

}  // namespace truebox::exporting
