// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <fstream>

#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "support/dng.h"
#include "support/scratch.h"

namespace truebox {
namespace {

constexpr int kWidth = 32, kHeight = 24;

std::vector<std::uint16_t> ramp() {
  std::vector<std::uint16_t> samples;
  for (int i = 0; i < kWidth * kHeight; ++i) samples.push_back(static_cast<std::uint16_t>(17 * i));
  return samples;
}

std::string written(const std::string& name, const std::vector<std::uint8_t>& bytes) {
  const std::string path = scratch_path(name);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<long>(bytes.size()));
  return path;
}

class RawMosaic : public testing::TestWithParam<const char*> {};

// Every photosite must come back as it was written: nothing demosaiced, scaled or subtracted.
TEST_P(RawMosaic, KeepsEveryPhotosite) {
  const auto samples = ramp();
  const auto bytes = dng_bytes(kWidth, kHeight, samples, GetParam(), 64, 16000);
  for (const std::string name : {"raw.dng", "raw_by_content.tif"}) {
    const Image image = read_image(written(name, bytes));
    ASSERT_EQ(image.width, kWidth);
    ASSERT_EQ(image.height, kHeight);
    ASSERT_EQ(image.channels.size(), 1u);
    for (std::size_t i = 0; i < samples.size(); ++i)
      ASSERT_EQ(image.channels[0].samples[i], static_cast<float>(samples[i])) << i;
    EXPECT_EQ(image.attributes.at("bayer"), GetParam());
    EXPECT_EQ(image.attributes.at("black_level_dn"), "64");
    EXPECT_EQ(image.attributes.at("white_level_dn"), "16000");
  }
}

INSTANTIATE_TEST_SUITE_P(Patterns, RawMosaic, testing::Values("rggb", "bggr", "grbg", "gbrg"));

TEST(RawFile, RefusesWhatIsCutShort) {
  const auto bytes = dng_bytes(kWidth, kHeight, ramp(), "rggb", 0, 65535);
  for (const std::size_t keep :
       {std::size_t{0}, std::size_t{7}, std::size_t{100}, bytes.size() / 2}) {
    auto cut = bytes;
    cut.resize(keep);
    EXPECT_THROW(read_image(written("cut.dng", cut)), InputError) << keep;
  }
}

TEST(RawFile, RefusesStripsBeyondTheFile) {
  auto bytes = dng_bytes(kWidth, kHeight, ramp(), "rggb", 0, 65535);
  // Tag 273 (StripOffsets), a long: its value stands 8 bytes behind the tag.
  for (std::size_t i = 8; i + 12 < bytes.size(); ++i)
    if (bytes[i] == 0x11 && bytes[i + 1] == 0x01 && bytes[i + 2] == 4 && bytes[i + 4] == 1)
      bytes[i + 9] = 0x7f;
  EXPECT_THROW(read_image(written("beyond.dng", bytes)), InputError);
}

TEST(RawFile, RefusesOtherFilesOfThatEnding) {
  EXPECT_THROW(read_image(written("text.dng", std::vector<std::uint8_t>(400, 'x'))), InputError);
  EXPECT_THROW(read_image(written("text.nef", std::vector<std::uint8_t>(400, 0))), InputError);
}

// Fixed mutations: each gives an image or an InputError, never a crash.
TEST(RawFile, SurvivesMutations) {
  const auto bytes = dng_bytes(kWidth, kHeight, ramp(), "rggb", 64, 16000);
  const std::size_t directory = 8 + 2 * kWidth * kHeight;
  std::size_t refused = 0;
  std::uint32_t state = 12345;
  for (int k = 0; k < 400; ++k) {
    auto changed = bytes;
    for (int n = 0; n < 1 + k % 3; ++n) {
      state = state * 1664525u + 1013904223u;
      const std::size_t at = directory + (state >> 8) % (bytes.size() - directory);
      state = state * 1664525u + 1013904223u;
      changed[at] = static_cast<std::uint8_t>(state >> 24);
    }
    try {
      const Image image = read_image(written("mutated.dng", changed));
      EXPECT_EQ(image.channels.at(0).samples.size(), image.pixel_count());
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 20u);  // the mutations do hit what matters
}

}  // namespace
}  // namespace truebox
