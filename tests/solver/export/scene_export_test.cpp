// SPDX-License-Identifier: BSD-3-Clause
// Each file is read back by the rules of the program it is for: geometry with its orientation,
// reflectances, and emitted radiance in that program's units.
#include "export/scene_export.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <regex>
#include <sstream>

#include "radiometry/input_error.h"
#include "solver/export/glb_reader.h"
#include "support/cornell_box.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::Contains;
using testing::HasSubstr;
namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<double> numbers(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), {}};
}

// All first groups of a pattern, in order.
std::vector<std::string> found(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> groups;
  for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at)
    groups.push_back((*at)[1]);
  return groups;
}

class SceneExport : public testing::Test {
 protected:
  SceneExport() : scene_(cornell_box_in_seven_bands()) {
    options_.observer = read_observer(
        std::string(TRUEBOX_REFERENCE_DIR) + "/colour/cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
  }

  ExportSummary write(ExportFormat format, const std::string& target) {
    return export_scene(scene_, format, scratch_path(target), options_);
  }

  std::vector<const Surface*> surfaces() const {
    std::vector<const Surface*> result;
    for (const Surface& s : scene_.surfaces)
      if (!s.is_opening) result.push_back(&s);
    return result;
  }

  // Area vectors say size, plane and lit side at once; floats are written with 9 digits.
  void expect_area_vectors(const std::vector<Vec3>& found_areas) const {
    const auto expected = surfaces();
    ASSERT_EQ(found_areas.size(), expected.size());
    for (std::size_t s = 0; s < expected.size(); ++s) {
      Vec3 area = Vec3::Zero();
      for (const Polygon& piece : expected[s]->pieces) area += area_vector(piece);
      EXPECT_LT((found_areas[s] - area).norm(), 1e-6 * area.norm()) << expected[s]->name;
    }
  }

  const Material& light() const {
    for (const Material& m : scene_.materials)
      if (m.emits()) return m;
    throw std::logic_error("the box has a light");
  }
  double light_radiance(std::size_t band) const {
    return light().exitance[band] / std::numbers::pi;
  }
  const Material& material(const std::string& name) const {
    for (const Material& m : scene_.materials)
      if (m.name == name) return m;
    throw std::logic_error("no material " + name);
  }

  Scene scene_;
  ExportOptions options_;
};

Vec3 triangle_area(const std::vector<double>& points, const std::vector<double>& corner,
                   std::size_t k) {
  const auto at = [&](std::size_t c) {
    const auto v = static_cast<std::size_t>(corner[k + c]);
    return Vec3(points.at(3 * v), points.at(3 * v + 1), points.at(3 * v + 2));
  };
  return 0.5 * (at(1) - at(0)).cross(at(2) - at(0));
}

// A spectrum given as (nm, value) pairs, as both spectral renderers take it: linear in between, 0
// outside.
double at(const std::vector<double>& nm, const std::vector<double>& value, double where) {
  for (std::size_t k = 1; k < nm.size(); ++k)
    if (where >= nm[k - 1] && where <= nm[k])
      return value[k - 1] + (value[k] - value[k - 1]) * (where - nm[k - 1]) / (nm[k] - nm[k - 1]);
  return 0.0;
}

struct Spectrum {
  std::vector<double> nm, value;
};
Spectrum from_pairs(const std::vector<double>& pairs) {
  Spectrum s;
  for (std::size_t k = 0; k + 1 < pairs.size(); k += 2) {
    s.nm.push_back(pairs[k]);
    s.value.push_back(pairs[k + 1]);
  }
  return s;
}

// pbrt: emitted radiance = L scale / sum(L ybar); a bucket holds its mean times 106.856895; R, G, B
// are ISO / 100 times the integrals with xbar, ybar, zbar.
TEST_F(SceneExport, PbrtUndoesTheNormalisationOfLights) {
  write(ExportFormat::pbrt, "box.pbrt");
  const std::string text = text_of(scratch_path("box.pbrt"));
  const Spectrum light = from_pairs(numbers(found(text, R"re("spectrum L" \[([^\]]*)\])re").at(0)));
  const double scale = numbers(found(text, R"re("float scale" \[([^\]]*)\])re").at(0)).at(0);
  const double iso = numbers(found(text, R"re("float iso" \[([^\]]*)\])re").at(0)).at(0);
  double sum = 0.0;
  for (int nm = 360; nm <= 830; ++nm)
    sum += at(light.nm, light.value, nm) * options_.observer.y_bar.at(nm);
  for (std::size_t b = 0; b < scene_.bands.size(); ++b) {
    const double emitted = at(light.nm, light.value, scene_.bands.centre_nm(b)) * scale / sum;
    EXPECT_NEAR(106.856895 * emitted, light_radiance(b), 1e-7 * light_radiance(5)) << "band " << b;
  }
  // Y of the film against our own, integral(L ybar): whole-nm sum against exact integral.
  std::vector<double> radiance;
  for (std::size_t b = 0; b < scene_.bands.size(); ++b) radiance.push_back(light_radiance(b));
  EXPECT_NEAR(iso / 100.0 * scale / tristimulus(radiance, scene_.bands, options_.observer).Y, 1.0,
              5e-3);
  EXPECT_THAT(text, HasSubstr("\"bool savefp16\" [ false ]"));
  EXPECT_THAT(text, HasSubstr("Scale -1 1 1"));  // its camera space is left-handed
}

TEST_F(SceneExport, PbrtHoldsSurfacesAndReflectances) {
  write(ExportFormat::pbrt, "box2.pbrt");
  const std::string text = text_of(scratch_path("box2.pbrt"));
  const auto indices = found(text, R"re("integer indices" \[([^\]]*)\])re");
  const auto points = found(text, R"re("point3 P" \[([^\]]*)\])re");
  ASSERT_EQ(indices.size(), points.size());
  std::vector<Vec3> areas;
  for (std::size_t s = 0; s < indices.size(); ++s) {
    areas.push_back(Vec3::Zero());
    const auto corner = numbers(indices[s]);
    for (std::size_t k = 0; k < corner.size(); k += 3)
      areas.back() += triangle_area(numbers(points[s]), corner, k);
  }
  expect_area_vectors(areas);
  const auto names = found(text, R"re(MakeNamedMaterial "([^"]*)")re");
  const auto spectra = found(text, R"re("spectrum reflectance" \[([^\]]*)\])re");
  ASSERT_EQ(names.size(), spectra.size());
  for (std::size_t m = 0; m < names.size(); ++m) {
    const Spectrum rho = from_pairs(numbers(spectra[m]));
    for (std::size_t b = 0; b < scene_.bands.size(); ++b)
      EXPECT_NEAR(at(rho.nm, rho.value, scene_.bands.centre_nm(b)),
                  material(names[m]).reflectance[b], 1e-8);
  }
}

// Mitsuba: an `irregular` emitter spectrum is radiance as it stands; a film channel is the integral
// of its response times the radiance.
TEST_F(SceneExport, MitsubaFilmHoldsTheMeanRadianceOfEachBand) {
  const ExportSummary summary = write(ExportFormat::mitsuba, "mitsuba");
  const std::string text = text_of(scratch_path("mitsuba/scene.xml"));
  EXPECT_EQ(summary.files.size(), 1 + surfaces().size());
  const auto spectra = found(text, R"re((<spectrum type="irregular"[\s\S]*?</spectrum>))re");
  Spectrum light;
  std::vector<Spectrum> film;
  std::vector<std::string> film_names;
  for (const std::string& s : spectra) {
    const Spectrum values{numbers(found(s, R"re(name="wavelengths" value="([^"]*)")re").at(0)),
                          numbers(found(s, R"re(name="values" value="([^"]*)")re").at(0))};
    ASSERT_EQ(values.nm.size(), values.value.size());
    const std::string name = found(s, R"re(name="([^"]*)")re").at(0);
    if (name == "radiance") light = values;
    if (name.starts_with("band_")) film.push_back(values), film_names.push_back(name);
  }
  ASSERT_EQ(film.size(), scene_.bands.size());
  EXPECT_EQ(film_names[1], "band_452_000nm");
  for (std::size_t b = 0; b < film.size(); ++b) {
    double channel = 0.0, step = 1e-3;  // midpoints; the flanks are 0.01 nm wide
    for (double nm = film[b].nm.front() + 0.5 * step; nm < film[b].nm.back(); nm += step)
      channel += step * at(film[b].nm, film[b].value, nm) * at(light.nm, light.value, nm);
    // 0.005 nm of each neighbour's flank in bands of 48 nm and more
    EXPECT_NEAR(channel, light_radiance(b), 5e-4 * light_radiance(5)) << film_names[b];
  }
  EXPECT_THAT(text, HasSubstr("\"component_format\" value=\"float32\""));
}

TEST_F(SceneExport, MitsubaHoldsSurfacesAndIsWellFormed) {
  write(ExportFormat::mitsuba, "mitsuba2/box.xml");
  const std::string text = text_of(scratch_path("mitsuba2/box.xml"));
  std::vector<Vec3> areas;
  for (const std::string& name : found(text, R"re(name="filename" value="([^"]*)")re")) {
    const std::string ply = text_of(scratch_path("mitsuba2/" + name));
    const auto all = numbers(ply.substr(ply.find("end_header\n") + 11));
    const auto vertices = numbers(found(ply, R"(element vertex (\d+))").at(0)).at(0);
    const std::size_t faces = static_cast<std::size_t>(3 * vertices);
    areas.push_back(Vec3::Zero());
    for (std::size_t k = faces; k < all.size(); k += 4)
      areas.back() += triangle_area(all, all, k + 1);
  }
  expect_area_vectors(areas);
  std::vector<std::string> open;
  const std::regex tag(R"(<(/?)([A-Za-z]+)[^>]*?(/?)>)");
  const std::string body = text.substr(text.find("<scene"));
  for (std::sregex_iterator t(body.begin(), body.end(), tag), end; t != end; ++t) {
    if ((*t)[3] == "/") continue;
    if ((*t)[1] == "/") {
      ASSERT_FALSE(open.empty());
      EXPECT_EQ(open.back(), (*t)[2]);
      open.pop_back();
    } else {
      open.push_back((*t)[2]);
    }
  }
  EXPECT_TRUE(open.empty());
}

// Radiance: luminance = 179 lm/W (0.265074 R + 0.670115 G + 0.064811 B), from its primaries.
TEST_F(SceneExport, RadianceHasTheLuminanceOfTheLight) {
  write(ExportFormat::radiance, "box.rad");
  const std::string text = text_of(scratch_path("box.rad"));
  const auto rgb = numbers(found(text, R"(void light \S+\n0\n0\n3 (.*)\n)").at(0));
  std::vector<double> radiance;
  for (std::size_t b = 0; b < scene_.bands.size(); ++b) radiance.push_back(light_radiance(b));
  const double expected = 683.0 * tristimulus(radiance, scene_.bands, options_.observer).Y;
  EXPECT_NEAR(179.0 * (0.265074 * rgb[0] + 0.670115 * rgb[1] + 0.064811 * rgb[2]) / expected, 1.0,
              1e-4);  // its published coefficients have six digits, rounded primaries four
}

TEST_F(SceneExport, RadianceHoldsSurfacesAndExactBands) {
  options_.rgb_bands_nm = {652.0, 552.0, 452.0};
  const ExportSummary summary = write(ExportFormat::radiance, "radiance");
  const std::string text = text_of(scratch_path("radiance/scene.rad"));
  std::map<std::string, Vec3> areas;
  const std::regex polygon(R"(\S+ polygon (s\d+)_\S*\n0\n0\n(\d+)\n([^a-z#]*))");
  for (std::sregex_iterator p(text.begin(), text.end(), polygon), end; p != end; ++p) {
    const auto v = numbers((*p)[3]);
    ASSERT_EQ(static_cast<double>(v.size()), numbers((*p)[2]).at(0));
    Polygon points;
    for (std::size_t k = 0; k < v.size(); k += 3) points.emplace_back(v[k], v[k + 1], v[k + 2]);
    areas.emplace((*p)[1], Vec3::Zero()).first->second += area_vector(points);
  }
  std::vector<Vec3> in_order;
  for (const auto& [name, area] : areas) in_order.push_back(area);
  expect_area_vectors(in_order);
  const auto rgb = numbers(found(text, R"(void light \S+\n0\n0\n3 (.*)\n)").at(0));
  const std::size_t bands[] = {5, 3, 1};
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(rgb[c] / light_radiance(bands[c]), 1.0, 1e-8);
  const auto white = numbers(found(text, R"(void plastic s\d+_white\n0\n0\n5 (.*)\n)").at(0));
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(white[c], material("white").reflectance[bands[c]], 1e-8);
  EXPECT_THAT(summary.notes, Contains(HasSubstr("lights reflect nothing")));
  EXPECT_THAT(text_of(summary.files.at(1)), HasSubstr("-vp 0.278 0.273 -0.8 -vd 0 0 1 -vu 0 1 0"));
}

TEST_F(SceneExport, ObjHoldsSurfacesAndColours) {
  options_.rgb_bands_nm = {652.0, 552.0, 452.0};
  write(ExportFormat::obj, "obj");
  std::istringstream text(text_of(scratch_path("obj/scene.obj")));
  std::vector<Vec3> vertices, areas;
  for (std::string line; std::getline(text, line);) {
    const auto v = line.size() > 2 ? numbers(line.substr(2)) : std::vector<double>();
    if (line.starts_with("v ")) vertices.emplace_back(v[0], v[1], v[2]);
    if (line.starts_with("o ")) areas.push_back(Vec3::Zero());
    if (!line.starts_with("f ")) continue;
    Polygon face;
    for (const double i : v) face.push_back(vertices.at(static_cast<std::size_t>(i) - 1));
    areas.back() += area_vector(face);
  }
  expect_area_vectors(areas);
  const std::string mtl = text_of(scratch_path("obj/scene.mtl"));
  const auto red = numbers(found(mtl, R"(_red\nKa 0 0 0\nKd (.*)\n)").at(0));
  EXPECT_NEAR(red[0], material("red").reflectance[5], 1e-8);
  EXPECT_NEAR(red[2], material("red").reflectance[1], 1e-8);
  EXPECT_NEAR(numbers(found(mtl, R"(_light\n[^n]*Ke (.*)\n)").at(0))[1], light_radiance(3), 1e-7);
}

TEST_F(SceneExport, GltfHoldsSurfacesLightAndCamera) {
  write(ExportFormat::gltf, "box.glb");
  const Glb glb = read_glb(text_of(scratch_path("box.glb")));
  std::vector<Vec3> areas;
  for (const auto& mesh : glb.json["meshes"]) {
    const auto& primitive = mesh["primitives"][0];
    const auto points = glb.floats(primitive["attributes"]["POSITION"]);
    const auto normals = glb.floats(primitive["attributes"]["NORMAL"]);
    const auto corner = glb.indices(primitive["indices"]);
    areas.push_back(Vec3::Zero());
    for (std::size_t k = 0; k < corner.size(); k += 3) {
      const Vec3 area =
          triangle_area({points.begin(), points.end()}, {corner.begin(), corner.end()}, k);
      const Vec3 normal(normals[3 * corner[k]], normals[3 * corner[k] + 1],
                        normals[3 * corner[k] + 2]);
      EXPECT_GT(area.dot(normal), 0.99999 * area.norm());
      areas.back() += area;
    }
  }
  expect_area_vectors(areas);
  // Emission in cd m^-2: 683 lm/W times the linear BT.709 of the radiance, as factor x strength.
  std::vector<double> radiance;
  for (std::size_t b = 0; b < scene_.bands.size(); ++b) radiance.push_back(light_radiance(b));
  const LinearRgb rgb = linear_bt709(tristimulus(radiance, scene_.bands, options_.observer));
  const auto& shining =
      glb.json["materials"][glb.json["meshes"][1]["primitives"][0]["material"].get<std::size_t>()];
  const double strength =
      shining["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"];
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(shining["emissiveFactor"][c].get<double>() * strength,
                std::max(0.0, 683.0 * rgb[c]), 1e-6 * strength);
  const auto& node = glb.json["nodes"].back();
  const std::vector<double> matrix = node["matrix"];
  EXPECT_NEAR(matrix[10], -1.0, 1e-12);  // it looks along its -z: world +z
  EXPECT_NEAR(matrix[0], -1.0, 1e-12);   // x to the right of the picture is world -x
  EXPECT_NEAR(matrix[14], -0.8, 1e-12);
  EXPECT_NEAR(glb.json["cameras"][0]["perspective"]["yfov"].get<double>(),
              2.0 * std::atan(12.5 / 35.0), 1e-12);
}

TEST_F(SceneExport, GltfWithABufferBesideIt) {
  const ExportSummary summary = write(ExportFormat::gltf, "text/box.gltf");
  ASSERT_EQ(summary.files.size(), 2u);
  const auto json = nlohmann::json::parse(text_of(summary.files[0]));
  EXPECT_EQ(json["buffers"][0]["uri"], "box.bin");
  EXPECT_EQ(json["buffers"][0]["byteLength"], fs::file_size(summary.files[1]));
}

TEST_F(SceneExport, RefusesWhatAFormatCannotSay) {
  const auto message = [&](ExportFormat format, const std::string& target) -> std::string {
    try {
      write(format, target);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  EXPECT_THAT(message(ExportFormat::pbrt, "box.xml"), HasSubstr(".pbrt"));
  options_.rgb_bands_nm = {650.0, 552.0, 452.0};
  EXPECT_THAT(message(ExportFormat::obj, "a.obj"), HasSubstr("the nearest is 652"));
  options_.rgb_bands_nm.reset();
  options_.camera = "side";
  EXPECT_THAT(message(ExportFormat::pbrt, "a.pbrt"), HasSubstr("front"));
  options_.camera.clear();
  scene_.cameras["front"].pixels = {512, 256};
  EXPECT_THAT(message(ExportFormat::mitsuba, "a.xml"), HasSubstr("square pixels"));
  scene_.cameras["front"].pixels = {512, 512};
  for (Surface& s : scene_.surfaces)
    if (scene_.material_of(s).emits()) {
      s.two_sided = true;
      s.pieces.push_back(Polygon(s.pieces[0].rbegin(), s.pieces[0].rend()));
    }
  EXPECT_THAT(message(ExportFormat::mitsuba, "b.xml"), HasSubstr("one side"));
  EXPECT_THAT(message(ExportFormat::radiance, "b.rad"), HasSubstr("one side"));
  EXPECT_THAT(message(ExportFormat::pbrt, "b.pbrt"), "nothing was refused");
  scene_.cameras["front"].lens.distortion.k1 = 0.1;
  EXPECT_THAT(write(ExportFormat::pbrt, "b.pbrt").notes, Contains(HasSubstr("as a pinhole")));
  scene_.is_total = true;
  EXPECT_THAT(message(ExportFormat::gltf, "total.glb"), HasSubstr("bands of wavelengths"));
  EXPECT_THAT(text_of(scratch_path("b.pbrt")), HasSubstr("\"bool twosided\" [ true ]"));
}

}  // namespace
}  // namespace truebox
