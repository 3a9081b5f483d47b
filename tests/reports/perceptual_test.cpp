// SPDX-License-Identifier: BSD-3-Clause
#include "difference/perceptual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "colour/scene_linear.h"
#include "difference/delta_e_itp.h"
#include "difference/spectral_angle.h"
#include "difference/structural_similarity.h"
#include "image/spectral_image.h"
#include "support/scratch.h"

namespace truebox {
namespace {

TEST(DeltaEItp, MatchesPublishedValues) {
  // colour-science 0.4.7, documentation of RGB_to_ICtCp and delta_E_ITP (BT.2124), 7 digits shown.
  const Ictcp c = ictcp({0.45620519, 0.03081071, 0.04091952});
  EXPECT_NEAR(c.I, 0.07351364, 1e-8);
  EXPECT_NEAR(c.Ct, 0.00475253, 1e-8);
  EXPECT_NEAR(c.Cp, 0.09351596, 1e-8);
  EXPECT_NEAR(delta_e_itp({0.4885468072, -0.04739350675, 0.07475401302},
                          {0.4899203231, -0.04567508203, 0.07361341775}),
              1.4265722, 1e-7);
}

TEST(DeltaEItp, WhiteStaysNeutral) {
  const Ictcp grey = ictcp(bt2020_from_bt709({100.0, 100.0, 100.0}));
  EXPECT_NEAR(grey.I, 0.508078, 1e-5);  // SMPTE ST 2084: 100 cd m^-2 is coded as 0.508
  EXPECT_NEAR(grey.Ct, 0.0, 1e-9);
  EXPECT_NEAR(grey.Cp, 0.0, 1e-9);
}

RgbPlanes noise(std::size_t pixels, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0.0f, 1.0f);
  RgbPlanes planes;
  for (auto& plane : planes)
    for (std::size_t i = 0; i < pixels; ++i) plane.push_back(value(random));
  return planes;
}

TEST(StructuralSimilarity, OfUniformPicturesIsItsClosedForm) {
  // Without variance only luminance is left: (2 a b + C1) / (a^2 + b^2 + C1), C1 = 0.01^2.
  const RgbPlanes a{std::vector<float>(400, 0.25f), std::vector<float>(400, 0.25f),
                    std::vector<float>(400, 0.25f)};
  const RgbPlanes b{std::vector<float>(400, 0.5f), std::vector<float>(400, 0.5f),
                    std::vector<float>(400, 0.5f)};
  const double expected = (2 * 0.25 * 0.5 + 1e-4) / (0.25 * 0.25 + 0.5 * 0.5 + 1e-4);
  for (float v : structural_similarity(20, 20, a, b)) EXPECT_NEAR(v, expected, 1e-6);
}

TEST(StructuralSimilarity, FollowsItsDefinitionAtAPixel) {
  const int w = 25, h = 23, x = 12, y = 11;
  const RgbPlanes a = noise(w * h, 1), b = noise(w * h, 2);
  double expected = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {  // the window of 11 x 11, weight by weight
    double sum = 0, ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    for (int j = -5; j <= 5; ++j)
      for (int i = -5; i <= 5; ++i) {
        const double g = std::exp(-(i * i + j * j) / (2 * 1.5 * 1.5));
        const auto at = static_cast<std::size_t>((y + j) * w + x + i);
        const double p = a[c][at], q = b[c][at];
        sum += g, ma += g * p, mb += g * q, aa += g * p * p, bb += g * q * q, ab += g * p * q;
      }
    ma /= sum, mb /= sum;
    const double va = aa / sum - ma * ma, vb = bb / sum - mb * mb, cov = ab / sum - ma * mb;
    expected += (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) /
                ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4)) / 3;
  }
  EXPECT_NEAR(structural_similarity(w, h, a, b)[y * w + x], expected, 1e-6);
  for (float v : structural_similarity(w, h, a, a)) EXPECT_NEAR(v, 1.0f, 1e-6f);
}

DifferenceMap two_bands(float t1, float t2, float r1, float r2) {
  Image test(1, 1), reference(1, 1);
  for (const auto& [nm, t, r] : {std::tuple{500.0, t1, r1}, {600.0, t2, r2}}) {
    test.add_channel(spectral_channel_name(nm), t);
    reference.add_channel(spectral_channel_name(nm), r);
  }
  return difference_map(test, reference);
}

TEST(SpectralAngle, IsTheAngleBetweenSpectra) {
  EXPECT_NEAR(spectral_angle(two_bands(1, 0, 1, 1)).values[0], 45.0, 1e-4);
  EXPECT_NEAR(spectral_angle(two_bands(3, 6, 1, 2)).values[0], 0.0, 1e-4);  // brighter only
  EXPECT_NEAR(spectral_angle(two_bands(0, 1, 1, 0)).values[0], 90.0, 1e-4);
  EXPECT_EQ(spectral_angle(two_bands(0, 0, 0, 0)).values[0], 0.0f);
  EXPECT_EQ(spectral_angle(two_bands(0, 0, 1, 0)).values[0], 90.0f);
  Image grey(1, 1);
  grey.add_channel("Y", 1.0f);
  EXPECT_THROW(spectral_angle(difference_map(grey, grey)), std::invalid_argument);
}

TEST(PerceptualMaps, KeepOnePixelThatIsNoNumberToItself) {
  RgbPlanes a = noise(20 * 20, 5);
  const RgbPlanes b = a;
  a[1][45] = std::numeric_limits<float>::quiet_NaN();
  for (const MetricMap& map : perceptual_maps(20, 20, a, b, {})) {
    const MetricSummary s = metric_summary(map);
    EXPECT_EQ(s.not_finite, 1u) << map.name;
    EXPECT_TRUE(std::isnan(map.values[45])) << map.name;
    EXPECT_LT(s.max, 1e-3) << map.name;  // the pixel counts as equal for its neighbours
  }
}

TEST(SceneLinear, TakesTheObserverThatIsChosen) {
  Image flat(1, 1);
  for (double nm = 400; nm <= 700; nm += 10) flat.add_channel(spectral_channel_name(nm), 1.0f);
  const std::string folder = std::string(TRUEBOX_REFERENCE_DIR) + "/colour/";
  std::vector<std::vector<float>> seen;
  for (const char* file : {"cie1931_2deg_xyz.csv", "cie1964_10deg_xyz.csv", "cie2015_2deg_xyz.csv",
                           "cie2015_10deg_xyz.csv"}) {
    const Observer observer = read_observer(folder + file, file);
    const auto colours = scene_linear(flat, &observer);
    ASSERT_TRUE(colours);
    EXPECT_NE(colours->origin.find(file), std::string::npos);
    // The integral of each published y_bar is close to that of 1931, 106.857 nm (CIE 15).
    const LinearRgb rgb = {colours->rgb.channels[0].samples[0], colours->rgb.channels[1].samples[0],
                           colours->rgb.channels[2].samples[0]};
    const double Y = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    EXPECT_NEAR(Y, 106.857, 12.0) << file;
    for (const auto& other : seen) EXPECT_NE(other, colours->rgb.channels[0].samples) << file;
    seen.push_back(colours->rgb.channels[0].samples);
  }
  EXPECT_THROW(scene_linear(flat, nullptr), std::invalid_argument);
}

TEST(SceneLinear, DecodesWhatIsMadeForADisplay) {
  Image png(1, 1);
  for (const char* name : {"R", "G", "B"}) png.add_channel(name, 188.0f);
  png.attributes = {{"unit", "DN"}, {"transfer", "sRGB"}, {"white_dn", "255"}};
  EXPECT_NEAR(scene_linear(png, nullptr)->rgb.channels[0].samples[0], 0.5029, 1e-4);  // IEC 61966
  Image two(1, 1);
  two.add_channel("A", 1.0f);
  two.add_channel("B", 1.0f);
  EXPECT_FALSE(scene_linear(two, nullptr));
}

}  // namespace
}  // namespace truebox
