// SPDX-License-Identifier: BSD-3-Clause
// Values at points of surfaces by each reconstruction of a solution's element means.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "support/tiny_scenes.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

// A cube whose ceiling shines: floor and walls reflect.
Scene lit_cube() {
  Scene scene = tiny::cube(1.0, 0.6);
  scene.materials.push_back({"lamp", Reflectance(1, 0.3), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  return scene;
}

std::unique_ptr<Prediction> solved(const Scene& scene, std::size_t elements, Reconstruction how) {
  PredictOptions options;
  options.elements = elements;
  options.reconstruction = how;
  return std::make_unique<Prediction>(scene, options);
}

// Points of the floor, evenly spread and nowhere in step with elements (Roberts 2018). What is
// certain there: gathered from four times the elements.
struct Truth {
  std::vector<Vec3> points;
  std::vector<BoundedIrradiance> irradiance;
};

const Truth& truth() {
  static const Truth kTruth = [] {
    Truth truth;
    const Scene scene = lit_cube();
    const auto solution = solved(scene, 2400, Reconstruction::smooth);
    for (int i = 1; i <= 150; ++i) {
      const double u = 0.7548776662466927 * i, v = 0.5698402909980532 * i;
      truth.points.emplace_back(0.05 + 0.9 * (u - std::floor(u)), 0.05 + 0.9 * (v - std::floor(v)),
                                0.0);
      truth.irradiance.push_back(solution->irradiance_at(truth.points.back(), Vec3::UnitZ()));
    }
    return truth;
  }();
  return kTruth;
}

struct Errors {
  double rms = 0.0;
  std::size_t outside_bound = 0;
};

Errors errors_of(std::size_t elements, Reconstruction how) {
  const Scene scene = lit_cube();
  const auto prediction = solved(scene, elements, how);
  Gather::Scratch scratch;
  Errors errors;
  for (std::size_t i = 0; i < truth().points.size(); ++i) {
    const BoundedIrradiance& exact = truth().irradiance[i];
    const BoundedIrradiance found = prediction->irradiance_on(0, truth().points[i], scratch);
    const double error = std::abs(found.value[0] - exact.value[0]);
    errors.rms += error * error / static_cast<double>(truth().points.size());
    errors.outside_bound += error > found.error_bound[0] + exact.error_bound[0];
  }
  errors.rms = std::sqrt(errors.rms);
  return errors;
}

class Reconstructed : public testing::TestWithParam<Reconstruction> {};

TEST_P(Reconstructed, FieldOfALitCubeConvergesWithinItsBound) {
  const Errors coarse = errors_of(400, GetParam()), fine = errors_of(1600, GetParam());
  EXPECT_EQ(coarse.outside_bound, 0u);
  EXPECT_EQ(fine.outside_bound, 0u);
  // Elements of half the edge. Light darkens into the edges like x^0.7 (numerics of a 90 degree
  // edge at rho = 0.6), which constants feel everywhere near them; the others' second order shows.
  const double order = std::log2(coarse.rms / fine.rms);
  RecordProperty("order", std::to_string(order));
  EXPECT_GT(order, GetParam() == Reconstruction::constant ? 0.6 : 1.3)
      << coarse.rms << ' ' << fine.rms;
}

std::string name_of(const testing::TestParamInfo<Reconstruction>& info) {
  const char* const names[] = {"smooth", "constant", "averaged", "least_squares"};
  return names[static_cast<int>(info.param)];
}

INSTANTIATE_TEST_SUITE_P(Fields, Reconstructed,
                         testing::Values(Reconstruction::smooth, Reconstruction::constant,
                                         Reconstruction::averaged, Reconstruction::least_squares),
                         name_of);

TEST(Reconstruction, VerticesAreBetterThanConstantsAndWorseThanQuadratics) {
  const auto rms = [](Reconstruction how) { return errors_of(600, how).rms; };
  const double averaged = rms(Reconstruction::averaged),
               fitted = rms(Reconstruction::least_squares);
  EXPECT_LT(averaged, 0.75 * rms(Reconstruction::constant));
  EXPECT_LT(fitted, 0.75 * rms(Reconstruction::constant));
  EXPECT_GT(averaged, rms(Reconstruction::smooth));
  EXPECT_GT(fitted, rms(Reconstruction::smooth));
}

}  // namespace
}  // namespace truebox
