// SPDX-License-Identifier: BSD-3-Clause
// Radiative heat exchange: the same solver, emission from temperature.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "radiometry/input_error.h"
#include "radiometry/planck.h"
#include "scene/scene_file.h"
#include "support/scratch.h"
#include "transport/net_flux.h"

namespace truebox {
namespace {

using Eigen::Index;

std::string write(const std::string& name, const std::string& text) {
  const std::string path = scratch_path(name);
  std::ofstream(path) << text;
  return path;
}

std::string material(const std::string& name, double emissivity, double temperature_K) {
  return "[materials." + name + "]\nreflectance = " + std::to_string(1.0 - emissivity) +
         "\ntemperature_K = " + std::to_string(temperature_K) + "\n";
}

std::string surface(const std::string& name, const std::string& of, const std::string& vertices) {
  return "[[surfaces]]\nname = \"" + name + "\"\nmaterial = \"" + of +
         "\"\nvertices = " + vertices + "\n";
}

// Closed unit cube: floor, ceiling and four walls of one material each.
std::string cube(const std::string& bands, const std::string& materials) {
  return "length_unit = \"m\"\n" + bands + materials +
         surface("floor", "floor", "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]") +
         surface("ceiling", "ceiling", "[[0,0,1],[0,1,1],[1,1,1],[1,0,1]]") +
         surface("y0", "wall", "[[0,0,0],[0,0,1],[1,0,1],[1,0,0]]") +
         surface("y1", "wall", "[[0,1,0],[1,1,0],[1,1,1],[0,1,1]]") +
         surface("x0", "wall", "[[0,0,0],[0,1,0],[0,1,1],[0,0,1]]") +
         surface("x1", "wall", "[[1,0,0],[1,0,1],[1,1,1],[1,1,0]]");
}

PredictOptions small() {
  PredictOptions options;
  options.elements = 600;
  return options;
}

TEST(Heat, IsothermalEnclosureExchangesNone) {
  // Second law: whatever the emissivities, B = sigma T^4 and every net flux is 0.
  const Scene scene = read_scene(
      write("isothermal.toml", cube("[bands]\ntotal = true\n", material("floor", 0.9, 300.0) +
                                                                   material("ceiling", 0.2, 300.0) +
                                                                   material("wall", 0.5, 300.0))));
  const Prediction prediction(scene, small());
  for (const SurfaceFlux& flux : net_fluxes(prediction)) {
    EXPECT_LE(std::abs(flux.net_W[0]), flux.bound_W[0] + 1e-9 * blackbody_exitance(300.0));
    // The bound must be of use: well below what the surface emits, area 1 m^2.
    EXPECT_LT(flux.bound_W[0], 0.05 * blackbody_exitance(300.0));
  }
}

TEST(Heat, BlackCubeExchangesByItsViewFactors) {
  // Floor at T1, the rest at 0 K and black: q = sigma T1^4 A; the ceiling takes F = 0.199825 of it,
  // a wall 0.200044. Opposite and adjacent unit squares: Howell C-11 and C-14.
  const Scene scene = read_scene(
      write("black_cube.toml", cube("[bands]\ntotal = true\n", material("floor", 1.0, 1000.0) +
                                                                   material("ceiling", 1.0, 0.0) +
                                                                   material("wall", 1.0, 0.0))));
  const Prediction prediction(scene, small());
  const double sent = blackbody_exitance(1000.0);
  const double expected[] = {1.0,          -0.199824896, -0.200043776,
                             -0.200043776, -0.200043776, -0.200043776};
  const auto fluxes = net_fluxes(prediction);
  ASSERT_EQ(fluxes.size(), 6u);
  for (std::size_t s = 0; s < 6; ++s)
    EXPECT_NEAR(fluxes[s].net_W[0] / sent, expected[s], 2e-9) << fluxes[s].surface;
}

TEST(Heat, ParallelPlatesFollowTheTextbook) {
  // q / A = sigma (T1^4 - T2^4) / (1/e1 + 1/e2 - 1): Incropera et al. (2007), eq. 13.24. Plates of
  // edge 1 at gap 1e-7 lose 2e-7 of their view.
  const Scene scene = read_scene(write(
      "plates.toml", "length_unit = \"m\"\n[bands]\ntotal = true\n" + material("hot", 0.8, 800.0) +
                         material("cold", 0.3, 400.0) +
                         surface("hot", "hot", "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]") +
                         surface("cold", "cold", "[[0,0,1e-7],[0,1,1e-7],[1,1,1e-7],[1,0,1e-7]]")));
  const Prediction prediction(scene, small());
  const double expected =
      (blackbody_exitance(800.0) - blackbody_exitance(400.0)) / (1.0 / 0.8 + 1.0 / 0.3 - 1.0);
  const auto fluxes = net_fluxes(prediction);
  const double loss = 4e-7 * blackbody_exitance(800.0) / 0.3;
  EXPECT_NEAR(fluxes[0].net_W[0], expected, fluxes[0].bound_W[0] + loss);
  EXPECT_NEAR(fluxes[1].net_W[0], -expected, fluxes[1].bound_W[0] + loss);
  EXPECT_LT(fluxes[0].bound_W[0], 1e-3 * expected);
}

TEST(Heat, EnclosureWithoutLossesBalances) {
  const Scene scene = read_scene(
      write("balance.toml", cube("[bands]\ntotal = true\n", material("floor", 0.7, 900.0) +
                                                                material("ceiling", 0.4, 300.0) +
                                                                material("wall", 0.6, 500.0))));
  const Prediction prediction(scene, small());
  double sum = 0.0, allowed = 0.0;
  for (const SurfaceFlux& flux : net_fluxes(prediction)) {
    sum += flux.net_W[0];
    allowed += flux.bound_W[0];
  }
  EXPECT_LE(std::abs(sum), allowed);
  EXPECT_LT(allowed, 0.1 * blackbody_exitance(900.0));
}

TEST(Heat, SpectralBandsEmitByPlanck) {
  const Scene scene = read_scene(write(
      "spectral_heat.toml", cube("[bands]\nfrom_nm = 8000\nto_nm = 12000\nstep_nm = 1000\n",
                                 material("floor", 0.75, 300.0) + material("ceiling", 1.0, 0.0) +
                                     material("wall", 1.0, 0.0))));
  EXPECT_TRUE(scene.is_thermal);
  EXPECT_STREQ(scene.exitance_unit(), "W m^-2 nm^-1");
  for (std::size_t b = 0; b < scene.bands.size(); ++b) {
    const double centre = scene.bands.centre_nm(b);
    double planck = 0.0;  // the mean over the band by the midpoint rule
    for (int k = 0; k < 1000; ++k) planck += planck_exitance(centre - 499.5 + k, 300.0) / 1000.0;
    for (const Material& m : scene.materials)
      if (m.name == "floor") {
        EXPECT_NEAR(m.exitance[b], 0.75 * planck, 1e-6 * planck);
      }
  }
}

TEST(Heat, MistakesAreNamed) {
  const auto says = [](const std::string& bands, const std::string& line) -> std::string {
    const std::string text =
        cube(bands, material("floor", 0.5, 300.0) + material("ceiling", 0.5, 300.0) +
                        "[materials.wall]\nreflectance = 0.5\n" + line + "\n");
    try {
      read_scene(write("heat_mistake.toml", text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  using testing::HasSubstr;
  EXPECT_THAT(says("[bands]\ntotal = true\n", "temperature_K = -5"), HasSubstr("0 or above"));
  EXPECT_THAT(says("[bands]\ntotal = true\n", "temperature_K = \"hot\""), HasSubstr("in K"));
  EXPECT_THAT(says("", "temperature_K = 300"), HasSubstr("to emit in"));
  EXPECT_THAT(says("[bands]\ntotal = false\n", ""), HasSubstr("total = true"));
  EXPECT_THAT(says("[bands]\ntotal = true\nstep_nm = 4\n", ""), HasSubstr("total = true"));
}

}  // namespace
}  // namespace truebox
