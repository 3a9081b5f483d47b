// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "image/image_file.h"
#include "scene/scene_file.h"
#include "sensor/camera.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

const std::string kBox = std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml";
const std::string kBoards = std::string(TRUEBOX_REFERENCE_DIR) + "/chessboard_opencv/left";

struct Finished {
  int code = -1;
  std::string text;  // stdout and stderr
};

Finished align(const std::string& arguments) {
  FILE* pipe = popen(("'" TRUEBOX_PROGRAM "' align " + arguments + " 2>&1").c_str(), "r");
  Finished run;
  if (!pipe) return run;
  for (int c; (c = fgetc(pipe)) != EOF;) run.text += static_cast<char>(c);
  const int status = pclose(pipe);
  run.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return run;
}

nlohmann::json json_of(const std::string& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

// The independent path tracer's picture of the Cornell Box, from a scene file whose camera is off.
TEST(AlignCommand, FindsTheCameraOfAnIndependentRender) {
  const std::string directory = scratch_path("aligned");
  const std::string photograph =
      std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/cornell_box_front_256_7bands.exr";
  const Scene scene = read_scene(kBox);
  // A scene file with another camera: moved by 50 mm, turned by 3 degrees, 5 % longer lens.
  const auto copy = std::filesystem::path(kBox).parent_path();
  const std::string moved = scratch_path("moved.toml");
  for (const auto& entry : std::filesystem::directory_iterator(copy))
    if (entry.path().extension() == ".csv")
      std::filesystem::copy_file(
          entry.path(), std::filesystem::path(moved).parent_path() / entry.path().filename(),
          std::filesystem::copy_options::overwrite_existing);
  std::filesystem::copy_file(kBox, moved, std::filesystem::copy_options::overwrite_existing);
  std::ofstream(moved, std::ios::app)
      << "\n[cameras.guess]\nposition = [328, 253, -830]\ndirection = [-0.05, 0.02, 1]\n"
         "up = [0.03, 1, 0]\nfocal_length_mm = 36.7\nfilm_mm = [25, 25]\npixels = [256, 256]\n";
  const Finished run = align("'" + moved + "' '" + photograph +
                             "' --camera guess --lens fixed -o '" + directory + "'");
  ASSERT_EQ(run.code, 0) << run.text;
  EXPECT_THAT(run.text, HasSubstr("converged"));
  for (const char* name : {"alignment.json", "camera.toml", "overlay.png", "report.html"})
    EXPECT_TRUE(std::filesystem::exists(directory + "/" + name)) << name;
  const auto json = json_of(directory + "/alignment.json");
  EXPECT_EQ(json["covariance"].size(), json["parameters"].size());
  // The camera block is one that a scene file takes, and sees what the published camera sees.
  {
    std::ifstream block(directory + "/camera.toml");
    std::ofstream(moved, std::ios::app) << "\n" << block.rdbuf();
  }
  const Scene again = read_scene(moved);
  const Camera found(again.cameras.at("aligned"));
  CameraDescription published = scene.cameras.begin()->second;
  published.pixels = {256, 256};
  const Camera exact(published);
  double sum = 0.0, n = 0.0;
  for (const Surface& surface : scene.surfaces)
    for (const Vec3& v : surface.pieces[0]) {
      const auto a = found.project(v), b = exact.project(v);
      sum += std::pow(a.position.x_px - b.position.x_px, 2) +
             std::pow(a.position.y_px - b.position.y_px, 2);
      n += 1.0;
    }
  // Shading between walls of one colour moves their edges by up to 0.13 px, and some of the corners
  // lie in front of what is seen.
  EXPECT_LT(std::sqrt(sum / n), 0.3) << run.text;
  for (const auto& p : json["parameters"])
    if (p["name"] == "focal length") {
      EXPECT_NEAR(p["value"].get<double>(), 35.0 / 25.0 * 256.0, 3.0 * p["u"].get<double>());
    }
}

// Corners that a person clicked on, a pixel off: no search is needed then.
TEST(AlignCommand, TakesPickedPoints) {
  const Scene scene = read_scene(kBox);
  CameraDescription published = scene.cameras.begin()->second;
  published.pixels = {256, 256};
  const Camera camera(published);
  const std::string points = scratch_path("points.csv");
  {
    std::ofstream csv(points);
    csv << "name,x,y,z,x_px,y_px,u_px\n";
    double off = 1.0;
    for (const char* name : {"back_wall", "tall_block_top", "short_block_top"})
      for (const Surface& surface : scene.surfaces)
        if (surface.name == name)
          for (const Vec3& v : surface.pieces[0]) {
            const PixelPosition at = camera.project(v).position;
            off = -off;
            csv << name << ',' << v[0] / scene.metres_per_unit << ','
                << v[1] / scene.metres_per_unit << ',' << v[2] / scene.metres_per_unit << ','
                << at.x_px + off << ',' << at.y_px - off << ",1\n";
          }
  }
  const std::string photograph =
      std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/cornell_box_front_256_7bands.exr";
  const std::string directory = scratch_path("picked");
  Finished run =
      align("'" + kBox + "' '" + photograph + "' --camera front --lens fixed --points '" + points +
            "' -o '" + directory + "'");
  ASSERT_EQ(run.code, 0) << run.text;
  const auto json = json_of(directory + "/alignment.json");
  ASSERT_GE(json["residuals"]["points_px"].size(), 8u);
  for (const auto& distance : json["residuals"]["points_px"])
    EXPECT_NEAR(distance.get<double>(), std::sqrt(2.0), 0.7);  // the edges know better
  std::ofstream(points) << "name,x,y,z,x_px,y_px,u_px\na,1,2,3,4,5,0\n";
  run = align("'" + kBox + "' '" + photograph + "' --camera front --points '" + points + "'");
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.text, HasSubstr("u_px above 0"));
  run = align("'" + kBox + "' '" + photograph + "' --camera side");
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.text, HasSubstr("one of the cameras: front"));
}

std::string render_of_box(const std::string& name) {
  const std::string path = scratch_path(name + ".exr");
  FILE* pipe = popen(("'" TRUEBOX_PROGRAM "' render '" + kBox +
                      "' --camera front --pixels 128 128 --elements 400 --rays 8 -o '" + path +
                      "' --aov '" + scratch_path(name + "_aov.exr") + "' 2>&1")
                         .c_str(),
                     "r");
  if (pipe) {
    while (fgetc(pipe) != EOF) {
    }
    pclose(pipe);
  }
  return path;
}

// The contract's form: a render by this program, a picture of the same box by another one.
TEST(AlignCommand, TakesARenderInPlaceOfAScene) {
  const std::string photograph =
      std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/cornell_box_front_256_7bands.exr";
  const std::string render = render_of_box("front"), directory = scratch_path("from_render");
  // The render names its scene and its camera; then its light is held against the photograph's.
  Finished run = align("'" + render + "' '" + photograph + "' --lens fixed --photometric -o '" +
                       directory + "'");
  ASSERT_TRUE(run.code == 0 || run.code == 1) << run.text;
  auto json = json_of(directory + "/alignment.json");
  EXPECT_EQ(json["aligned_to"], "render");
  EXPECT_EQ(json["outcome"], "converged");
  EXPECT_EQ(json["light"]["bands"].size(), 6u);  // the lamp has no light at 400 nm
  EXPECT_EQ(json["light"]["covariance"].size(), json["light"]["parameters"].size());
  EXPECT_LE(json["light"]["u_of_positions_with_light_px"].get<double>(),
            json["light"]["u_of_positions_by_edges_px"].get<double>());
  const Image mapping = read_image(directory + "/photo_from_render.exr");
  ASSERT_EQ(mapping.width, 128);
  // One camera, twice as many pixels.
  EXPECT_NEAR(mapping.find("x_px")->samples[mapping.index(64, 100)], 129.0, 0.3);
  EXPECT_NEAR(mapping.find("y_px")->samples[mapping.index(64, 100)], 201.0, 0.3);
  EXPECT_EQ(read_image(directory + "/photograph.exr").width, 128);
  // Its own edges, where its AOVs say that they are.
  run = align("'" + render + "' '" + photograph + "' --lens fixed --aov '" +
              scratch_path("front_aov.exr") + "' -o '" + directory + "'");
  ASSERT_EQ(run.code, 0) << run.text;
  EXPECT_EQ(json_of(directory + "/alignment.json")["aligned_to"], "render with AOVs");
  Image grey(128, 128);
  grey.add_channel("Y", 0.5f);
  write_exr(scratch_path("grey.exr"), grey);
  run = align("'" + render + "' '" + scratch_path("grey.exr") + "' -o '" + directory + "'");
  EXPECT_EQ(run.code, 5) << run.text;
  EXPECT_THAT(run.text, HasSubstr("does not show this box"));
}

TEST(AlignCommand, TakesAPictureOfUnknownOriginForAPrint) {
  const std::string photograph =
      std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/cornell_box_front_256_7bands.exr";
  const std::string directory = scratch_path("print");
  Finished run = align("'" + photograph + "' '" + photograph + "' -o '" + directory + "'");
  ASSERT_EQ(run.code, 0) << run.text;
  EXPECT_EQ(json_of(directory + "/alignment.json")["aligned_to"], "print");
  EXPECT_FALSE(std::filesystem::exists(directory + "/camera.toml"));  // no camera of a scene
  const Image mapping = read_image(directory + "/photo_from_render.exr");
  EXPECT_NEAR(mapping.find("x_px")->samples[mapping.index(200, 50)], 200.5, 0.05);
  run = align("'" + photograph + "' '" + photograph + "' --camera front -o '" + directory + "'");
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.text, HasSubstr("--scene with --camera"));
  run = align("'" + kBox + "' '" + photograph + "' --aov x.exr -o '" + directory + "'");
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.text, HasSubstr("a render with --aov"));
}

TEST(AlignCommand, CalibratesTheLensFromChessboards) {
  const std::string directory = scratch_path("lens");
  const Finished run = align("--chessboard 9x6 --square 25mm '" + kBoards + "01.jpg' '" + kBoards +
                             "03.jpg' '" + kBoards + "05.jpg' '" + kBoards + "08.jpg' '" + kBoards +
                             "12.jpg' -o '" + directory + "'");
  ASSERT_EQ(run.code, 0) << run.text;
  const auto json = json_of(directory + "/lens.json");
  EXPECT_EQ(json["outcome"], "converged");
  EXPECT_NEAR(json["parameters"][0]["value"].get<double>(), 536.0, 6.0);  // published: 535.9
  EXPECT_TRUE(std::filesystem::exists(directory + "/report.html"));
}

TEST(AlignCommand, SaysWhatIsWrong) {
  const std::string out = " -o '" + scratch_path("wrong") + "'";
  Finished run = align("--chessboard 9x6 --square 25mm '" + kBoards + "01.jpg'" + out);
  EXPECT_EQ(run.code, 5) << run.text;
  EXPECT_THAT(run.text, HasSubstr("do not determine the lens"));
  run = align("--chessboard 9by6 --square 25mm '" + kBoards + "01.jpg'" + out);
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.text, HasSubstr("inner corners as 9x6"));
  run = align("--chessboard 9x6 --square 25 '" + kBoards + "01.jpg'" + out);
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.text, HasSubstr("25mm"));
  run = align("'" + kBox + "'" + out);
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.text, HasSubstr("a scene file or a render, and a photograph"));
  run = align("'" + kBox + "' '" + kBoards + "01.jpg' --camera front" + out);
  EXPECT_EQ(run.code, 3);  // the camera's film is square
  EXPECT_THAT(run.text, HasSubstr("another shape"));
  Image grey(128, 128);
  grey.add_channel("Y", 0.5f);
  write_exr(scratch_path("grey.exr"), grey);
  run = align("'" + kBox + "' '" + scratch_path("grey.exr") + "' --camera front" + out);
  EXPECT_EQ(run.code, 5) << run.text;
  EXPECT_THAT(run.text, HasSubstr("does not show this box"));
}

}  // namespace
}  // namespace truebox
