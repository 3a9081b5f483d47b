// SPDX-License-Identifier: BSD-3-Clause
#include "export/scene_export.h"

#include <stdexcept>

#include "export/parts.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

bool has_lens(const LensDescription& lens) {
  const LensDistortion& d = lens.distortion;
  for (const double v : {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4,
                         lens.principal_point_m[0], lens.principal_point_m[1], lens.point_spread_m,
                         lens.veiling_glare})
    if (v != 0.0) return true;
  return lens.cos4 || !lens.vignetting_polynomial.empty() || !lens.transmittances.empty();
}

ExportSummary written(const Scene& scene, ExportFormat format, const std::filesystem::path& target,
                      const ExportOptions& options) {
  switch (format) {
    case ExportFormat::mitsuba: return exporting::write_mitsuba(scene, target, options);
    case ExportFormat::pbrt: return exporting::write_pbrt(scene, target, options);
    case ExportFormat::radiance: return exporting::write_radiance(scene, target, options);
    case ExportFormat::obj: return exporting::write_obj(scene, target, options);
    case ExportFormat::gltf: return exporting::write_gltf(scene, target, options);
  }
  throw std::invalid_argument("no such export format");
}

}  // namespace

ExportSummary export_scene(const Scene& scene, ExportFormat format,
                           const std::filesystem::path& target, const ExportOptions& options) {
  if (scene.is_total)
    throw InputError(scene.path, 0, "bands of wavelengths (other renderers show light)",
                     "one band over all wavelengths");
  ExportSummary summary = written(scene, format, target, options);
  for (const auto& [name, camera] : scene.cameras)
    if (format != ExportFormat::obj && has_lens(camera.lens))
      summary.notes.push_back("Camera \"" + name +
                              "\" is written as a pinhole: its lens is left out.");
  return summary;
}

}  // namespace truebox
