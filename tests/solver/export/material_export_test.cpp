// SPDX-License-Identifier: BSD-3-Clause
// Surfaces that are not Lambertian: each file is read back by the rules of the program it is for.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

#include "export/scene_export.h"
#include "radiometry/input_error.h"
#include "solver/export/glb_reader.h"
#include "support/cornell_box.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::Contains;
using testing::DoubleNear;
using testing::HasSubstr;
using testing::Pointwise;

// Index and absorption rise and fall over the bands, so that a mix-up of bands would be seen.
const std::vector<double> kCopperN = {1.2, 1.15, 1.1, 1.0, 0.4, 0.22, 0.21};
const std::vector<double> kCopperK = {2.2, 2.4, 2.6, 2.6, 2.9, 3.5, 4.2};

class MaterialExport : public testing::Test {
 protected:
  MaterialExport() : scene_(cornell_box_in_seven_bands()) {
    options_.observer = read_observer(
        std::string(TRUEBOX_REFERENCE_DIR) + "/colour/cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
    options_.rgb_bands_nm = {652.0, 552.0, 452.0};
  }

  Material& red() {
    for (Material& m : scene_.materials)
      if (m.name == "red") return m;
    throw std::logic_error("the box has a red wall");
  }
  void make_mirror() {
    red().scattering = Scattering::mirror;
    red().reflectance = Reflectance(std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7});
  }
  void make_metal(Scattering kind, double roughness) {
    red().scattering = kind;
    red().refractive_index = RefractiveIndex(kCopperN);
    red().absorption_index = RefractiveIndex(kCopperK);
    red().roughness = roughness;
  }
  void make_glass(double n_at_400_nm) {
    red().scattering = Scattering::dielectric;
    red().refractive_index = RefractiveIndex(std::vector<double>(7, 1.52));
    red().refractive_index[0] = n_at_400_nm;
  }

  std::string written(ExportFormat format, const std::string& target) {
    summary_ = export_scene(scene_, format, scratch_path(target), options_);
    const auto& file = format == ExportFormat::obj ? summary_.files.at(1) : summary_.files.at(0);
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string refusal(ExportFormat format, const std::string& target) {
    try {
      written(format, target);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was refused";
  }

  Scene scene_;
  ExportOptions options_;
  ExportSummary summary_;
};

std::vector<double> numbers(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), {}};
}

std::string group(const std::string& text, const std::string& pattern) {
  std::smatch match;
  if (!std::regex_search(text, match, std::regex(pattern))) return "nothing like " + pattern;
  return match[1];
}

// Steps, two values a band: the first of each.
std::vector<double> one_a_band(const std::vector<double>& values) {
  std::vector<double> bands;
  for (std::size_t k = 0; k < values.size(); k += 2) bands.push_back(values[k]);
  return bands;
}

std::string mitsuba_bsdf(const std::string& text) {
  return group(text, R"re((<bsdf type="[a-z]+" id="s\d+_red">[^]*?</bsdf>))re");
}
std::vector<double> mitsuba_bands(const std::string& bsdf, const std::string& name) {
  return one_a_band(
      numbers(group(bsdf, "name=\"" + name + R"re(">[^]*?name="values" value="([^"]*)")re")));
}
std::vector<double> pbrt_bands(const std::string& material, const std::string& name) {
  std::vector<double> values;
  const auto all = numbers(group(material, "spectrum " + name + R"re(" \[([^\]]*)\])re"));
  for (std::size_t k = 1; k < all.size(); k += 4) values.push_back(all[k]);
  return values;
}
std::string pbrt_material(const std::string& text) {
  return group(text, R"re(MakeNamedMaterial "red" ([^]*?)\n(?:Make|Attr))re");
}

// Nine digits are written.
auto equals(const std::vector<double>& values) { return Pointwise(DoubleNear(1e-8), values); }

// Fresnel at normal incidence.
double normal_reflectance(std::size_t band) {
  const double n = kCopperN[band], k = kCopperK[band];
  return (std::pow(n - 1, 2) + k * k) / (std::pow(n + 1, 2) + k * k);
}

TEST_F(MaterialExport, AMirrorReflectsInMitsubaAndRadianceAsInTheScene) {
  make_mirror();
  const std::string bsdf = mitsuba_bsdf(written(ExportFormat::mitsuba, "mirror.xml"));
  EXPECT_THAT(bsdf, HasSubstr("type=\"conductor\""));
  EXPECT_THAT(bsdf, testing::Not(HasSubstr("\"eta\"")));  // without one it is ideal
  EXPECT_THAT(mitsuba_bands(bsdf, "specular_reflectance"), equals(red().reflectance.values));
  const std::string radiance = written(ExportFormat::radiance, "mirror.rad");
  EXPECT_THAT(numbers(group(radiance, R"(void mirror \S+_red\n0\n0\n3 (.*)\n)")),
              equals({0.6, 0.4, 0.2}));
}

TEST_F(MaterialExport, MetalsKeepTheirOpticalConstants) {
  for (const double roughness : {0.0, 0.2}) {
    make_metal(roughness > 0.0 ? Scattering::rough_conductor : Scattering::mirror, roughness);
    const std::string bsdf = mitsuba_bsdf(written(ExportFormat::mitsuba, "metal.xml"));
    EXPECT_THAT(mitsuba_bands(bsdf, "eta"), equals(kCopperN));
    EXPECT_THAT(mitsuba_bands(bsdf, "k"), equals(kCopperK));
    EXPECT_EQ(group(bsdf, R"(type="([a-z]*)\")"), roughness > 0.0 ? "roughconductor" : "conductor");
    const std::string material = pbrt_material(written(ExportFormat::pbrt, "metal.pbrt"));
    EXPECT_THAT(material, HasSubstr("[ \"conductor\" ]"));
    EXPECT_THAT(pbrt_bands(material, "eta"), equals(kCopperN));
    EXPECT_THAT(pbrt_bands(material, "k"), equals(kCopperK));
    EXPECT_EQ(numbers(group(material, R"(float roughness" \[([^\]]*)\])")).at(0), roughness);
    EXPECT_THAT(material, HasSubstr("\"bool remaproughness\" [ false ]"));
    if (roughness == 0.0) continue;
    EXPECT_THAT(bsdf, HasSubstr("name=\"distribution\" value=\"ggx\""));
    EXPECT_EQ(numbers(group(bsdf, R"(name="alpha" value="([^"]*)\")")).at(0), roughness);
  }
}

TEST_F(MaterialExport, GlassKeepsItsIndexAndWhatDispersesIsRefusedWhereItCannotBeSaid) {
  make_glass(1.52);
  const std::string bsdf = mitsuba_bsdf(written(ExportFormat::mitsuba, "glass.xml"));
  EXPECT_THAT(bsdf, HasSubstr("type=\"dielectric\""));
  EXPECT_THAT(bsdf, HasSubstr("name=\"int_ior\" value=\"1.52\""));
  EXPECT_THAT(bsdf, HasSubstr("name=\"ext_ior\" value=\"1\""));
  EXPECT_THAT(written(ExportFormat::radiance, "glass.rad"),
              testing::ContainsRegex("void dielectric [^ ]*_red\n0\n0\n5 1 1 1 1.52 0\n"));
  make_glass(1.54);
  EXPECT_THAT(refusal(ExportFormat::mitsuba, "prism.xml"),
              testing::AllOf(HasSubstr("one refractive index"), HasSubstr("from 1.52 to 1.54")));
  EXPECT_THAT(refusal(ExportFormat::radiance, "prism.rad"), HasSubstr("\"red\""));
  const std::string material = pbrt_material(written(ExportFormat::pbrt, "prism.pbrt"));
  EXPECT_THAT(material, HasSubstr("[ \"dielectric\" ]"));
  EXPECT_THAT(pbrt_bands(material, "eta"), equals(red().refractive_index.values));
}

TEST_F(MaterialExport, RefusesWhatAProgramWouldGetWrong) {
  make_mirror();
  EXPECT_THAT(refusal(ExportFormat::pbrt, "a.pbrt"), HasSubstr("the same at every angle"));
  make_metal(Scattering::mirror, 0.0);
  EXPECT_THAT(refusal(ExportFormat::radiance, "a.rad"), HasSubstr("optical constants"));
  make_metal(Scattering::rough_conductor, 0.2);
  EXPECT_THAT(refusal(ExportFormat::radiance, "b.rad"), HasSubstr("GGX"));
}

TEST_F(MaterialExport, FormatsForLookingAtSayThatTheyDiffer) {
  make_metal(Scattering::rough_conductor, 0.25);
  const std::string mtl = written(ExportFormat::obj, "metal.obj");
  const std::string metal = group(mtl, R"(newmtl s?\S*_red\n([^]*?)(?:\nnewmtl|$))");
  EXPECT_THAT(metal,
              testing::AllOf(HasSubstr("Kd 0 0 0"), HasSubstr("Pr 0.5"), HasSubstr("illum 5")));
  EXPECT_THAT(numbers(group(metal, "Ks (.*)\n")),
              equals({normal_reflectance(5), normal_reflectance(3), normal_reflectance(1)}));
  EXPECT_THAT(summary_.notes, Contains(HasSubstr("\"red\" is described for looking at")));

  const auto gltf_red = [&](const std::string& target) {
    const Glb glb = read_glb(written(ExportFormat::gltf, target));
    for (const auto& m : glb.json["materials"])
      if (m["name"] == "red") return m;
    throw std::logic_error("no material red");
  };
  const auto shining = gltf_red("metal.glb");
  EXPECT_EQ(shining["pbrMetallicRoughness"]["metallicFactor"], 1.0);
  EXPECT_EQ(shining["pbrMetallicRoughness"]["roughnessFactor"], 0.5);  // squared: 0.25
  EXPECT_NEAR(shining["pbrMetallicRoughness"]["baseColorFactor"][0].get<double>(),
              normal_reflectance(5), 1e-8);
  EXPECT_FALSE(shining.contains("extensions"));  // KHR_materials_specular 0 would unmake it
  EXPECT_THAT(summary_.notes, Contains(HasSubstr("Schlick")));

  make_glass(1.54);
  const auto clear = gltf_red("glass.glb");
  EXPECT_EQ(clear["extensions"]["KHR_materials_ior"]["ior"], 1.52);
  EXPECT_EQ(clear["extensions"]["KHR_materials_transmission"]["transmissionFactor"], 1);
  EXPECT_GT(clear["extensions"]["KHR_materials_volume"]["thicknessFactor"], 0);
  EXPECT_THAT(written(ExportFormat::obj, "glass.obj"),
              testing::AllOf(HasSubstr("Ni 1.52\n"), HasSubstr("illum 7\n")));
}

}  // namespace
}  // namespace truebox
