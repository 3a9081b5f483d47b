// SPDX-License-Identifier: BSD-3-Clause
// Radiance. Units (Ward Larson & Shakespeare 1998; its reference manual): RGB radiance in
// W m^-2 sr^-1 over primaries of its own and an equal-energy white; luminance =
// 179 lm/W (0.265 R + 0.670 G + 0.065 B). `plastic` without gloss is Lambertian and reflects from
// both sides; `light` shines from its front and reflects nothing. `mirror` reflects alike at every
// angle; `dielectric` takes the transmission of a unit length, an index and Hartmann's constant.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "export/parts.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox::exporting {
namespace {

// The matrix of primaries (x, y) scaled so that RGB = 1, 1, 1 is the equal-energy white at Y = 1.
LinearRgb radiance_rgb(const Tristimulus& xyz) {
  static const Eigen::Matrix3d kRgbFromXyz = [] {
    const double primaries[3][2] = {{0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}};
    Eigen::Matrix3d columns;
    for (int c = 0; c < 3; ++c)
      columns.col(c) << primaries[c][0], primaries[c][1], 1.0 - primaries[c][0] - primaries[c][1];
    const Eigen::Vector3d scale = columns.inverse() * Eigen::Vector3d::Ones();
    return Eigen::Matrix3d((columns * scale.asDiagonal()).inverse());
  }();
  // Photometric: 683 lm/W at the peak of ybar, against Radiance's 179 lm/W of white.
  const Eigen::Vector3d rgb = kRgbFromXyz * Eigen::Vector3d(xyz.X, xyz.Y, xyz.Z) * (683.0 / 179.0);
  return {rgb[0], rgb[1], rgb[2]};
}

std::string line(const LinearRgb& rgb) {
  return fmt::format("{:.9g} {:.9g} {:.9g}", rgb[0], rgb[1], rgb[2]);
}

std::string matter(const Scene& scene, const Material& material, const std::string& name,
                   const Colours& colours, std::vector<std::string>& notes) {
  switch (material.scattering) {
    case Scattering::lambertian: break;
    case Scattering::mirror:
      if (!material.refractive_index.values.empty())
        refuse_material(scene, material,
                        "a mirror of one reflectance at every angle (Radiance knows no other)",
                        "optical constants");
      return fmt::format("\nvoid mirror {}\n0\n0\n3 {}\n", name,
                         line(colours.reflectance(material, notes)));
    case Scattering::rough_conductor:
      refuse_material(scene, material, "no rough conductor (Radiance's metals have Ward's lobe)",
                      "GGX facets");
    case Scattering::dielectric:
      return fmt::format("\nvoid dielectric {}\n0\n0\n5 1 1 1 {:.9g} 0\n", name,
                         common_refractive_index(scene, material, "Radiance"));
  }
  return fmt::format("\nvoid plastic {}\n0\n0\n5 {} 0 0\n", name,
                     line(colours.reflectance(material, notes)));
}

std::string view(const CameraDescription& c) {
  const auto degrees = [](double film_m, double focal_m) {
    return 2.0 * std::atan(0.5 * film_m / focal_m) * 180.0 / std::numbers::pi;
  };
  return fmt::format(
      "rvu -vtv -vp {:.9g} {:.9g} {:.9g} -vd {:.9g} {:.9g} {:.9g} -vu {:.9g} {:.9g} {:.9g} "
      "-vh {:.9g} -vv {:.9g}\n",
      c.position_m.x(), c.position_m.y(), c.position_m.z(), c.direction.x(), c.direction.y(),
      c.direction.z(), c.up.x(), c.up.y(), c.up.z(), degrees(c.film_m[0], c.focal_length_m),
      degrees(c.film_m[1], c.focal_length_m));
}

}  // namespace

ExportSummary write_radiance(const Scene& scene, const std::filesystem::path& target,
                             const ExportOptions& options) {
  ExportSummary summary;
  const auto file = file_of(target, {".rad"}, "scene.rad");
  const Colours colours(scene, options, &radiance_rgb);
  std::string text = "# lengths in m. " + colours.meaning() + "\n";
  if (!colours.by_bands())
    text += "# Radiances in W m^-2 sr^-1; times 179 lm/W they are luminances in cd m^-2.\n";
  std::string lamps;
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    const Material& material = scene.materials[m];
    const std::string name = safe_name(material.name, m);
    if (material.emits()) {
      const LinearRgb shine = colours.radiance(material);
      for (const double v : shine)
        if (v < 0.0)
          summary.notes.push_back(
              "The light \"" + material.name +
              "\" lies outside Radiance's three colours (a negative one was set to 0).");
      text += fmt::format(
          "\nvoid light {}\n0\n0\n3 {}\n", name,
          line({std::max(0.0, shine[0]), std::max(0.0, shine[1]), std::max(0.0, shine[2])}));
      for (const double rho : material.reflectance.values)
        if (rho > 0.0) lamps = "\"" + material.name + "\"";
    } else {
      text += matter(scene, material, name, colours, summary.notes);
    }
  }
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    if (surface.is_opening) continue;
    const Material& material = scene.material_of(surface);
    if (surface.two_sided && material.emits())
      throw InputError(scene.path, 0, "lights that shine to one side (Radiance knows no other)",
                       "the two-sided light \"" + surface.name + "\"");
    const std::size_t fronts =
        surface.two_sided ? surface.pieces.size() / 2 : surface.pieces.size();
    for (std::size_t p = 0; p < fronts; ++p) {
      text +=
          fmt::format("\n{} polygon {}.{}\n0\n0\n{}\n", safe_name(material.name, surface.material),
                      safe_name(surface.name, s), p, 3 * surface.pieces[p].size());
      for (const Vec3& v : surface.pieces[p])
        text += fmt::format("  {:.9g} {:.9g} {:.9g}\n", v.x(), v.y(), v.z());
    }
  }
  write_file_atomically(file, text);
  summary.files = {file};
  std::size_t index = 0;
  for (const auto& [name, camera] : scene.cameras) {
    summary.files.push_back(file.parent_path() / (safe_name(name, index++) + ".vf"));
    write_file_atomically(summary.files.back(), view(camera));
  }
  summary.notes.push_back(fmt::format(
      "Render: oconv {} > scene.oct; rpict -vf VIEW.vf -x W -y H -pa 0 -ab 12 -ad 4096 -aa 0 -lw 0 "
      "-dt 0 -dc 1 -dj 1 -ds 0.02 scene.oct > radiance.hdr",
      file.string()));
  summary.notes.push_back(colours.meaning());
  if (!lamps.empty())
    summary.notes.push_back("Radiance's lights reflect nothing: the reflectance of material " +
                            lamps + " is left out.");
  summary.notes.push_back(
      "Radiance's surfaces reflect from both sides; here the back of a one-sided surface is black. "
      "The two differ where light reaches a back.");
  return summary;
}

}  // namespace truebox::exporting
