// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/response_curve.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

/// What a tone-mapping camera writes of a relative exposure of 0 to 1: a power law with a shoulder.
double tone_mapped(double x) { return 255.0 * std::pow(std::min(x, 1.0), 1.0 / 2.2); }

/// The signal of a reading; readings 112 to 144 mean themselves in the geometric mean.
double true_signal(double reading) {
  double logs = 0.0;
  for (int r = 112; r <= 144; ++r) logs += std::log(r / std::pow(r, 2.2)) / 33.0;
  return std::exp(logs) * std::pow(reading, 2.2);
}

std::vector<Frame> simulated_series(unsigned seed, const std::vector<double>& exposures_s) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> log_rate(std::log(2e-3), std::log(3.0));
  std::normal_distribution<double> noise(0.0, 0.7);
  std::vector<double> rates;
  for (int i = 0; i < 80 * 60; ++i) rates.push_back(std::exp(log_rate(random)));
  std::vector<Frame> frames;
  for (double t : exposures_s) {
    Frame frame{.path = "simulated", .exposure_s = t, .image = Image(80, 60)};
    auto& y = frame.image.add_channel("Y").samples;
    for (std::size_t i = 0; i < y.size(); ++i)
      y[i] = static_cast<float>(
          std::clamp(std::round(tone_mapped(rates[i] * t) + noise(random)), 0.0, 255.0));
    frames.push_back(std::move(frame));
  }
  return frames;
}

const std::vector<double> kExposures_s = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0};

class Recovery : public testing::TestWithParam<ResponseMethod> {};

// Both methods smooth or weight the ends away; from reading 20 to 235 the curve must be the true
// one to 4 of its own standard uncertainties and half a reading's width (rounding is not noise),
// and the uncertainty small enough to mean something: 5 %.
TEST_P(Recovery, FindsThePowerLawWithinItsUncertainty) {
  const ResponseCurve curve = recover_response(simulated_series(3, kExposures_s), GetParam());
  ASSERT_TRUE(curve.found) << curve.why_not;
  ASSERT_EQ(curve.signal_dn.size(), 256u);
  double z2 = 0.0, n = 0.0, mean_relative_u = 0.0;
  EXPECT_LE(curve.lowest, 40u);
  EXPECT_GE(curve.highest, 200u);
  for (std::size_t r = std::max<std::size_t>(curve.lowest, 20);
       r <= std::min<std::size_t>(curve.highest, 235); ++r) {
    const auto& [value, u] = curve.signal_dn[r];
    const double width = 0.5 * (true_signal(r + 0.5) - true_signal(r - 0.5));
    EXPECT_NEAR(value, true_signal(r), 4.0 * u + width) << r;
    mean_relative_u += u / value;
    z2 += std::pow((value - true_signal(r)) / std::hypot(u, width), 2);
    n += 1.0;
  }
  EXPECT_LT(z2 / n, 2.0);  // readings are correlated: no sharper than this
  EXPECT_LT(mean_relative_u / n, GetParam() == ResponseMethod::debevec ? 0.03 : 0.2);
}

TEST_P(Recovery, Rises) {
  const ResponseCurve curve = recover_response(simulated_series(4, {1.0, 4.0}), GetParam(), 1, 4);
  ASSERT_TRUE(curve.found) << curve.why_not;
  for (std::size_t r = 1; r < 256; ++r)
    EXPECT_GT(curve.signal_dn[r].value, curve.signal_dn[r - 1].value) << r;
  const CameraResponse response = to_camera_response(curve);
  for (double reading : {10.0, 100.5, 200.25})
    EXPECT_NEAR(response.reading_dn(response.linear_dn(reading)), reading, 1e-6);
  EXPECT_EQ(recover_response(simulated_series(4, {1.0, 4.0}), GetParam(), 1, 4).signal_dn[77].value,
            curve.signal_dn[77].value);  // one seed, one curve
}

TEST_P(Recovery, SaysWhyThereIsNone) {
  const auto one = simulated_series(5, {1.0});
  EXPECT_THAT(recover_response(one, GetParam()).why_not, testing::HasSubstr("one exposure"));
  const auto equal = simulated_series(5, {1.0, 1.0});
  EXPECT_THAT(recover_response(equal, GetParam()).why_not, testing::HasSubstr("equal"));
  for (const float value : {0.0f, 255.0f}) {
    auto flat = simulated_series(5, {1.0, 2.0});
    for (Frame& frame : flat)
      for (float& v : frame.image.channels[0].samples) v = value;
    EXPECT_FALSE(recover_response(flat, GetParam()).found) << value;
  }
  auto sizes = simulated_series(5, {1.0, 2.0});
  sizes[1].image = Image(2, 2);
  sizes[1].image.add_channel("Y");
  EXPECT_THROW(recover_response(sizes, GetParam()), MismatchError);
}

// Sixteen exposures of a church (Debevec), where a copy is at hand: recovered from the even frames
// and from the odd ones, the curves must agree.
TEST_P(Recovery, AgreesBetweenTwoHalvesOfARealSeries) {
  const char* folder = std::getenv("TRUEBOX_LOCAL_DATA");
  if (!folder) GTEST_SKIP() << "TRUEBOX_LOCAL_DATA is not set";
  const std::filesystem::path series = std::filesystem::path(folder) / "bracket_memorial";
  std::ifstream times(series / "exposure_times.csv");
  if (!times) GTEST_SKIP() << series << " has no exposure_times.csv";
  std::vector<Frame> halves[2];
  std::string line;
  std::size_t k = 0;
  while (std::getline(times, line)) {
    std::istringstream row(line);
    std::string name, seconds;
    if (!std::getline(row, name, ',') || !std::getline(row, seconds, ',')) continue;
    if (!name.ends_with(".png")) continue;
    Image image = read_image(series / name);
    ASSERT_GE(image.channels.size(), 3u);
    Frame frame{.path = name, .exposure_s = std::stod(seconds), .image = {}};
    frame.image.width = image.width;
    frame.image.height = image.height;
    frame.image.channels.push_back(std::move(image.channels[1]));  // green
    halves[k++ % 2].push_back(std::move(frame));
  }
  ASSERT_GE(k, 8u);
  const ResponseCurve even = recover_response(halves[0], GetParam());
  const ResponseCurve odd = recover_response(halves[1], GetParam());
  ASSERT_TRUE(even.found && odd.found);
  double z2 = 0.0, n = 0.0;
  for (std::size_t r = 30; r <= 230; r += 10) {
    const auto &a = even.signal_dn[r], &b = odd.signal_dn[r];
    if (!std::isfinite(a.standard_uncertainty + b.standard_uncertainty)) continue;
    z2 += std::pow(a.value - b.value, 2) /
          (std::pow(a.standard_uncertainty, 2) + std::pow(b.standard_uncertainty, 2));
    n += 1.0;
  }
  ASSERT_GE(n, 10.0);
  EXPECT_LT(z2 / n, 4.0);  // the readings move together: two sigma of one number
}

INSTANTIATE_TEST_SUITE_P(Methods, Recovery,
                         testing::Values(ResponseMethod::debevec, ResponseMethod::robertson),
                         [](const auto& method) {
                           return method.param == ResponseMethod::debevec ? "Debevec" : "Robertson";
                         });

}  // namespace
}  // namespace truebox
