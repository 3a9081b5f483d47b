// SPDX-License-Identifier: BSD-3-Clause
// A photograph of a physical box, where it is at hand: TRUEBOX_LOCAL_DATA names the folder that
// holds yale_cornellbox/ (data of Xia et al., SIGGRAPH Asia 2025; no licence to redistribute).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "fit/scene_measurement_fit.h"
#include "image/image_file.h"
#include "support/scratch.h"

namespace truebox {
namespace {

// Walls and cube as published, stretched by up to 0.9 % and seen from a camera that were found from
// the photograph's edges; the lamp, a sphere of radius 3.25 mm, as a cube of the same area.
// Reflectances: the published tables at three wavelengths.
constexpr const char* kBox = R"(length_unit = "cm"
[bands]
centres_nm = [450, 550, 650]
[materials.lamp]
reflectance = 0
exitance = 1000
[materials.white]
reflectance = { nm = [450, 550, 650], value = [0.7037, 0.7140, 0.7204] }
[materials.green]
reflectance = { nm = [450, 550, 650], value = [0.0510, 0.1603, 0.0362] }
[materials.red]
reflectance = { nm = [450, 550, 650], value = [0.0360, 0.0316, 0.4248] }
[materials.brown]
reflectance = { nm = [450, 550, 650], value = [0.2757, 0.3923, 0.4791] }
[cameras.front]
position = [64.71403679, -1.8141562919, 21.9862019842]
direction = [-0.999540807774, 0.030244333613, -0.00185846164999]
up = [-0.00192061231481, -0.00202603163238, 0.999996103214]
focal_length_mm = 28.9129802519
film_mm = [36, 20.256]
pixels = [6000, 3376]
[cameras.front.lens]
principal_point_px = [3067.21581825, 1658.93403224]
distortion = { k1 = 0.241549920069, k2 = -0.781092416195 }
)";

constexpr const char* kFit = R"(title = "physical box"
source = "github mandyxmq/SpectralReconNSS @020066ea"
scene = "photographed_box.toml"
[model]
elements = 900
margin_px = 3
model_bound = "no"
[[photographs]]
file = "photographed_box.exr"
camera = "front"
saturation = 0.95
relative_u = 0.02
absolute_u = 0.002
block_relative_u = 0.02
planes = [{ channel = "R", band_nm = 650 }, { channel = "G", band_nm = 550 },
          { channel = "B", band_nm = 450 }]
[reflectances.green]
fit = "free"
[reflectances.red]
fit = "free"
[reflectances.brown]
fit = "free"
)";

void add_quad(std::string& text, const std::string& name, const std::string& material,
              const std::array<std::array<double, 3>, 4>& corners) {
  text += "[[surfaces]]\nname = \"" + name + "\"\nmaterial = \"" + material + "\"\nvertices = [";
  for (const auto& c : corners)
    text += "[" + std::to_string(c[0]) + ", " + std::to_string(c[1]) + ", " + std::to_string(c[2]) +
            "], ";
  text += "]\n";
}

/// Outward faces of a box that is turned about z.
void add_block(std::string& text, const std::string& name, const std::string& material,
               const std::array<std::array<double, 2>, 4>& foot, double low, double high) {
  const auto at = [&](std::size_t k, double z) {
    return std::array<double, 3>{foot[k % 4][0], foot[k % 4][1], z};
  };
  add_quad(text, name + " top", material, {at(0, high), at(1, high), at(2, high), at(3, high)});
  add_quad(text, name + " bottom", material, {at(3, low), at(2, low), at(1, low), at(0, low)});
  for (std::size_t k = 0; k < 4; ++k)
    add_quad(text, name + " side " + std::to_string(k), material,
             {at(k, low), at(k + 1, low), at(k + 1, high), at(k, high)});
}

std::string box_text() {
  std::string text = kBox;
  const double x0 = -40.128, x1 = 0.128, y0 = -20.3434, y1 = 20.3434, z0 = -0.4262, z1 = 40.4262;
  add_quad(text, "back", "white", {{{x0, y0, z0}, {x0, y1, z0}, {x0, y1, z1}, {x0, y0, z1}}});
  add_quad(text, "left", "green", {{{x0, y0, z1}, {x1, y0, z1}, {x1, y0, z0}, {x0, y0, z0}}});
  add_quad(text, "right", "red", {{{x0, y1, z0}, {x1, y1, z0}, {x1, y1, z1}, {x0, y1, z1}}});
  add_quad(text, "ceiling", "white", {{{x0, y1, z1}, {x1, y1, z1}, {x1, y0, z1}, {x0, y0, z1}}});
  add_quad(text, "floor", "white", {{{x0, y0, z0}, {x1, y0, z0}, {x1, y1, z0}, {x0, y1, z0}}});
  add_block(text, "cube", "brown",
            {{{-36.935, 0.7121}, {-30.3223, -10.0011}, {-19.7226, -3.3176}, {-26.3353, 7.3955}}},
            z0, 12.2521);
  const double a = 0.235;
  add_block(text, "lamp", "lamp",
            {{{41.7 - a, 16 - a}, {41.7 + a, 16 - a}, {41.7 + a, 16 + a}, {41.7 - a, 16 + a}}},
            31.7 - a, 31.7 + a);
  return text;
}

struct Bleeding {
  double scatter = 0.0;   ///< standard deviation of ln(R / G) over a white surface
  double residual = 0.0;  ///< what of it the model leaves
};

Bleeding bleeding_on(const std::string& surface, const SceneMeasurement& m, const SceneFit& fit) {
  std::map<std::size_t, std::array<const FittedReading*, 2>> pairs;
  for (const FittedReading& r : fit.readings)
    if (r.plane < 2 && m.scene().surfaces[m.model().blocks()[r.block].surface].name == surface)
      pairs[r.block][r.plane] = &r;
  std::vector<double> seen, left;
  for (const auto& [block, rg] : pairs) {
    if (!rg[0] || !rg[1] || !(rg[0]->predicted > 0.0) || !(rg[1]->predicted > 0.0)) continue;
    seen.push_back(std::log(rg[0]->value / rg[1]->value));
    left.push_back(seen.back() - std::log(rg[0]->predicted / rg[1]->predicted));
  }
  const auto deviation = [](const std::vector<double>& v) {
    double mean = 0.0, square = 0.0;
    for (const double x : v) mean += x / static_cast<double>(v.size());
    for (const double x : v) square += (x - mean) * (x - mean) / static_cast<double>(v.size());
    return std::sqrt(square);
  };
  return {deviation(seen), deviation(left)};
}

TEST(PhotographedBox, ColourBleedingIsPredictedByInterreflectionAndByNothingLess) {
  const char* folder = std::getenv("TRUEBOX_LOCAL_DATA");
  const auto photo =
      std::filesystem::path(folder ? folder : "") / "yale_cornellbox" / "brown_downsampled.exr";
  if (!folder || !std::filesystem::exists(photo)) GTEST_SKIP() << "needs TRUEBOX_LOCAL_DATA";
  write_file_atomically(scratch_path("photographed_box.toml"), box_text());
  write_file_atomically(scratch_path("photographed_box_fit.toml"), std::string(kFit));
  write_exr(scratch_path("photographed_box.exr"), read_image(photo));
  SceneMeasurement m =
      read_scene_fit(read_scene_measurement(scratch_path("photographed_box_fit.toml")));
  const SceneFit with = fit_measurement(m, {});
  m.problem.interreflection = m.file.interreflection = false;
  const SceneFit without = fit_measurement(m, {});
  ASSERT_EQ(with.summary.outcome, Outcome::converged) << with.full();
  for (const char* surface : {"floor", "ceiling", "back"}) {
    const Bleeding full = bleeding_on(surface, m, with), direct = bleeding_on(surface, m, without);
    RecordProperty(std::string(surface) + "_scatter", std::to_string(full.scatter));
    RecordProperty(std::string(surface) + "_left_with", std::to_string(full.residual));
    RecordProperty(std::string(surface) + "_left_without", std::to_string(direct.residual));
    // Under one lamp direct light has one colour on all of a white surface.
    EXPECT_GT(direct.residual, 0.9 * direct.scatter) << surface;
    EXPECT_LT(full.residual, 0.6 * full.scatter) << surface;
  }
  EXPECT_LT(with.summary.chi2, 0.7 * without.summary.chi2);
}

}  // namespace
}  // namespace truebox
