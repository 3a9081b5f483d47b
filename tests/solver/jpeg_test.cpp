// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "image/exif_orientation.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

const std::string kCorpus = std::string(TRUEBOX_SOURCE_DIR) + "/tests/fuzz/corpus/image/";

// The pictures were encoded from R = 12 x, G = 20 y, B = 128, 20 x 12 px.
class KnownJpeg : public testing::TestWithParam<const char*> {};

TEST_P(KnownJpeg, KeepsItsDigitalNumbers) {
  const Image image = read_image(kCorpus + GetParam());
  ASSERT_EQ(image.width, 20);
  ASSERT_EQ(image.height, 12);
  EXPECT_EQ(image.attributes.at("transfer"), "sRGB");
  // Luma is coarse by a quantiser step of a few DN, chroma by half resolution: 12 DN a column.
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 20; ++x) {
      const std::size_t i = image.index(x, y);
      EXPECT_NEAR(image.channels[0].samples[i], 12 * x, 16) << x << " " << y;
      if (image.channels.size() == 1) continue;
      EXPECT_NEAR(image.channels[1].samples[i], 20 * y, 16) << x << " " << y;
      EXPECT_NEAR(image.channels[2].samples[i], 128, 24) << x << " " << y;
    }
}

INSTANTIATE_TEST_SUITE_P(JpegFile, KnownJpeg,
                         testing::Values("rgb8.jpg", "progressive.jpg", "grey8.jpg"));

TEST(JpegFile, TurnsThePictureUprightAsItsExifSays) {
  const Image stored = read_image(kCorpus + "rgb8.jpg");
  const Image upright = read_image(kCorpus + "exif_turned.jpg");  // 6: turn clockwise to view
  ASSERT_EQ(upright.width, 12);
  ASSERT_EQ(upright.height, 20);
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 20; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        ASSERT_EQ(upright.channels[c].samples[upright.index(11 - y, x)],
                  stored.channels[c].samples[stored.index(x, y)]);
}

// Where the stored row 0 and column 0 are seen: the table of CIPA DC-008, 4.6.4.
TEST(JpegFile, OrientationsAreThoseOfTheStandard) {
  struct Seen {
    int row_y, column_x;  // -1: row 0 is seen as a column (or column 0 as a row)
    int row_x, column_y;
  };
  constexpr int w = 3, h = 2;
  const std::array<Seen, 8> expected = {{{0, 0, -1, -1},          // top, left
                                         {0, w - 1, -1, -1},      // top, right
                                         {h - 1, w - 1, -1, -1},  // bottom, right
                                         {h - 1, 0, -1, -1},      // bottom, left
                                         {-1, -1, 0, 0},          // left, top
                                         {-1, -1, h - 1, 0},      // right, top
                                         {-1, -1, h - 1, w - 1},  // right, bottom
                                         {-1, -1, 0, w - 1}}};    // left, bottom
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const Turn turn(orientation, w, h);
    const Seen& seen = expected[static_cast<std::size_t>(orientation - 1)];
    for (int x = 0; x < w; ++x) {
      if (seen.row_y >= 0) {
        EXPECT_EQ(turn.upright(x, 0).second, seen.row_y) << orientation;
      }
      if (seen.row_x >= 0) {
        EXPECT_EQ(turn.upright(x, 0).first, seen.row_x) << orientation;
      }
    }
    for (int y = 0; y < h; ++y) {
      if (seen.column_x >= 0) {
        EXPECT_EQ(turn.upright(0, y).first, seen.column_x) << orientation;
      }
      if (seen.column_y >= 0) {
        EXPECT_EQ(turn.upright(0, y).second, seen.column_y) << orientation;
      }
    }
  }
}

TEST(JpegFile, RefusesInksAndEveryTruncation) {
  EXPECT_THROW(read_image(kCorpus + "cmyk.jpg"), InputError);
  std::ifstream file(kCorpus + "rgb8.jpg", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const std::string path = scratch_path("short.jpg");
  for (std::size_t length = 4; length + 2 < bytes.size(); length += 7) {
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<long>(length));
    EXPECT_THROW(read_image(path), InputError) << length << " bytes";
  }
}

TEST(JpegFile, DamagedExifSaysNothing) {
  const std::vector<std::uint8_t> turned = {'E', 'x', 'i', 'f',  0, 0, 'M', 'M', 0, 42, 0, 0, 0, 8,
                                            0,   1,   1,   0x12, 0, 3, 0,   0,   0, 1,  0, 6, 0, 0};
  EXPECT_EQ(exif_orientation(turned), 6);
  for (std::size_t length = 0; length + 2 < turned.size(); ++length)
    EXPECT_EQ(exif_orientation({turned.data(), length}), 0) << length;
  auto wrong = turned;
  wrong[25] = 9;
  EXPECT_EQ(exif_orientation(wrong), 0);
}

}  // namespace
}  // namespace truebox
