// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_choices.h"

#include <fnmatch.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox {

using Eigen::Index;

Hold hold_of(const std::string& word) {
  return word == "free" ? Hold::free : word == "prior" ? Hold::prior : Hold::fixed;
}

namespace {

constexpr double kUsualRoughness = 0.3;  // of a satin wall paint, where nothing is said

std::string names_of(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& n : names) text += (text.empty() ? "" : ", ") + n;
  return text;
}

std::size_t material_named(const Scene& scene, const std::string& name,
                           const SceneMeasurementFile& file, int line) {
  std::vector<std::string> known;
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    if (scene.materials[m].name == name) return m;
    known.push_back(scene.materials[m].name);
  }
  throw InputError(file.path, line, "a material of the scene: " + names_of(known),
                   "\"" + name + "\"");
}

SpectralBasis basis_of(const std::string& word) {
  return word == "constant"  ? SpectralBasis::constant
         : word == "linear"  ? SpectralBasis::linear
         : word == "bspline" ? SpectralBasis::bspline
                             : SpectralBasis::bands;
}

SpectralPrior spectra_of(const MaterialChoice& choice, const Scene& scene) {
  const TableFile table = read_table(choice.spectra_path);
  Eigen::MatrixXd spectra(static_cast<Index>(table.columns.size()) - 1,
                          static_cast<Index>(scene.bands.size()));
  if (spectra.rows() < 2)
    throw InputError(choice.spectra_path, 0, "two or more columns of reflectance beside wavelength",
                     std::to_string(spectra.rows()));
  for (Index i = 0; i < spectra.rows(); ++i) {
    const auto values = sample_bands(
        spectrum_from_table(table, table.columns[static_cast<std::size_t>(i) + 1]), scene.bands);
    for (Index b = 0; b < spectra.cols(); ++b) spectra(i, b) = values[static_cast<std::size_t>(b)];
  }
  return prior_of_spectra(spectra, choice.spectra_floor_u);
}

void add_unknown(ShapedScene& shaped, ShapeUnknown unknown, const UnknownChoice& choice, double u) {
  if (choice.fit == "fixed") return;
  unknown.hold = hold_of(choice.fit);
  unknown.standard_uncertainty = u;
  shaped.values.push_back(unknown.known);
  shaped.unknowns.push_back(std::move(unknown));
}

Vec3 vector_of(const std::vector<double>& v) {
  return v.empty() ? Vec3(Vec3::Zero()) : Vec3(v[0], v[1], v[2]);
}

}  // namespace

void choose_reflectances(SceneMeasurement& m, Scene& scene) {
  m.problem.reflectances.assign(scene.materials.size(), ReflectanceChoice{});
  for (const auto& [name, choice] : m.file.reflectances) {
    const std::size_t material = material_named(scene, name, m.file, choice.line);
    ReflectanceChoice& target = m.problem.reflectances[material];
    if (!choice.same_as.empty()) {
      target.same_as = material_named(scene, choice.same_as, m.file, choice.line);
      continue;
    }
    target.hold = hold_of(choice.fit);
    target.standard_uncertainty = choice.standard_uncertainty;
    target.basis = basis_of(choice.basis);
    target.count = choice.count;
    target.curvature_u = choice.curvature_u;
    if (!choice.spectra_path.empty()) target.spectra = spectra_of(choice, scene);
    if (choice.start)
      scene.materials[material].reflectance = Reflectance(scene.bands.size(), *choice.start);
  }
}

void choose_emissions(SceneMeasurement& m) {
  const auto& lamps = m.model().lamps();
  m.problem.emissions.assign(lamps.size(), EmissionChoice{});
  for (const auto& [name, choice] : m.file.emissions) {
    const std::size_t material = material_named(m.scene(), name, m.file, choice.line);
    const auto lamp = std::find(lamps.begin(), lamps.end(), material);
    if (lamp == lamps.end())
      throw InputError(m.file.path, choice.line, "a material that emits", "\"" + name + "\"");
    m.problem.emissions[static_cast<std::size_t>(lamp - lamps.begin())] = {
        hold_of(choice.fit), choice.each_band, choice.standard_uncertainty};
  }
}

void choose_response(SceneMeasurement& m) {
  if (!m.file.response) return;
  ResponseChoice choice;
  choice.hold = hold_of(m.file.response->fit);
  choice.segments = m.file.response->segments;
  choice.decades = m.file.response->decades;
  choice.gamma_u = m.file.response->standard_uncertainty;
  choice.white = 0.0;
  for (const PlaneReadings& plane : m.problem.planes)
    for (const BlockReading& r : plane.readings) choice.white = std::max(choice.white, r.value);
  if (choice.white > 0.0) m.problem.response = choice;
}

std::vector<double> choose_gloss(SceneMeasurement& m, const Scene& scene) {
  std::vector<double> roughness(scene.materials.size(), 0.0);
  m.problem.gloss.clear();
  for (const auto& [name, choice] : m.file.reflectances) {
    const std::size_t k = material_named(scene, name, m.file, choice.line);
    if (choice.gloss) {
      m.problem.gloss.resize(scene.materials.size());
      m.problem.gloss[k] = {hold_of(choice.gloss->fit), choice.gloss->value,
                            choice.gloss->standard_uncertainty};
      roughness[k] = choice.gloss->roughness;
    } else if (m.file.consider_gloss && choice.fit != "fixed") {
      roughness[k] = kUsualRoughness;
    }
  }
  return roughness;
}

void choose_cameras(SceneMeasurement& m, const Scene& scene) {
  for (const auto& [name, choice] : m.file.cameras) {
    if (!scene.cameras.contains(name))
      throw InputError(m.file.path, choice.line, "a camera of the scene", "\"" + name + "\"");
    const auto add = [&, &camera = name](CameraTerm term, const UnknownChoice& c, double u) {
      add_unknown(m.shaped, camera_unknown(scene, camera, term), c, u);
    };
    for (const CameraTerm term : {CameraTerm::tilt, CameraTerm::pan, CameraTerm::roll})
      add(term, choice.pose, choice.pose_u_rad);
    for (const CameraTerm term : {CameraTerm::right, CameraTerm::down, CameraTerm::forward})
      add(term, choice.pose, choice.pose_u_mm);
    add(CameraTerm::focal_length, choice.focal_length, choice.focal_length.standard_uncertainty);
    for (const CameraTerm term : {CameraTerm::principal_point_x, CameraTerm::principal_point_y})
      add(term, choice.principal_point, choice.principal_point.standard_uncertainty);
    for (const CameraTerm term :
         {CameraTerm::k1, CameraTerm::k2, CameraTerm::p1, CameraTerm::p2, CameraTerm::k3})
      if (std::find(choice.distortion_terms.begin(), choice.distortion_terms.end(),
                    to_string(term)) != choice.distortion_terms.end())
        add(term, choice.distortion, choice.distortion.standard_uncertainty);
  }
}

void choose_offsets(SceneMeasurement& m, const Scene& scene) {
  for (const OffsetChoice& choice : m.file.offsets) {
    ShapeUnknown unknown;
    unknown.name = {"offset " + choice.name, "offset " + choice.name, "geometry offsets"};
    Eigen::AlignedBox3d box;
    for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
      const Surface& surface = scene.surfaces[s];
      if (std::none_of(choice.surfaces.begin(), choice.surfaces.end(), [&](const auto& pattern) {
            return fnmatch(pattern.c_str(), surface.name.c_str(), 0) == 0;
          }))
        continue;
      unknown.surfaces.push_back(s);
      for (const Polygon& piece : surface.pieces)
        for (const Vec3& v : piece) box.extend(v);
    }
    if (unknown.surfaces.empty())
      throw InputError(m.file.path, choice.line, "names of surfaces of the scene",
                       "\"" + names_of(choice.surfaces) + "\", which fit none");
    unknown.move = vector_of(choice.move);
    unknown.stretch = vector_of(choice.stretch);
    unknown.pivot_m = choice.about.empty() ? Vec3(box.center())
                                           : Vec3(scene.metres_per_unit * vector_of(choice.about));
    if (unknown.move.isZero() && unknown.stretch.isZero())
      throw InputError(m.file.path, choice.line, "a move or stretch that is not 0", "0");
    if (!unknown.move.isZero()) unknown.move.normalize();
    add_unknown(m.shaped, std::move(unknown), choice, choice.standard_uncertainty);
  }
}

}  // namespace truebox
