// SPDX-License-Identifier: BSD-3-Clause
#include "chart_finder/chart_finder.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "image/image_file.h"
#include "readings/chart.h"

namespace truebox {
namespace {

// The chart's colours as its maker publishes them, sRGB 8 bit; they make a simulated chart.
constexpr int kColours[24][3] = {{115, 82, 68},   {194, 150, 130}, {98, 122, 157},  {87, 108, 67},
                                 {133, 128, 177}, {103, 189, 170}, {214, 126, 44},  {80, 91, 166},
                                 {193, 90, 99},   {94, 60, 108},   {157, 188, 64},  {224, 163, 46},
                                 {56, 61, 150},   {70, 148, 73},   {175, 54, 60},   {231, 199, 31},
                                 {187, 86, 149},  {8, 133, 161},   {243, 243, 242}, {200, 200, 200},
                                 {160, 160, 160}, {122, 122, 121}, {85, 85, 85},    {52, 52, 52}};

double linear(int code) { return std::pow(code / 255.0, 2.2); }

/// A chart (40 mm patches, 5 mm gaps, 8 mm rim) before an even wall, through a pinhole that stands
/// askew: mm on the chart from px, a projective map. `turned`: upside down.
ChartPicture simulated(bool turned, double noise, bool with_chart = true) {
  ChartPicture picture{.width = 480, .height = 360, .mosaic = false, .bayer = {}, .planes = {}};
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (const char* name : {"R", "G", "B"})
    picture.planes.push_back({name,
                              std::vector<float>(480 * 360),
                              std::vector<float>(480 * 360, static_cast<float>(noise)),
                              {}});
  for (int y = 0; y < 360; ++y)
    for (int x = 0; x < 480; ++x) {
      double u = x + 0.5, v = y + 0.5;
      if (turned) u = 480.0 - u, v = 360.0 - v;
      const double w = 1.0 + 4e-4 * u + 2e-4 * v;
      const double mm_x = (0.95 * u + 0.08 * v - 78.0) / w,
                   mm_y = (-0.05 * u + 0.92 * v - 42.0) / w;
      double colour[3] = {0.45, 0.45, 0.45};
      if (with_chart && mm_x > -8.0 && mm_x < 273.0 && mm_y > -8.0 && mm_y < 183.0) {
        colour[0] = colour[1] = colour[2] = 0.03;
        const int column = static_cast<int>(std::floor(mm_x / 45.0));
        const int row = static_cast<int>(std::floor(mm_y / 45.0));
        if (column >= 0 && row >= 0 && column < 6 && row < 4 && mm_x - 45.0 * column < 40.0 &&
            mm_y - 45.0 * row < 40.0)
          for (int c = 0; c < 3; ++c) colour[c] = linear(kColours[6 * row + column][c]);
      }
      for (std::size_t c = 0; c < 3; ++c)
        picture.planes[c].value[static_cast<std::size_t>(y * 480 + x)] =
            static_cast<float>(colour[c] + noise * normal(random));
    }
  return picture;
}

class SimulatedChart : public testing::TestWithParam<bool> {};

// In perspective, either way up: each mean must be that of the patch's own colour, to 5 standard
// uncertainties of 72 means (5 sigma in one of 72: 4e-5). A patch mistaken for another, or a rim
// within the average, is off by tens.
TEST_P(SimulatedChart, IsFoundAndMeasuredPatchByPatch) {
  const ChartFinding finding = find_chart(simulated(GetParam(), 0.004));
  ASSERT_TRUE(finding.found) << finding.why_not;
  ASSERT_EQ(finding.patches.size(), 24u);
  for (std::size_t p = 0; p < 24; ++p) {
    const FoundPatch& patch = finding.patches[p];
    ASSERT_EQ(patch.values.size(), 3u);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(patch.values[c].mean, linear(kColours[p][c]), 5.0 * patch.values[c].u_noise)
          << patch.name << " " << patch.values[c].plane;
      EXPECT_GT(patch.values[c].samples, 100u);
      // Nothing but noise is inside: its scatter is the noise's, 4 sigma of 100 samples and more.
      EXPECT_NEAR(patch.values[c].scatter, 0.004, 0.0012) << patch.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Turned, SimulatedChart, testing::Bool());

TEST(FindChart, NoChartIsAnOutcome) {
  const ChartFinding wall = find_chart(simulated(false, 0.004, false));
  EXPECT_FALSE(wall.found);
  EXPECT_THAT(wall.why_not, testing::HasSubstr("6 x 4"));
  EXPECT_TRUE(wall.patches.empty());
  for (const float value : {0.0f, std::nanf(""), INFINITY}) {
    ChartPicture empty{.width = 64, .height = 48, .mosaic = false, .bayer = {}, .planes = {}};
    empty.planes.push_back({"Y", std::vector<float>(64 * 48, value), {}, {}});
    EXPECT_FALSE(find_chart(empty).found) << value;
  }
  ChartPicture pixel{.width = 1, .height = 1, .mosaic = true, .bayer = {}, .planes = {}};
  pixel.planes.push_back({"Y", {1.0f}, {}, {}});
  EXPECT_FALSE(find_chart(pixel).found);
  const ChartOverlay overlay = chart_overlay(simulated(false, 0.004, false), wall);
  EXPECT_EQ(overlay.rgb.size(), 3u * 480 * 360);
}

TEST(FindChart, RefusesPlanesThatDoNotMatch) {
  ChartPicture two{.width = 2, .height = 2, .mosaic = false, .bayer = {}, .planes = {}};
  two.planes.push_back({"a", std::vector<float>(4), {}, {}});
  two.planes.push_back({"b", std::vector<float>(4), {}, {}});
  EXPECT_THROW(find_chart(two), std::invalid_argument);
  two.planes.pop_back();
  two.planes[0].value.pop_back();
  EXPECT_THROW(find_chart(two), std::invalid_argument);
}

// The photographs of a real chart: what is averaged must lie in the patch that its author labelled,
// all of it (the labels are independent of this finder).
TEST(FindChart, FindsTheRealChartWhereItsAuthorLabelledIt) {
  const std::string folder = std::string(TRUEBOX_REFERENCE_DIR) + "/llanos_narrowband/";
  ChartPicture picture;
  picture.mosaic = true;
  picture.bayer = BayerPattern("gbrg");
  for (const std::string name : {"650nm_100ms_2019-02-18-114121", "550nm_50ms_2019-02-18-113617",
                                 "450nm_100ms_2019-02-18-113136"}) {
    const Image image =
        read_image(folder + "photographs/d2_colorChecker30cm_" + name + "-0004.tif");
    picture.width = image.width;
    picture.height = image.height;
    picture.planes.push_back({name, image.channels[0].samples, {}, {}});
  }
  const ChartFinding finding = find_chart(picture);
  ASSERT_TRUE(finding.found) << finding.why_not;
  const Image labels = read_image(folder + "labels/d2_colorChecker30cm_550nm_labels.png");
  for (std::size_t p = 0; p < 24; ++p)
    for (const PixelPosition& corner : finding.patches[p].outline) {
      const int x = static_cast<int>(corner.x_px), y = static_cast<int>(corner.y_px);
      EXPECT_EQ(labels.channels[0].samples[labels.index(x, y)], static_cast<float>(p + 1))
          << finding.patches[p].name;
    }
}

}  // namespace
}  // namespace truebox
