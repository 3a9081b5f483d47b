// SPDX-License-Identifier: BSD-3-Clause
#include "colour/colour_pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

/// $OCIO for the life of a test, and gone after it.
class Ocio : public testing::Test {
 protected:
  void SetUp() override { ::unsetenv("OCIO"); }
  void TearDown() override {
    ::unsetenv("OCIO");
    if (!path_.empty()) std::filesystem::remove(path_);
  }
  void use_config(const std::string& text) {
    path_ = scratch_path("config.ocio");
    std::ofstream(path_) << text;
    ::setenv("OCIO", path_.c_str(), 1);
  }
  std::string path_;
};

double srgb_encode(double v) {  // IEC 61966-2-1:1999, 5.2
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

Image rgb(float r, float g, float b) {
  Image image(1, 1);
  image.add_channel("R", r);
  image.add_channel("G", g);
  image.add_channel("B", b);
  return image;
}

TEST_F(Ocio, FollowsTheSrgbStandardAtEveryLevel) {
  const ColourPipeline pipeline;
  for (int i = 0; i <= 200; ++i) {
    const float v = static_cast<float>(std::pow(10.0, -4.0 + 4.0 * i / 200.0));
    const auto picture = pipeline.picture(rgb(v, v, v), 1.0);
    const double expected = 255.0 * srgb_encode(v);
    // Exact but for rounding to a whole DN, and 0.01 DN for float and matrix arithmetic.
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(picture.rgb[static_cast<std::size_t>(c)], expected, 0.51);
  }
}

TEST_F(Ocio, DoesNotMixTheChannels) {
  const auto picture = ColourPipeline().picture(rgb(1.0f, 0.0f, 0.25f), 1.0);
  EXPECT_EQ(picture.rgb, (std::vector<std::uint8_t>{255, 0, 137}));  // 255 * encode(1/4) = 136.96
  EXPECT_EQ(picture.clipped_pixels, 0u);
  EXPECT_EQ(picture.out_of_gamut_pixels, 0u);
}

TEST_F(Ocio, CountsWhatTheDisplayCannotShow) {
  Image image(2, 2);
  for (const char* name : {"R", "G", "B"}) image.add_channel(name, 0.5f);
  image.channels[0].samples = {0.5f, 2.0f, -0.1f, std::numeric_limits<float>::quiet_NaN()};
  const auto picture = ColourPipeline().picture(image, 1.0);
  EXPECT_EQ(picture.clipped_pixels, 1u);
  EXPECT_EQ(picture.out_of_gamut_pixels, 1u);
  EXPECT_EQ(picture.not_finite_pixels, 1u);
  EXPECT_EQ(picture.rgb[3], 255);  // clamped, not wrapped round
  EXPECT_EQ(picture.rgb[6], 0);
  EXPECT_THAT(picture.description,
              HasSubstr("1 of 4 pixels clipped, 1 out of gamut, 1 not finite"));
}

TEST_F(Ocio, ExposureIsAStatedFactor) {
  const ColourPipeline pipeline;
  EXPECT_EQ(pipeline.picture(rgb(4, 2, 1), 0.125).rgb,
            pipeline.picture(rgb(0.5, 0.25, 0.125), 1).rgb);
  EXPECT_THAT(pipeline.picture(rgb(4, 2, 1), 0.125).description, HasSubstr("exposure 0.125"));
  EXPECT_THROW(pipeline.picture(rgb(1, 1, 1), 0.0), std::invalid_argument);
}

TEST_F(Ocio, NamesWhatItUses) {
  const std::string text = ColourPipeline().description();
  for (const char* part : {"built-in", "lin_rec709_scene", "display sRGB", "view Standard", "D65"})
    EXPECT_THAT(text, HasSubstr(part));
}

TEST_F(Ocio, RespectsTheUsersConfig) {
  use_config(R"(ocio_profile_version: 2
environment: {}
search_path: ""
roles: {default: plain, scene_linear: plain}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  Mine:
    - !<View> {name: Squared, colorspace: squared}
active_displays: []
active_views: []
colorspaces:
  - !<ColorSpace> {name: plain}
  - !<ColorSpace>
    name: squared
    from_scene_reference: !<ExponentTransform> {value: [2, 2, 2, 1]}
)");
  const ColourPipeline pipeline;
  EXPECT_THAT(pipeline.description(), HasSubstr("view Squared"));
  EXPECT_THAT(pipeline.description(), HasSubstr("$OCIO"));
  EXPECT_EQ(pipeline.picture(rgb(0.5f, 0.5f, 0.5f), 1.0).rgb[0], 64);  // 255 / 4, rounded
}

TEST_F(Ocio, RefusesAConfigItCannotUse) {
  use_config("ocio_profile_version: 99\n");
  EXPECT_THROW(ColourPipeline(), InputError);
  ::setenv("OCIO", "/nowhere/config.ocio", 1);
  EXPECT_THROW(ColourPipeline(), InputError);
}

TEST_F(Ocio, AMissingChannelIsAMismatch) {
  Image image(1, 1);
  image.add_channel("Y");
  EXPECT_THROW(ColourPipeline().picture(image, 1.0), MismatchError);
}

}  // namespace
}  // namespace truebox
