// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "image/image_file.h"
#include "image/spectral_image.h"
#include "radiometry/table_file.h"
#include "support/run_command.h"

namespace truebox {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

const std::string kScene = std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml";

using Outcome = CommandOutcome;

Outcome run(const std::string& arguments) {
  return run_command("TRUEBOX_REFERENCE='" TRUEBOX_REFERENCE_DIR "' '" TRUEBOX_PROGRAM "' " +
                     arguments);
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

constexpr char kSmallRoom[] = R"(length_unit = "m"
[bands]
centres_nm = [450, 550, 650]
[materials.white]
reflectance = { nm = [400, 700], value = [0.3, 0.8] }
[materials.lamp]
reflectance = 0.5
exitance = 1
[[surfaces]]
name = "floor"
material = "white"
vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
[[surfaces]]
name = "ceiling"
material = "lamp"
vertices = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]
[[surfaces]]
name = "wall"
material = "white"
vertices = [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]
[cameras.eye]
position = [0.5, -1, 0.5]
direction = [0, 1, 0]
up = [0, 0, 1]
focal_length_mm = 35
film_mm = [24, 18]
pixels = [16, 12]
)";

class Program : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::path(testing::TempDir()) /
        ("truebox_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) +
         std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    for (const auto& entry : fs::directory_iterator(folder_))
      EXPECT_EQ(entry.path().string().find(".part"), std::string::npos)
          << entry.path() << " was left behind";
    fs::remove_all(folder_);
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return file(name);
  }
  std::string room() const { return write("room.toml", kSmallRoom); }

  fs::path folder_;
};

// The room seen through a distorting lens onto a 12-bit Bayer sensor.
std::string room_with_sensor() {
  return std::string(kSmallRoom) + R"([cameras.eye.lens]
distortion = { k1 = -0.15, p1 = 0.002 }
f_number = 8
vignetting = { cos4 = true }
point_spread_um = 800
veiling_glare = 0.01
[cameras.eye.sensor]
exposure_s = 1e-6
gain_dn = 0.5
offset_dn = 64
read_noise_dn = 2
bits = 12
bayer = "rggb"
quantum_efficiency = { R = 0.3, G = 0.4, B = 0.2 }
)";
}

TEST_F(Program, EveryCommandHasHelpWithAnExample) {
  for (const char* command :
       {"", "demo", "plan", "solve", "probe", "render", "calibrate", "chart", "fit", "compare",
        "suite", "accept", "report", "validate", "export", "sweep", "merge"}) {
    const Outcome help = run(std::string(command) + " --help");
    EXPECT_EQ(help.code, 0) << command;
    EXPECT_THAT(help.text, HasSubstr("Example")) << command;
  }
}

TEST_F(Program, ExportsToEveryFormat) {
  for (const std::string to : {"mitsuba", "pbrt", "radiance", "obj", "gltf"}) {
    const Outcome done = run("export " + room() + " --to " + to + " -o " + file(to));
    EXPECT_EQ(done.code, 0) << done.text;
    EXPECT_THAT(done.text, HasSubstr("/" + to + "/scene."));
    EXPECT_FALSE(fs::is_empty(folder_ / to));
  }
  EXPECT_EQ(run("export " + room() + " --to povray -o x").code, 64);
  EXPECT_EQ(run("export " + room() + " --to pbrt -o " + file("x.rad")).code, 4);
  EXPECT_EQ(run("export " + room() + " --to obj --rgb-bands 1 2 3 -o " + file("x")).code, 4);
  EXPECT_FALSE(fs::exists(file("x")));
}

// A render as Mitsuba's film names it, in another unit: the map makes it the same image.
TEST_F(Program, ComparesChannelsByAMap) {
  Image ours(3, 2), theirs(3, 2);
  ours.add_channel("S0.450,000000nm", 2.0f);
  ours.add_channel("S0.550,000000nm", 3.0f);
  theirs.add_channel("band_450_000nm", 200.0f);
  theirs.add_channel("band_550_000nm", 300.0f);
  write_exr(file("ours.exr"), ours);
  write_exr(file("theirs.exr"), theirs);
  const std::string images = "compare " + file("theirs.exr") + " " + file("ours.exr");
  EXPECT_EQ(run(images).code, 3);
  const Outcome mapped = run(images + " --fail 1e-6 --test-channels 'S0.{nm}nm=band_{nm}nm*0.01'");
  EXPECT_EQ(mapped.code, 0) << mapped.text;
  EXPECT_EQ(run(images + " --test-channels 'S0.450nm=Z'").code, 3);
  EXPECT_EQ(run(images + " --test-channels nonsense").code, 4);
}

TEST_F(Program, SolvesIntoEveryKindOfFile) {
  for (const char* name : {"s.json", "s.vtu", "s.glb", "s.html"}) {
    const Outcome done = run("solve " + room() + " --elements 100 -o " + file(name));
    EXPECT_EQ(done.code, 0) << done.text;
    EXPECT_GT(text_of(file(name)).size(), 1000u) << name;
  }
  EXPECT_EQ(run("solve " + room() + " -o " + file("s.stl")).code, 4);
}

TEST_F(Program, WrongUsageIs64) {
  for (const std::string arguments : {"", "nonsense", "solve", "solve --no-such-option x.toml",
                                      "render x.toml", "solve x.toml --elements many",
                                      "solve x.toml --method magic", "validate --only everything"})
    EXPECT_EQ(run(arguments).code, 64) << arguments;
}

TEST_F(Program, BrokenSceneIs4AndNamesThePlace) {
  std::string text = kSmallRoom;
  text.replace(text.find("material = \"lamp\""), 17, "material = \"lump\"");
  const std::string scene = write("broken.toml", text);
  for (const std::string& arguments :
       {"plan " + scene, "solve " + scene, "render " + scene + " -o " + file("x.exr")}) {
    const Outcome broken = run(arguments);
    EXPECT_EQ(broken.code, 4) << arguments;
    EXPECT_THAT(broken.text,
                HasSubstr("broken.toml:15: expected one of the materials lamp, white"));
    EXPECT_THAT(broken.text, HasSubstr("found \"lump\""));
  }
  EXPECT_FALSE(fs::exists(file("x.exr")));
}

TEST_F(Program, UnsortedSpectrumIs4) {
  std::string text = kSmallRoom;
  text.replace(text.find("[400, 700]"), 10, "[700, 400]");
  const Outcome broken = run("solve " + write("broken.toml", text));
  EXPECT_EQ(broken.code, 4);
  EXPECT_THAT(broken.text, HasSubstr("broken.toml:5: expected a sorted spectrum"));
}

TEST_F(Program, MissingFileIs4) {
  for (const std::string& arguments :
       {"solve " + file("none.toml"), "plan " + file("none.toml"), "fit " + file("none.toml"),
        "compare " + file("none.exr") + " " + file("none.exr"),
        "probe " + room() + " --points " + file("none.csv")}) {
    const Outcome missing = run(arguments);
    EXPECT_EQ(missing.code, 4) << arguments;
    EXPECT_THAT(missing.text, HasSubstr("none.")) << arguments;
  }
}

TEST_F(Program, UnknownCameraIs4AndListsTheKnown) {
  const Outcome unknown =
      run("render " + room() + " --elements 100 --camera ear -o " + file("x.exr"));
  EXPECT_EQ(unknown.code, 4);
  EXPECT_THAT(unknown.text, HasSubstr("eye"));
}

TEST_F(Program, PlanSaysWhyAndWritesJson) {
  const Outcome plan = run("plan " + kScene + " --json " + file("plan.json"));
  EXPECT_EQ(plan.code, 0);
  EXPECT_THAT(plan.text, HasSubstr("modelled where shafts leave it open"));
  const auto json = nlohmann::json::parse(text_of(file("plan.json")));
  EXPECT_EQ(json["bands"], 76);
  EXPECT_TRUE(json["occlusion"].get<bool>());
}

TEST_F(Program, SolveLeavesJsonAndVtu) {
  ASSERT_EQ(run("solve " + kScene + " --elements 200 -o " + file("s.json") + " --summary " +
                file("sum.json"))
                .code,
            0);
  const auto json = nlohmann::json::parse(text_of(file("s.json")));
  ASSERT_EQ(json["surfaces"].size(), 17u);
  EXPECT_EQ(json["surfaces"][0]["name"], "floor");
  EXPECT_EQ(json["surfaces"][0]["radiosity"].size(), 76u);
  EXPECT_GT(json["surfaces"][0]["radiosity"][40].get<double>(), 0.0);
  EXPECT_EQ(json["units"]["area"], "m^2");
  EXPECT_TRUE(nlohmann::json::accept(text_of(file("sum.json"))));
  ASSERT_EQ(run("solve " + room() + " --elements 200 -o " + file("s.vtu")).code, 0);
  EXPECT_THAT(text_of(file("s.vtu")), HasSubstr("</VTKFile>"));
  EXPECT_EQ(run("solve " + room() + " -o " + file("s.doc")).code, 4);
}

TEST_F(Program, ProbeLeavesATable) {
  const std::string points =
      write("p.csv", "name,x,y,z,nx,ny,nz\n\"a, b\",0.5,0.5,0,0,0,1\nc,0.2,0.3,0,0,0,2\n");
  ASSERT_EQ(
      run("probe " + room() + " --elements 200 --points " + points + " -o " + file("o.csv")).code,
      0);
  const TableFile table = read_table(file("o.csv"));
  ASSERT_EQ(table.rows.size(), 6u);
  EXPECT_EQ(table.rows[0][0], "a, b");
  EXPECT_TRUE(table.header.contains("unit"));
  for (std::size_t row = 0; row < 6; ++row) {
    EXPECT_GT(table.number(row, table.column_index("irradiance")), 0.1);
    EXPECT_LT(table.number(row, table.column_index("error_bound")),
              0.2 * table.number(row, table.column_index("irradiance")));
  }
}

TEST_F(Program, ProbeReadsFromTheFieldWhatIsWithinAShareAndGathersTheRest) {
  const std::string points =
      write("w.csv", "name,x,y,z,nx,ny,nz\non,0.5,0.5,0,0,0,1\nin_the_air,0.2,0.3,0.1,0,0,1\n");
  const std::string command =
      "probe " + room() + " --elements 200 --points " + points + " -o " + file("w_out.csv");
  EXPECT_THAT(run(command + " --within 90%").text, HasSubstr("1 of 2 points read from the field"));
  EXPECT_THAT(run(command + " --within 0.0001%").text,
              HasSubstr("0 of 2 points read from the field"));
  EXPECT_EQ(run(command + " --within 5% --reconstruction smooth").code, 64);
}

TEST_F(Program, RenderLeavesASpectralImage) {
  ASSERT_EQ(run("render " + room() + " --elements 200 --camera eye -o " + file("r.exr") +
                " --error-bound " + file("b.exr"))
                .code,
            0);
  const Image image = read_image(file("r.exr")), bound = read_image(file("b.exr"));
  EXPECT_EQ(image.width, 16);
  EXPECT_EQ(image.height, 12);
  EXPECT_THAT(spectral_channels(image).wavelengths_nm, testing::ElementsAre(450, 550, 650));
  EXPECT_EQ(spectral_channels(bound).indices.size(), 3u);
  for (const char* name : {"R", "G", "B"}) EXPECT_NE(image.find(name), nullptr) << name;
  EXPECT_EQ(image.attributes.at("unit"), "W m^-2 sr^-1 nm^-1");
  // The wall fills the middle: rho E / pi with 0 < E < 3.
  const float middle =
      image.channels[spectral_channels(image).indices[1]].samples[image.index(8, 6)];
  EXPECT_GT(middle, 0.01f);
  EXPECT_LT(middle, 1.0f);
}

TEST_F(Program, CompareTellsSizesTruncationAndAgreementApart) {
  for (const char* size : {"16 12", "12 16"})
    ASSERT_EQ(run("render " + room() + " --elements 100 --pixels " + size + " -o " +
                  file("r" + std::string(size, 2) + ".exr"))
                  .code,
              0);
  EXPECT_EQ(run("compare " + file("r16.exr") + " " + file("r16.exr")).code, 0);
  EXPECT_EQ(run("compare " + file("r16.exr") + " " + file("r12.exr")).code, 3);
  const std::string whole = text_of(file("r16.exr"));
  write("cut.exr", whole.substr(0, whole.size() / 2));
  const Outcome cut = run("compare " + file("cut.exr") + " " + file("r16.exr"));
  EXPECT_EQ(cut.code, 4);
  EXPECT_THAT(cut.text, HasSubstr("cut.exr"));
  EXPECT_EQ(run("compare " + write("empty.exr", "") + " " + file("r16.exr")).code, 4);
  EXPECT_EQ(run("compare " + write("text.exr", "no image") + " " + file("r16.exr")).code, 4);
}

TEST_F(Program, WhatCannotBeHadIs5AndWhatCannotBeWrittenIs74) {
  // 50000 elements need 18 GiB of form factors; the limit is 8 GiB.
  const Outcome large = run("solve " + room() + " --elements 50000");
  EXPECT_EQ(large.code, 5) << large.text;
  EXPECT_THAT(large.text, HasSubstr("MiB"));
  write("a_file", "in the way of a folder");
  EXPECT_EQ(run("solve " + room() + " --elements 100 -o " + file("a_file/s.json")).code, 74);
}

TEST_F(Program, ThreadsDoNotChangeANumber) {
  for (const char* threads : {"1", "2"})
    ASSERT_EQ(run("solve " + kScene + " --elements 200 --threads " + threads + " -o " +
                  file(std::string("t") + threads + ".json"))
                  .code,
              0);
  const auto one = nlohmann::json::parse(text_of(file("t1.json")));
  const auto two = nlohmann::json::parse(text_of(file("t2.json")));
  EXPECT_EQ(one["surfaces"], two["surfaces"]);
}

TEST_F(Program, SimulatedPhotographCarriesItsTruthAndItsName) {
  const std::string scene = write("sensor.toml", room_with_sensor());
  const auto photograph = [&](const std::string& name, const std::string& more) {
    return run("render " + scene + " --elements 200 --auto-exposure 0.8 " + more + " -o " +
               file(name));
  };
  const Outcome first = photograph("a.tif", "--threads 1");
  ASSERT_EQ(first.code, 0) << first.text;
  EXPECT_THAT(first.text, HasSubstr("simulated photograph"));
  ASSERT_EQ(photograph("b.png", "--threads 2").code, 0);
  ASSERT_EQ(photograph("c.exr", "--counts --noise-seed 2").code, 0);
  const Image tif = read_image(file("a.tif")), png = read_image(file("b.png"));
  const Image exr = read_image(file("c.exr")), truth = read_image(file("a.truth.exr"));
  ASSERT_EQ(tif.channels.size(), 1u) << "a mosaic";
  EXPECT_EQ(tif.channels[0].samples, png.channels[0].samples) << "same seed, other threads";
  EXPECT_NE(tif.channels[0].samples, exr.channels[0].samples) << "another seed";
  EXPECT_THAT(exr.attributes.at("simulated"), HasSubstr("not measured"));
  for (const char* name : {"a.tif", "b.png"})
    EXPECT_THAT(text_of(file(name)), HasSubstr("simulated photograph")) << name;
  EXPECT_EQ(spectral_channels(truth).indices.size(), 3u) << "the noise-free radiance";
  const Channel* expected = truth.find("expected.Y");
  const Channel* variance = truth.find("variance.Y");
  ASSERT_TRUE(expected && variance && truth.find("clipped.Y"));
  double chi2 = 0.0;
  for (std::size_t i = 0; i < tif.pixel_count(); ++i)
    chi2 += std::pow(tif.channels[0].samples[i] - expected->samples[i], 2) / variance->samples[i] /
            static_cast<double>(tif.pixel_count());
  EXPECT_LT(std::abs(chi2 - 1.0), 3.9 * std::sqrt(2.0 / 192.0)) << "192 photosites, level 0.01 %";
  const auto json = nlohmann::json::parse(text_of(file("a.json")));
  EXPECT_TRUE(json.at("simulated").get<bool>());
  EXPECT_EQ(json.at("truth"), "a.truth.exr");
  EXPECT_EQ(json.at("lens").at("distortion_opencv").at("k1"), -0.15);
  EXPECT_EQ(json.at("saturated_samples"), 0);
}

TEST_F(Program, SensorCountsNeedASensorThatFitsTheFile) {
  const std::string scene = write("sensor.toml", room_with_sensor());
  EXPECT_EQ(run("render " + room() + " -o " + file("a.tif")).code, 4) << "no sensor";
  EXPECT_EQ(run("render " + scene + " -o " + file("a.jpg")).code, 4);
  EXPECT_EQ(run("render " + scene + " --counts -o " + file("a.jpg")).code, 4);
  EXPECT_EQ(run("render " + scene + " --exposure -1 -o " + file("a.tif")).code, 64);
  EXPECT_EQ(run("render " + scene + " --exposure 1 --auto-exposure 1 -o " + file("a.tif")).code,
            64);
  std::string text = room_with_sensor();
  text.replace(text.find("bits = 12"), 9, "bits = 20");
  const Outcome deep = run("render " + write("deep.toml", text) + " -o " + file("a.tif"));
  EXPECT_EQ(deep.code, 4);
  EXPECT_THAT(deep.text, HasSubstr("1 to 16 bits"));
  EXPECT_FALSE(fs::exists(file("a.tif")));
}

TEST_F(Program, PathsGiveTheSameFileOnAnyNumberOfThreads) {
  const std::string command = "render " + room() + " --method path --samples 32 --seed 7 ";
  for (const std::string threads : {"1", "2"})
    ASSERT_EQ(run(command + "--threads " + threads + " -o " + file("p.exr") + " --variance " +
                  file("v" + threads + ".exr") + " --standard-error " + file("u.exr") + " --aov " +
                  file("a.exr"))
                  .code,
              0);
  EXPECT_EQ(text_of(file("v1.exr")).size(), text_of(file("v2.exr")).size());
  const Image one = read_image(file("v1.exr")), two = read_image(file("v2.exr"));
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(one.channels[c].samples, two.channels[c].samples);
  const Image picture = read_image(file("p.exr")), error = read_image(file("u.exr"));
  const std::size_t middle = picture.index(8, 6), band = spectral_channels(picture).indices[1];
  EXPECT_THAT(picture.attributes.at("source"), HasSubstr("simulated"));
  EXPECT_GT(picture.channels[band].samples[middle], 0.01f);
  EXPECT_GT(error.channels[1].samples[middle], 0.0f);
  EXPECT_FLOAT_EQ(std::pow(error.channels[1].samples[middle], 2.0f),
                  two.channels[1].samples[middle]);
  EXPECT_EQ(two.attributes.at("degreesOfFreedom"), "15");
}

TEST_F(Program, AovsNameTheSurfaceThatAPixelSees) {
  ASSERT_EQ(run("render " + room() + " --elements 200 -o " + file("r.exr") + " --aov " +
                file("a.exr") + " --filter tent --samples-per-pixel 4 --gather-above 50")
                .code,
            0);
  const Image aov = read_image(file("a.exr"));
  const std::size_t middle = aov.index(8, 6), corner = aov.index(0, 0);
  const auto value = [&](const char* channel, std::size_t at) {
    return aov.find(channel)->samples[at];
  };
  EXPECT_EQ(aov.attributes.at("surface.3"), "wall");
  EXPECT_EQ(value("surface.id", middle), 3.0f);
  EXPECT_EQ(value("coverage", middle), 1.0f);
  EXPECT_FLOAT_EQ(value("normal.Y", middle), -1.0f);
  EXPECT_FLOAT_EQ(value("position.Y", middle), 1.0f);
  EXPECT_GT(value("irradiance.550,000000nm", middle), 0.1f);
  EXPECT_GT(value("irradiance_bound.550,000000nm", middle), 0.0f);
  EXPECT_EQ(value("surface.id", corner), 0.0f);
}

TEST_F(Program, RadiosityRefusesAMirrorAndPathsTraceIt) {
  std::string text = kSmallRoom;
  const std::string old = "reflectance = { nm = [400, 700], value = [0.3, 0.8] }";
  text.replace(text.find(old), old.size(), "scattering = \"mirror\"\nreflectance = 0.8");
  const std::string scene = write("mirror.toml", text);
  const Outcome plan = run("plan " + scene + " --json " + file("plan.json"));
  EXPECT_EQ(plan.code, 0);
  EXPECT_THAT(plan.text, HasSubstr("surface \"floor\" is a mirror; radiosity knows"));
  EXPECT_TRUE(nlohmann::json::parse(text_of(file("plan.json")))["path_tracing"].get<bool>());
  for (const std::string& arguments : {"solve " + scene, "render " + scene + " -o " + file("x.exr"),
                                       "sweep " + scene + " --of radiosity"}) {
    const Outcome refused = run(arguments);
    EXPECT_EQ(refused.code, 4) << arguments;
    EXPECT_THAT(refused.text, HasSubstr("expected Lambertian surfaces only"));
    EXPECT_THAT(refused.text, HasSubstr("--method path"));
  }
  EXPECT_FALSE(fs::exists(file("x.exr")));
  for (const std::string to : {"mitsuba", "radiance", "obj", "gltf"})
    EXPECT_EQ(run("export " + scene + " --to " + to + " -o " + file(to)).code, 0) << to;
  const Outcome refused = run("export " + scene + " --to pbrt -o " + file("pbrt"));
  EXPECT_EQ(refused.code, 4);
  EXPECT_THAT(refused.text, HasSubstr("material \"white\": a reflectance"));
  EXPECT_EQ(run("render " + scene + " --method path --samples 16 -o " + file("x.exr")).code, 0);
}

TEST_F(Program, SweepsTheSolversAndEveryBoundHolds) {
  const Outcome swept = run("sweep " + room() + " --of radiosity --json " + file("s.json") +
                            " --plot " + file("s.svg"));
  ASSERT_EQ(swept.code, 0) << swept.text;
  const auto json = nlohmann::json::parse(text_of(file("s.json")));
  std::set<std::string> methods;
  for (const auto& point : json.at("points")) {
    methods.insert(point.at("method").get<std::string>());
    EXPECT_EQ(point.at("bound_held").get<double>(), 1.0) << point.dump();
  }
  EXPECT_EQ(methods.size(), 9u) << "eight methods, one of them with shared bands too";
  EXPECT_THAT(text_of(file("s.svg")), HasSubstr("<svg"));
}

TEST_F(Program, ProbesMeansOverAreas) {
  const std::string header =
      "# quantity: areas\n# unit: m\n# source: made up\n"
      "name,ox,oy,oz,ux,uy,uz,vx,vy,vz\n";
  const Outcome good = run("probe " + room() + " --elements 200 --areas " +
                           write("areas.csv", header + "a,0.1,0.1,0,0.2,0,0,0,0.2,0\n") + " -o " +
                           file("means.csv"));
  EXPECT_EQ(good.code, 0) << good.text;
  EXPECT_THAT(text_of(file("means.csv")), HasSubstr("\"a\","));
  const Outcome flat = run("probe " + room() + " --elements 200 --areas " +
                           write("flat.csv", header + "a,0.1,0.1,0,0.2,0,0,0.4,0,0\n"));
  EXPECT_EQ(flat.code, 4);
  EXPECT_THAT(flat.text, HasSubstr("flat.csv:5"));
  const Outcome air = run("probe " + room() + " --elements 200 --areas " +
                          write("air.csv", header + "up,0.1,0.1,0.33,0.2,0,0,0,0.2,0\n"));
  EXPECT_EQ(air.code, 4);
  EXPECT_THAT(air.text, HasSubstr("touches none"));
  EXPECT_EQ(run("probe " + room()).code, 64) << "neither points nor areas";
}

TEST_F(Program, SolvesToATargetError) {
  const Outcome found =
      run("solve " + room() + " --target-error 5% --sensitivities -o " + file("t.json"));
  ASSERT_EQ(found.code, 0) << found.text;
  EXPECT_THAT(found.text, HasSubstr("largest bound"));
  const auto json = nlohmann::json::parse(text_of(file("t.json")));
  EXPECT_LE(json.at("largest_relative_bound_of_a_surface").get<double>(), 0.05);
  EXPECT_FALSE(json.at("target_missed").get<bool>());
  EXPECT_TRUE(json.at("surfaces").at(0).contains("radiosity_by_reflectance"));
  EXPECT_EQ(run("solve " + room() + " --target-error 0").code, 64);
  EXPECT_EQ(run("solve " + room() + " --target-error half").code, 64);
}

TEST_F(Program, RefusesATargetThatMemoryDoesNotHoldAndSaysWhatItDoes) {
  const Outcome refused = run("solve " + room() + " --target-error 0.001% --memory 64 --quiet");
  EXPECT_EQ(refused.code, 5) << refused.text;
  EXPECT_THAT(refused.text, HasSubstr("elements are foretold for it"));
  EXPECT_THAT(refused.text, HasSubstr("2896 fit, for which a bound of"));
  const Outcome links =
      run("solve " + room() + " --target-error 5% --form-factors hierarchical --quiet");
  EXPECT_EQ(links.code, 4);
  EXPECT_THAT(links.text, HasSubstr("links have an estimate"));
}

// Polynomials and constants solve the same equation: they differ by no more than both bounds.
TEST_F(Program, SolvesOnPolynomialsWithinBothBounds) {
  const Outcome smooth =
      run("solve " + room() + " --basis quadratic --elements 60 -o " + file("p.json"));
  ASSERT_EQ(smooth.code, 0) << smooth.text;
  ASSERT_EQ(run("solve " + room() + " --elements 500 -o " + file("c.json")).code, 0);
  const auto p = nlohmann::json::parse(text_of(file("p.json"))).at("surfaces");
  const auto c = nlohmann::json::parse(text_of(file("c.json"))).at("surfaces");
  ASSERT_EQ(p.size(), 3u);
  for (std::size_t s = 0; s < p.size(); ++s)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto number = [&](const nlohmann::json& surfaces, const char* name) {
        return surfaces.at(s).at(name).at(k).get<double>();
      };
      const double bound = number(p, "radiosity_error_bound");
      EXPECT_LT(bound, 1e-3 * number(p, "radiosity"));
      EXPECT_NEAR(number(p, "radiosity"), number(c, "radiosity"),
                  bound + number(c, "radiosity_error_bound"));
    }
}

// A sheet between lamp and floor, and nothing around.
constexpr char kBlockedRoom[] = R"(length_unit = "m"
[bands]
centres_nm = [550]
[materials.lamp]
reflectance = 0.2
exitance = 1
[materials.grey]
reflectance = 0.5
[[surfaces]]
name = "low"
material = "grey"
vertices = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]
[[surfaces]]
name = "high"
material = "lamp"
vertices = [[0,0,1],[0,1,1],[1,1,1],[1,0,1]]
[[surfaces]]
name = "between"
material = "grey"
vertices = [[0.2,0.2,0.5],[0.7,0.2,0.5],[0.7,0.6,0.5],[0.2,0.6,0.5]]
)";

// Linear elements behind blocks agree with constant ones within both bounds.
TEST_F(Program, SolvesWithPolynomialsWhereSurfacesHideEachOther) {
  const std::string constant = file("constant.json"), linear = file("linear.json");
  const std::string blocked = write("blocked.toml", kBlockedRoom);
  ASSERT_EQ(run("solve '" + blocked + "' --elements 600 -o '" + constant + "'").code, 0);
  ASSERT_EQ(run("solve '" + blocked + "' --basis linear -o '" + linear + "'").code, 0);
  const auto low = [](const std::string& path) {
    const auto json = nlohmann::json::parse(std::ifstream(path));
    return std::pair(json["surfaces"][0]["radiosity"][0].get<double>(),
                     json["surfaces"][0]["radiosity_error_bound"][0].get<double>());
  };
  const auto [c, c_bound] = low(constant);
  const auto [p, p_bound] = low(linear);
  EXPECT_NEAR(c, p, c_bound + p_bound);
  EXPECT_LT(p_bound, 0.05 * p);
}

TEST_F(Program, RepairsFactorsAsItIsTold) {
  const std::string closed_box =
      std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/closed_box.toml";
  const auto solved = [&](const std::string& repair) {
    const Outcome outcome =
        run("solve '" + closed_box + "' --elements 500 --form-factors " + "ray-casting --repair " +
            repair + " -o '" + file("box.json") + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    return nlohmann::json::parse(text_of(file("box.json")))["form_factors"];
  };
  const auto left = solved("none"), scaled = solved("scaling"), squares = solved("least-squares");
  EXPECT_EQ(left["repair"], "none");
  EXPECT_EQ(left["repair_max"], 0.0);
  EXPECT_EQ(left["closure_residual_max"], left["closure_error_max"]);
  for (const auto& repaired : {scaled, squares})
    EXPECT_LT(repaired["closure_residual_max"].get<double>(),
              0.1 * left["closure_residual_max"].get<double>());
  EXPECT_LT(squares["repair_rms"].get<double>(), scaled["repair_rms"].get<double>());
  const Outcome refused =
      run("solve '" + closed_box + "' --form-factors streamed --repair none -o '" +
          file("box.json") + "'");
  EXPECT_EQ(refused.code, 4);
  EXPECT_THAT(refused.text, HasSubstr("--repair"));
}

TEST_F(Program, RefusesWhatPolynomialsCannotDo) {
  EXPECT_EQ(run("solve " + room() + " --basis linear --adaptive").code, 4);
  EXPECT_EQ(run("solve " + room() + " --basis septic").code, 64);
}

TEST_F(Program, StreamsFormFactorsToTheAnswerOfTheMatrix) {
  const Outcome none =
      run("solve " + room() + " --elements 60 --form-factors streamed -o " + file("s.json"));
  ASSERT_EQ(none.code, 0) << none.text;
  EXPECT_THAT(none.text, HasSubstr("factors not kept"));
  ASSERT_EQ(run("solve " + room() + " --elements 60 -o " + file("m.json")).code, 0);
  const auto s = nlohmann::json::parse(text_of(file("s.json"))).at("surfaces");
  const auto m = nlohmann::json::parse(text_of(file("m.json"))).at("surfaces");
  for (std::size_t k = 0; k < 3; ++k) {
    const double of_matrix = m.at(0).at("radiosity").at(k).get<double>();
    EXPECT_NEAR(s.at(0).at("radiosity").at(k).get<double>(), of_matrix, 1e-5 * of_matrix);
  }
}

TEST_F(Program, OptionsOfTheOtherMethodAreWrongUsage) {
  for (const std::string options :
       {"--method path --error-bound b.exr", "--method path --gather-above 1", "--variance v.exr",
        "--standard-error s.exr", "--method path --samples 0", "--filter wide"})
    EXPECT_EQ(run("render " + room() + " -o " + file("x.exr") + " " + options).code, 64) << options;
}

}  // namespace
}  // namespace truebox
