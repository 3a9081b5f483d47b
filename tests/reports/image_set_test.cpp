// SPDX-License-Identifier: BSD-3-Clause
#include "document/image_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "document/writers.h"
#include "image/half.h"
#include "image/spectral_image.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

/// A gradient with a little texture over seven decades, and samples that are no numbers.
Image spectral_image(int width, int height, float shift) {
  Image image(width, height);
  image.attributes["unit"] = "W m^-2 sr^-1 nm^-1";
  for (int b = 0; b < 3; ++b) {
    Channel& channel = image.add_channel(spectral_channel_name(450.0 + 100.0 * b));
    for (std::size_t i = 0; i < channel.samples.size(); ++i)
      channel.samples[i] =
          std::pow(10.0f, -5.0f + 0.07f * static_cast<float>(i % 101)) *
          (1.0f + shift * static_cast<float>((i * i * 7919u + i * 104729u) % 1009u) / 1009.0f);
  }
  return image;
}

TEST(Half, KeepsElevenBitsAndWhatIsNotFinite) {
  for (const float v : {1.0f, -0.1f, 65504.0f, 6.1e-5f, 3.14159f}) {
    EXPECT_NEAR(half_value(half_bits(v)), v, std::abs(v) / 2048.0f);  // half a unit of bit 11
  }
  EXPECT_EQ(half_bits(1.0f), 0x3c00);  // IEEE 754-2019, 3.4
  EXPECT_EQ(half_value(half_bits(kInf)), kInf);
  EXPECT_TRUE(std::isnan(half_value(half_bits(std::nanf("")))));
}

TEST(ImageSet, KeepsEverySampleToAHalf) {
  Image test = spectral_image(37, 23, 0.1f), reference = spectral_image(37, 23, 0.0f);
  test.channels[1].samples[5] = std::nanf("");
  test.channels[1].samples[6] = -kInf;
  const Image u = spectral_image(37, 23, 0.5f);
  const std::vector<int> surface(test.pixel_count(), 1);
  ImageSetOptions options;
  options.surface_of_pixel = surface;
  options.surfaces = {"a", "b"};
  const ImageSet set = make_image_set({"T", &test}, {"R", &reference, &u}, options);
  ASSERT_EQ(set.planes_per_band(), 3u);
  ASSERT_EQ(set.plane_count(), 10u);
  EXPECT_EQ(set.unit, "W m^-2 sr^-1 nm^-1");
  EXPECT_EQ(set.reference_uncertainty, UncertaintyKind::standard);
  const Image* planes[] = {&test, &reference, &u};
  for (std::size_t p = 0; p < 9; ++p) {
    const std::vector<float> read = unpack_plane(set, p);
    const std::vector<float>& truth = planes[p % 3]->channels[p / 3].samples;
    const float rounding = p % 3 == 2 ? 1.0f / 128.0f + 1.0f / 2048.0f : 1.0f / 2048.0f;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (std::isfinite(truth[i]))
        ASSERT_NEAR(read[i], truth[i], std::abs(truth[i]) * rounding) << p << " " << i;
      else
        ASSERT_EQ(std::isnan(read[i]) ? 0.0f : read[i], std::isnan(truth[i]) ? 0.0f : truth[i]);
    }
  }
  EXPECT_THAT(unpack_plane(set, 9), testing::Each(2.0f));
}

TEST(ImageSet, TakesEveryNthPixelWhereAllWouldBeTooMany) {
  const Image test = spectral_image(400, 300, 0.3f), reference = spectral_image(400, 300, 0.2f);
  ImageSetOptions options;
  options.most_bytes = 60'000;
  const ImageSet set = make_image_set({"T", &test}, {"R", &reference}, options);
  ASSERT_GT(set.stride, 1);
  EXPECT_LE(set.packed.size(), options.most_bytes);
  EXPECT_EQ(set.width_px, (400 + set.stride - 1) / set.stride);
  const float truth = reference.channels[2].samples[reference.index(4 * set.stride, set.stride)];
  EXPECT_NEAR(unpack_plane(set, 5)[static_cast<std::size_t>(set.width_px) + 4], truth,
              truth / 2048.0f);
}

TEST(ImageSet, APageOfNoiseStaysBelowTenMegabytes) {
  // The worst that 512 x 512 x 7 can be: both sides and both uncertainties noisy, nothing alike.
  std::mt19937 random(1);
  Image noise[4];
  for (Image& image : noise) {
    image = Image(512, 512);
    for (int b = 0; b < 7; ++b)
      for (float& v : image.add_channel(spectral_channel_name(400.0 + 50.0 * b)).samples)
        v = 1.0f + static_cast<float>(random() % 1024u) / 1024.0f;
  }
  Report report;
  report.sections = {
      {"Pictures",
       {PictureRow{
           {}, "", make_image_set({"T", &noise[0], &noise[1]}, {"R", &noise[2], &noise[3]})}}}};
  EXPECT_LT(to_html(report).size(), 10'000'000u);
}

TEST(ImageSet, PairsBandsAsTheComparisonDoes) {
  const Image test = spectral_image(4, 4, 0.0f);
  Image reference = test;
  reference.channels[0].name = "S0.450nm";  // other digits, the same wavelength
  EXPECT_EQ(make_image_set({"T", &test}, {"R", &reference}).bands[0].name, "S0.450nm");
  reference.channels[0].name = "S0.460nm";
  EXPECT_THROW(make_image_set({"T", &test}, {"R", &reference}), MismatchError);
  const Image other(5, 4);
  EXPECT_THROW(make_image_set({"T", &test, &other}, {"R", &test}), MismatchError);
  const std::vector<int> too_few(3, 0);
  ImageSetOptions options;
  options.surface_of_pixel = too_few;
  EXPECT_THROW(make_image_set({"T", &test}, {"R", &test}, options), MismatchError);
}

Report with_image_set() {
  const Image image = spectral_image(6, 4, 0.1f);
  Report report;
  report.title = "pictures";
  report.sections = {
      {"Pictures", {PictureRow{{}, "", make_image_set({"T", &image}, {"R", &image})}}}};
  return report;
}

TEST(ImageSet, ComesBackFromJsonToTheByte) {
  const Report report = with_image_set();
  const std::string json = to_json(report);
  const Report again = from_json(json, "r.json");
  EXPECT_EQ(to_json(again), json);
  EXPECT_EQ(to_html(again), to_html(report));
}

TEST(ImageSet, JsonThatLiesAboutItsSizeIsRefused) {
  const std::string json = to_json(with_image_set());
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string other = json;
    const std::size_t at = other.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    other.replace(at, from.size(), to);
    return other;
  };
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"\"width_px\": 6", "\"width_px\": 7"},
           {"\"width_px\": 6", "\"width_px\": 65536"},
           {"\"width_px\": 6", "\"width_px\": 2147483647"},
           {"\"width_px\": 6", "\"width_px\": -6"},
           {"\"stride\": 1", "\"stride\": 0"},
           {"\"exposure\": 1.0", "\"exposure\": -1.0"},
           {"\"test_uncertainty\": \"none\"", "\"test_uncertainty\": \"bound\""},
           {"\"test_uncertainty\": \"none\"", "\"test_uncertainty\": \"some\""},
           {"\"packed_base64\": \"eN", "\"packed_base64\": \"fN"}})
    EXPECT_THROW(from_json(replaced(from, to), "f"), InputError) << to;
}

}  // namespace
}  // namespace truebox
