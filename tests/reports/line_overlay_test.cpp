// SPDX-License-Identifier: BSD-3-Clause
#include "figures/line_overlay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "image/image_file.h"
#include "support/scratch.h"

namespace truebox {
namespace {

Image shown(const Picture& picture) {
  const std::string path = scratch_path("overlay.png");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(picture.png.data()),
             static_cast<std::streamsize>(picture.png.size()));
  return read_image(path);
}

TEST(LineOverlay, DrawsWhereThePhotographHasThePosition) {
  Image grey(40, 30);
  grey.add_channel("Y", 0.0f);
  // Through the centres of row 12's pixels: (0.5, 0.5) is the centre of the first.
  const Image image =
      shown(line_overlay(grey, {{{5.0, 12.5}, {35.0, 12.5}, {200, 100, 50}}}, 40, ""));
  ASSERT_EQ(image.width, 40);
  for (int y = 0; y < 30; ++y)
    for (int x = 8; x < 32; ++x) {
      const float red = image.channels[0].samples[image.index(x, y)];
      if (y == 12) {
        EXPECT_GT(red, 190.0f) << x;
      } else if (std::abs(y - 12) > 1) {
        EXPECT_EQ(red, 0.0f) << x << " " << y;
      }
    }
}

TEST(LineOverlay, ScalesSmallAndLargePhotographsWithTheirLines) {
  for (const auto& [side, wanted] : {std::pair{20, 80}, std::pair{320, 80}, std::pair{80, 80}}) {
    Image grey(side, side);
    grey.add_channel("Y", 0.0f);
    const double middle = 0.5 * side;
    const Image image = shown(
        line_overlay(grey, {{{middle, 0.0}, {middle, double(side)}, {255, 255, 255}}}, 80, ""));
    ASSERT_EQ(image.width, wanted);
    const auto& red = image.channels[0].samples;
    EXPECT_GT(red[image.index(39, 40)] + red[image.index(40, 40)], 200.0f);
    EXPECT_EQ(red[image.index(20, 40)], 0.0f);
  }
}

TEST(LineOverlay, LinesBeyondThePictureOrNowhereAreNoHarm) {
  Image grey(10, 10);
  grey.add_channel("Y", 0.5f);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Image image = shown(line_overlay(
      grey, {{{-1e9, -50.0}, {-1e8, -50.0}, {255, 0, 0}}, {{nan, 0.0}, {5.0, 5.0}, {255, 0, 0}}},
      10, ""));
  for (float v : image.channels[1].samples) EXPECT_EQ(v, image.channels[1].samples[0]);
}

}  // namespace
}  // namespace truebox
