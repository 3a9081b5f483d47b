// SPDX-License-Identifier: BSD-3-Clause
// Lens and sensor of a scene file's cameras.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>

#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

constexpr char kScene[] = R"(length_unit = "m"
[bands]
centres_nm = [450, 550, 650]
[materials.white]
reflectance = 0.5
exitance = { nm = [400, 500, 501, 700], value = [0, 1, 4, 4] }
[[surfaces]]
name = "floor"
material = "white"
vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
[cameras.eye]
position = [0.5, 0.5, 2]
direction = [0, 0, -1]
up = [0, 1, 0]
focal_length_mm = 20
film_mm = [36, 24]
pixels = [360, 240]
[cameras.eye.lens]
distortion = { k1 = -0.1, k2 = 0.02, k3 = 0.03, k4 = 0.04, k5 = 0.05, k6 = 0.06, p1 = 0.001, p2 = 0.002, s1 = 0.003, s2 = 0.004, s3 = 0.005, s4 = 0.006 }
principal_point_px = [183, 118]
f_number = 5.6
vignetting = { cos4 = true, polynomial = [-0.2, 0.05] }
point_spread_um = 12
veiling_glare = 0.02
filter = { nm = [400, 700], value = [0.2, 0.8] }
transmittance = 0.9
[cameras.eye.sensor]
exposure_s = 0.01
gain_dn = 0.25
offset_dn = 64
read_noise_dn = 1.5
dark_current_electrons_per_s = 3
full_well_electrons = 15000
bits = 12
bayer = "gbrg"
shot_noise = false
[cameras.eye.sensor.quantum_efficiency]
B = { nm = [400, 700], value = [0.6, 0.0] }
G = 0.5
R = { nm = [400, 700], value = [0.0, 0.6] }
)";

std::string write(const std::string& name, const std::string& text) {
  const std::string path = scratch_path("camera_file_test_" + name + ".toml");
  std::ofstream(path) << text;
  return path;
}

TEST(CameraFile, ReadsLensAndSensor) {
  const Scene scene = read_scene(write("good", kScene));
  const CameraDescription& camera = scene.cameras.at("eye");
  const LensDescription& lens = camera.lens;
  const LensDistortion& d = lens.distortion;
  const double sum = d.k1 + 10 * d.k2 + 100 * d.k3 + 1e3 * d.k4 + 1e4 * d.k5 + 1e5 * d.k6;
  EXPECT_NEAR(sum, -0.1 + 0.2 + 3.0 + 40.0 + 500.0 + 6000.0, 1e-9) << "each in its place";
  EXPECT_EQ(d.p1, 0.001);
  EXPECT_EQ(d.p2, 0.002);
  EXPECT_NEAR(d.s1 + 10 * d.s2 + 100 * d.s3 + 1e3 * d.s4, 0.003 + 0.04 + 0.5 + 6.0, 1e-12);
  EXPECT_NEAR(lens.principal_point_m[0], 3 * 1e-4, 1e-15) << "3 px right of the centre";
  EXPECT_NEAR(lens.principal_point_m[1], -2 * 1e-4, 1e-15);
  EXPECT_EQ(lens.f_number, 5.6);
  EXPECT_TRUE(lens.cos4);
  EXPECT_NEAR(lens.vignetting_at(0.5), 1.0 - 0.05 + 0.05 / 16.0, 1e-15);
  EXPECT_NEAR(lens.point_spread_m, 12e-6, 1e-18);
  EXPECT_EQ(lens.veiling_glare, 0.02);
  ASSERT_EQ(lens.transmittances.size(), 2u);
  EXPECT_NEAR(lens.transmittances[0].at(550.0), 0.5, 1e-15);
  EXPECT_EQ(lens.transmittances[1].at(999.0), 0.9);
  ASSERT_TRUE(camera.sensor);
  const SensorDescription& sensor = *camera.sensor;
  ASSERT_EQ(sensor.channels.size(), 3u);
  EXPECT_EQ(sensor.channels[0].name + sensor.channels[1].name + sensor.channels[2].name, "RGB");
  EXPECT_NEAR(sensor.channels[0].quantum_efficiency.at(700.0), 0.6, 1e-15);
  EXPECT_EQ(sensor.bayer->name(), "gbrg");
  EXPECT_EQ(sensor.exposure_s, 0.01);
  EXPECT_EQ(sensor.gain_dn, 0.25);
  EXPECT_EQ(sensor.offset_dn, 64.0);
  EXPECT_EQ(sensor.read_noise_dn, 1.5);
  EXPECT_EQ(sensor.dark_current_electrons_per_s, 3.0);
  EXPECT_EQ(sensor.full_well_electrons, 15000.0);
  EXPECT_EQ(sensor.bits, 12);
  EXPECT_FALSE(sensor.shot_noise);
  EXPECT_EQ(scene.materials[0].exitance_spectrum.values().size(), 4u) << "the lamp in full";
}

TEST(CameraFile, StaysAPinholeWithoutThem) {
  std::string text = kScene;
  text.erase(text.find("[cameras.eye.lens]"));
  const CameraDescription camera = read_scene(write("pinhole", text)).cameras.at("eye");
  EXPECT_FALSE(camera.sensor);
  EXPECT_FALSE(camera.lens.cos4);
  EXPECT_EQ(camera.lens.distortion.k1, 0.0);
  EXPECT_EQ(camera.lens.vignetting_at(3.0), 1.0);
}

struct Mistake {
  std::string name, from, to;
  std::string at;  // text in the line to be named
  std::vector<std::string> says;
};

class CameraMistake : public testing::TestWithParam<Mistake> {};

TEST_P(CameraMistake, NamesFileLineExpectedAndFound) {
  const Mistake& mistake = GetParam();
  std::string text = kScene;
  const std::size_t from = text.find(mistake.from);
  ASSERT_NE(from, std::string::npos);
  text.replace(from, mistake.from.size(), mistake.to);
  const std::string path = write(mistake.name, text);
  try {
    read_scene(path);
    FAIL() << mistake.name << " was accepted";
  } catch (const InputError& error) {
    for (const std::string& words : mistake.says) EXPECT_THAT(error.what(), HasSubstr(words));
    EXPECT_EQ(error.file(), path);
    const auto place = static_cast<long>(text.find(mistake.at));
    EXPECT_EQ(error.line(), 1 + std::count(text.begin(), text.begin() + place, '\n'))
        << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, CameraMistake,
    testing::Values(
        Mistake{"lens_key", "veiling_glare", "flare", "flare", {"veiling_glare", "\"flare\""}},
        Mistake{"sensor_key", "offset_dn", "offset", "offset = 64", {"offset_dn", "\"offset\""}},
        Mistake{"distortion_key", "k6 =", "k7 =", "k7", {"k6", "\"k7\""}},
        Mistake{"distortion_nan", "k1 = -0.1", "k1 = nan", "k1 = nan", {"finite", "nan"}},
        Mistake{"no_aperture", "f_number = 5.6", "", "[cameras.eye.sensor]", {"f_number"}},
        Mistake{"aperture", "f_number = 5.6", "f_number = 0", "f_number = 0", {"0.5 to 10000"}},
        Mistake{"glare", "veiling_glare = 0.02", "veiling_glare = 2", "veiling", {"share", "2"}},
        Mistake{"dark_corners", "[-0.2, 0.05]", "[-2.0]", "[-2.0]", {"not negative", "at r"}},
        Mistake{"principal_point", "[183, 118]", "[183]", "[183]", {"[x, y]"}},
        Mistake{"filter_above_one", "[0.2, 0.8]", "[0.2, 1.8]", "1.8", {"[0, 1]", "1.8"}},
        Mistake{"filter_too_short",
                "filter = { nm = [400, 700]",
                "filter = { nm = [500, 700]",
                "filter",
                {"covers all bands", "500"}},
        Mistake{"no_exposure", "exposure_s = 0.01", "", "[cameras.eye.sensor]", {"exposure_s"}},
        Mistake{"negative_exposure",
                "exposure_s = 0.01",
                "exposure_s = -1",
                "exposure_s = -1",
                {">= 0 s"}},
        Mistake{"no_gain", "gain_dn = 0.25", "gain_dn = 0", "gain_dn", {"DN per electron"}},
        Mistake{"bits", "bits = 12", "bits = 12.5", "bits", {"1 to 24"}},
        Mistake{"many_bits", "bits = 12", "bits = 32", "bits", {"1 to 24"}},
        Mistake{"bayer", "\"gbrg\"", "\"rggg\"", "\"rggg\"", {"rggb", "rggg"}},
        Mistake{"bayer_colours", "G = 0.5", "Y = 0.5", "bayer", {"R, G and B", "RBY"}},
        Mistake{"noise", "shot_noise = false", "shot_noise = 0", "shot_noise", {"true or false"}},
        Mistake{"lens_number",
                "[cameras.eye.lens]",
                "lens = 3\n[cameras.other]",
                "lens = 3",
                {"[cameras.NAME.lens]", "3"}}),
    [](const auto& mistake) { return mistake.param.name; });

}  // namespace
}  // namespace truebox
