// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene_file.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>

#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

constexpr char kGood[] = R"(length_unit = "cm"

[bands]
from_nm = 400
to_nm = 700
step_nm = 100

[materials.white]
reflectance = { nm = [400, 700], value = [0.2, 0.8] }

[materials.lamp]
reflectance = 0.5
exitance = { file = "scene_file_test_lamp.csv", column = "power" }

[[surfaces]]
name = "floor"
material = "white"
vertices = [[0, 0, 0], [100, 0, 0], [100, 100, 0], [0, 100, 0]]
holes = [[[20, 20, 0], [40, 20, 0], [40, 40, 0], [20, 40, 0]]]

[[surfaces]]
name = "lamp"
material = "lamp"
vertices = [[0, 0, 100], [0, 100, 100], [100, 100, 101], [100, 0, 100]]
two_sided = true

[[openings]]
name = "window"
vertices = [[0, 0, 0], [0, 100, 0], [0, 100, 100]]

[cameras.front]
position = [50, 50, 50]
direction = [0, 0, -1]
up = [0, 1, 0]
focal_length_mm = 35
film_mm = [25, 20]
pixels = [10, 8]
)";

std::string write(const std::string& name, const std::string& text) {
  const std::string path = scratch_path(name);
  std::ofstream(path) << text;
  return path;
}

void write_lamp() {
  write("scene_file_test_lamp.csv", "# unit: W\nnm,power,negative\n400,1,1\n700,4,-1\n");
  write("scene_file_test_unsorted.csv", "# unit: W\nnm,power\n700,4\n400,1\n");
}

int line_of(const std::string& text, const std::string& needle) {
  return 1 + static_cast<int>(std::count(
                 text.begin(), text.begin() + static_cast<long>(text.find(needle)), '\n'));
}

TEST(SceneFile, ReadsAGoodScene) {
  write_lamp();
  const Scene scene = read_scene(write("scene_file_test_good.toml", kGood));
  EXPECT_EQ(scene.metres_per_unit, 0.01);
  ASSERT_EQ(scene.bands.size(), 4u);
  ASSERT_EQ(scene.surfaces.size(), 3u);
  double area = 0.0;
  for (const Polygon& piece : scene.surfaces[0].pieces) area += area_vector(piece).norm();
  EXPECT_NEAR(area, 1.0 - 0.04, 1e-14) << "m^2";
  EXPECT_EQ(scene.surfaces[1].pieces.size(), 4u) << "a bent quad is two triangles, two-sided four";
  EXPECT_TRUE(scene.surfaces[2].is_opening) << "openings come last";
  const Material& white = scene.material_of(scene.surfaces[0]);
  EXPECT_NEAR(white.reflectance[1], 0.4, 1e-14);
  EXPECT_FALSE(white.emits());
  const Material& lamp = scene.material_of(scene.surfaces[1]);
  EXPECT_NEAR(lamp.exitance[2], 3.0, 1e-14);
  EXPECT_TRUE(lamp.emits());
  const CameraDescription& camera = scene.cameras.at("front");
  EXPECT_NEAR(camera.position_m.x(), 0.5, 1e-15);
  EXPECT_NEAR(camera.film_m[1], 0.02, 1e-15);
  EXPECT_EQ(camera.pixels[1], 8);
}

TEST(SceneFile, ReadsThePublishedCornellBox) {
  const Scene scene =
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml");
  EXPECT_EQ(scene.bands.size(), 76u);
  EXPECT_EQ(scene.surfaces.size(), 17u);
  EXPECT_NEAR(scene.surfaces[0].pieces[0][0].x(), 0.5528, 1e-15);
}

// The room of kGood with the lamp's light within its bands.
std::string weighted_room(const std::string& bands) {
  std::string text = kGood;
  const std::string old = "from_nm = 400\nto_nm = 700\nstep_nm = 100";
  return text.replace(text.find(old), old.size(), bands);
}

TEST(SceneFile, WeightsBandsByTheLampsLight) {
  write("scene_file_test_lamp.csv",
        "# source: made up\nwavelength_nm,power\n400,0\n550,0\n560,2\n570,0\n700,0\n");
  const Scene scene =
      read_scene(write("weighted.toml", weighted_room("count = 3\nscheme = \"lamp_weighted\"")));
  ASSERT_EQ(scene.bands.size(), 3u);
  EXPECT_NEAR(scene.bands.centre_nm(0), 450.0, 1e-9);
  EXPECT_NEAR(scene.bands.width_nm(2), 100.0, 1e-9);
  const Material& white = scene.material_of(scene.surfaces[0]);
  EXPECT_NEAR(white.reflectance[1], 0.2 + 0.6 * 160.0 / 300.0, 1e-12) << "all light is at 560 nm";
  EXPECT_NEAR(white.reflectance[0], 0.3, 1e-12) << "no light: the plain mean";
  const Material& lamp = scene.material_of(scene.surfaces[1]);
  EXPECT_NEAR(lamp.exitance[1], 20.0 / 100.0, 1e-12) << "light is a plain mean";
}

TEST(SceneFile, TakesAsManyLampWeightedBandsAsAskedFor) {
  write("scene_file_test_lamp.csv", "# source: made up\nwavelength_nm,power\n400,1\n700,2\n");
  const std::string path = write("asked.toml", kGood);
  const Scene scene = read_scene(path, {.lamp_weighted_bands = 5});
  ASSERT_EQ(scene.bands.size(), 5u);
  EXPECT_NEAR(scene.bands.centre_nm(0) - 0.5 * scene.bands.width_nm(0), 350.0, 1e-9)
      << "over the span of the file's own bands";
  EXPECT_EQ(read_scene(path).bands.size(), 4u);
}

struct Mistake {
  std::string name;
  std::string from, to;  // the first `from` is replaced
  std::string at;        // text that stands in the line to be named; empty: no line
  std::vector<std::string> says;
};

class SceneMistake : public testing::TestWithParam<Mistake> {};

TEST_P(SceneMistake, NamesFileLineExpectedAndFound) {
  const Mistake& mistake = GetParam();
  write_lamp();
  std::string text = kGood;
  const std::size_t at = text.find(mistake.from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, mistake.from.size(), mistake.to);
  const std::string path = write("scene_file_test_" + mistake.name + ".toml", text);
  try {
    read_scene(path);
    FAIL() << mistake.name << " was accepted";
  } catch (const InputError& error) {
    for (const std::string& words : mistake.says) EXPECT_THAT(error.what(), HasSubstr(words));
    EXPECT_THAT(error.what(), HasSubstr("expected"));
    EXPECT_THAT(error.what(), HasSubstr("found"));
    if (mistake.at.empty()) return;
    EXPECT_EQ(error.file(), path);
    EXPECT_EQ(error.line(), line_of(text, mistake.at)) << error.what();
  }
}

const std::string kFloor = "vertices = [[0, 0, 0], [100, 0, 0], [100, 100, 0], [0, 100, 0]]";

INSTANTIATE_TEST_SUITE_P(
    Each, SceneMistake,
    testing::Values(
        Mistake{
            "unknown_key", "two_sided", "two_side", "two_side", {"one of the keys", "two_side"}},
        Mistake{"unknown_top_key",
                "[cameras.front]",
                "[camera.front]",
                "[camera.front]",
                {"cameras", "\"camera\""}},
        Mistake{"unknown_material",
                "material = \"white\"",
                "material = \"wite\"",
                "wite",
                {"white", "lamp", "\"wite\""}},
        Mistake{"perfect_mirror",
                "reflectance = 0.5",
                "reflectance = 1.0",
                "reflectance = 1.0",
                {"reflectance < 1", "1.0"}},
        Mistake{"negative_reflectance",
                "[0.2, 0.8]",
                "[-0.2, 0.8]",
                "[-0.2, 0.8]",
                {"0 <= reflectance", "-0.2"}},
        Mistake{"negative_emission",
                "column = \"power\"",
                "column = \"negative\"",
                "exitance",
                {"exitance >= 0", "-0.3"}},
        Mistake{"nan", "reflectance = 0.5", "reflectance = nan", "reflectance = nan", {"nan"}},
        Mistake{"infinite_vertex",
                kFloor,
                "vertices = [[0, 0, 0], [inf, 0, 0], [1, 1, 0]]",
                "[inf",
                {"a finite number", "inf"}},
        Mistake{"unsorted_inline", "nm = [400, 700]", "nm = [700, 400]", "nm = [700", {"sorted"}},
        Mistake{
            "unequal_lengths", "[0.2, 0.8]", "[0.2, 0.5, 0.8]", "[0.2, 0.5", {"as many values"}},
        Mistake{"unsorted_file",
                "scene_file_test_lamp.csv",
                "scene_file_test_unsorted.csv",
                "",
                {"scene_file_test_unsorted.csv:4", "400"}},
        Mistake{"missing_csv", "scene_file_test_lamp.csv", "nowhere.csv", "", {"nowhere.csv"}},
        Mistake{
            "missing_column", "column = \"power\"", "column = \"colour\"", "", {"power", "colour"}},
        Mistake{"bent_pentagon",
                kFloor + "\nholes",
                "vertices = [[0, 0, 0], [100, 0, 0], [100, 100, 1], [50, 120, 0], [0, 100, 0]]\n#",
                "[50, 120, 0]",
                {"planar", "bent"}},
        Mistake{"bent_with_hole",
                "[100, 100, 0], [0, 100, 0]",
                "[100, 100, 5], [0, 100, 0]",
                "[100, 100, 5]",
                {"planar", "bent"}},
        Mistake{"hole_off_the_plane",
                "[40, 40, 0]",
                "[40, 40, 3]",
                "[40, 40, 3]",
                {"holes in the plane"}},
        Mistake{"zero_area",
                kFloor,
                "vertices = [[0, 0, 0], [50, 0, 0], [100, 0, 0]]",
                "[50, 0, 0]",
                {"an area"}},
        Mistake{"two_vertices",
                kFloor,
                "vertices = [[0, 0, 0], [50, 0, 0]]",
                "[50, 0, 0]",
                {"at least three"}},
        Mistake{"crossing_outline",
                kFloor + "\nholes",
                "vertices = [[0, 0, 0], [2, 0, 0], [0, 1, 0], [3, 2, 0]]\n#",
                "[0, 1, 0]",
                {"does not cross itself"}},
        Mistake{"bad_unit", "\"cm\"", "\"ft\"", "\"ft\"", {"mm", "ft"}},
        Mistake{"unit_as_number", "\"cm\"", "0.01", "length_unit", {"a unit in quotes", "0.01"}},
        Mistake{"duplicate_name",
                "name = \"lamp\"",
                "name = \"floor\"",
                "name = \"floor\"\nmaterial = \"lamp\"",
                {"used once", "floor"}},
        Mistake{"spectrum_without_bands",
                "[bands]\nfrom_nm = 400\nto_nm = 700\nstep_nm = 100",
                "",
                "exitance",
                {"[bands]"}},
        Mistake{"unknown_scheme",
                "step_nm = 100",
                "count = 3\nscheme = \"even\"",
                "\"even\"",
                {"lamp_weighted", "even"}},
        Mistake{"count_without_scheme", "step_nm = 100", "count = 3", "[bands]", {"scheme"}},
        Mistake{"scheme_without_count",
                "step_nm = 100",
                "scheme = \"lamp_weighted\"",
                "[bands]",
                {"count"}},
        Mistake{"no_bands_at_all",
                "step_nm = 100",
                "count = 0\nscheme = \"lamp_weighted\"",
                "count = 0",
                {"1 to 1000 bands"}},
        Mistake{"count_and_step",
                "step_nm = 100",
                "step_nm = 100\ncount = 3\nscheme = \"lamp_weighted\"",
                "step_nm = 100",
                {"both"}},
        Mistake{
            "weighted_by_no_lamp",
            "step_nm = 100\n\n[materials.white]\nreflectance = { nm = [400, 700], value = [0.2, "
            "0.8] }\n\n[materials.lamp]\nreflectance = 0.5\nexitance = { file = "
            "\"scene_file_test_lamp.csv\", column = \"power\" }",
            "count = 3\nscheme = \"lamp_weighted\"\n\n[materials.white]\nreflectance = "
            "0.2\n\n[materials.lamp]\nreflectance = 0.5",
            "[bands]",
            {"exitance to weight the bands by"}},
        Mistake{"zero_step", "step_nm = 100", "step_nm = 0", "[bands]", {"usable bands"}},
        Mistake{"missing_step", "step_nm = 100", "", "[bands]", {"step_nm"}},
        Mistake{"text_as_reflectance",
                "reflectance = 0.5",
                "reflectance = \"half\"",
                "\"half\"",
                {"a reflectance", "half"}},
        Mistake{"flag_as_reflectance",
                "reflectance = 0.5",
                "reflectance = true",
                "= true\nexit",
                {"true"}},
        Mistake{"two_coordinates", "[100, 0, 0]", "[100, 0]", "[100, 0]", {"2 numbers"}},
        Mistake{"two_sided_as_number",
                "two_sided = true",
                "two_sided = 1",
                "two_sided = 1",
                {"true or false"}},
        Mistake{"no_pixels", "pixels = [10, 8]", "pixels = [0, 8]", "[0, 8]", {"1 to 32768"}},
        Mistake{"parallel_up", "up = [0, 1, 0]", "up = [0, 0, 2]", "[cameras.front]", {"parallel"}},
        Mistake{"no_focal_length",
                "focal_length_mm = 35",
                "focal_length_mm = 0",
                "focal_length_mm",
                {"positive focal length"}},
        Mistake{"syntax", "name = \"lamp\"", "name = \"lamp", "name = \"lamp", {"valid TOML"}}),
    [](const auto& mistake) { return mistake.param.name; });

TEST(SceneFile, NamesAMissingFile) {
  try {
    read_scene(scratch_path("no_such_scene.toml"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no_such_scene.toml"));
    EXPECT_THAT(error.what(), HasSubstr("no such file"));
  }
}

// The white material of kGood written anew.
std::string with_white(const std::string& lines) {
  std::string text = kGood;
  const std::string old = "reflectance = { nm = [400, 700], value = [0.2, 0.8] }";
  return text.replace(text.find(old), old.size(), lines);
}

TEST(SceneFile, ReadsSurfacesThatAreNotLambertian) {
  write_lamp();
  const auto white = [](const std::string& lines) {
    const Scene scene = read_scene(write("scene_file_test_shiny.toml", with_white(lines)));
    for (const Material& m : scene.materials)
      if (m.name == "white") return m;
    return Material{};
  };
  const Material mirror = white("scattering = \"mirror\"\nreflectance = 0.9");
  EXPECT_EQ(mirror.scattering, Scattering::mirror);
  EXPECT_EQ(mirror.reflectance[3], 0.9);
  const Material silver =
      white("scattering = \"mirror\"\nrefractive_index = 0.1\nabsorption_index = 4");
  EXPECT_EQ(silver.absorption_index[0], 4.0);
  const Material copper = white(
      "scattering = \"rough-conductor\"\nroughness = 0.2\n"
      "refractive_index = { nm = [400, 700], value = [1.2, 0.2] }\nabsorption_index = 3");
  EXPECT_EQ(copper.scattering, Scattering::rough_conductor);
  EXPECT_EQ(copper.roughness, 0.2);
  EXPECT_NEAR(copper.refractive_index[3], 0.2, 1e-12);
  const Material glass = white("scattering = \"dielectric\"\nrefractive_index = 1.5");
  EXPECT_EQ(glass.scattering, Scattering::dielectric);
  EXPECT_EQ(glass.refractive_index.size(), 4u);
  EXPECT_EQ(glass.reflectance[0], 0.0);
}

TEST(SceneFile, RefusesMaterialsThatNoMatterHas) {
  write_lamp();
  const struct {
    const char *lines, *expected;
  } kBad[] = {
      {"scattering = \"shiny\"\nreflectance = 0.5", "\"lambertian\", \"mirror\""},
      {"scattering = \"mirror\"\nreflectance = 1.0", "0 <= reflectance < 1"},
      {"scattering = \"mirror\"", "reflectance = number"},
      {"scattering = \"mirror\"\nreflectance = 0.5\nroughness = 0.1", "one of the keys"},
      {"scattering = \"mirror\"\nreflectance = 0.5\nrefractive_index = 1\nabsorption_index = 1",
       "which say the same"},
      {"scattering = \"rough-conductor\"\nrefractive_index = 1\nabsorption_index = 1",
       "roughness = number"},
      {"scattering = \"rough-conductor\"\nrefractive_index = 1\nabsorption_index = 1\n"
       "roughness = 0",
       "0.01 <= roughness <= 1"},
      {"scattering = \"rough-conductor\"\nrefractive_index = 1\nabsorption_index = -1\n"
       "roughness = 0.5",
       "absorption index of 0 or more"},
      {"scattering = \"dielectric\"\nrefractive_index = 0", "a refractive index above 0"},
      {"scattering = \"dielectric\"\nrefractive_index = 1.5\nexitance = 1", "one of the keys"},
      {"scattering = \"dielectric\"", "refractive_index = number"}};
  for (const auto& bad : kBad) {
    try {
      read_scene(write("scene_file_test_bad_material.toml", with_white(bad.lines)));
      ADD_FAILURE() << bad.lines;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(bad.expected)) << bad.lines;
      EXPECT_GT(error.line(), 0);
    }
  }
}

TEST(SceneFile, RefusesGlassWithTwoLitSides) {
  write_lamp();
  std::string text = with_white("scattering = \"dielectric\"\nrefractive_index = 1.5");
  const std::string old = "material = \"lamp\"";
  text.replace(text.find(old), old.size(), "material = \"white\"");
  try {
    read_scene(write("scene_file_test_two_sided_glass.toml", text));
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("medium behind it"));
    EXPECT_EQ(error.line(), line_of(text, "two_sided"));
  }
}

}  // namespace
}  // namespace truebox
