// SPDX-License-Identifier: BSD-3-Clause
#include "readings/chart.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "image/bayer.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "readings/photograph.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

const std::string kFolder = std::string(TRUEBOX_REFERENCE_DIR) + "/llanos_narrowband/";
const std::string kLabels = kFolder + "labels/d2_colorChecker30cm_550nm_labels.png";

std::string temporary(const std::string& name) { return scratch_path("chart_" + name); }

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(BayerPattern, NamesThePhotositesRowByRow) {
  const BayerPattern bayer("gbrg");
  EXPECT_EQ(bayer.site(0, 0), 'G');
  EXPECT_EQ(bayer.site(1, 0), 'B');
  EXPECT_EQ(bayer.site(0, 1), 'R');
  EXPECT_EQ(bayer.site(1, 1), 'G');
  EXPECT_EQ(bayer.site(406, 341), 'R');
  EXPECT_THROW(BayerPattern("ggrb2"), std::invalid_argument);
  EXPECT_THROW(BayerPattern("gggb"), std::invalid_argument);
}

TEST(Chart, ErosionRemovesTheRimOfEveryPatch) {
  Chart chart;
  chart.patches = {"a", "b"};
  chart.width = 12;
  chart.height = 9;
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 12; ++x) chart.labels.push_back(x < 6 ? std::uint8_t{1} : std::uint8_t{2});
  const auto eroded = eroded_labels(chart, 2);
  EXPECT_EQ(std::count(eroded.begin(), eroded.end(), 1), 2 * 5);
  EXPECT_EQ(std::count(eroded.begin(), eroded.end(), 2), 2 * 5);
  EXPECT_EQ(eroded_labels(chart, 0), chart.labels);
}

TEST(Chart, RefusesAnUnsourcedTable) {
  const auto path = temporary("unsourced.csv");
  write(path, "# unit: 1\n# uncertainty: none\nwavelength_nm,dark_skin\n400,0.1\n");
  try {
    read_chart(kLabels, path, {"dark_skin"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("# source"));
  }
}

TEST(Chart, NamesTheLineOfAnUnsortedWavelength) {
  const auto path = temporary("unsorted.csv");
  write(path,
        "# source: a\n# unit: 1\n# uncertainty: b\nwavelength_nm,dark_skin\n400,0.1\n399,0.1\n");
  try {
    read_chart(kLabels, path, {"dark_skin"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.line(), 6);
    EXPECT_THAT(error.what(), HasSubstr("unsorted.csv:6"));
  }
}

TEST(Chart, RefusesLabelsBeyondThePatchesNamed) {
  try {
    read_chart(kLabels, kFolder + "chart_reflectance.csv", {"dark_skin", "light_skin"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("labels from 0 to 2"));
  }
}

TEST(Frame, RefusesATruncatedTiffPngAndExr) {
  const auto tiff = temporary("whole.tif"), png = temporary("whole.png"),
             exr = temporary("whole.exr");
  const auto tiffs = kFolder + "photographs/";
  const auto first = std::filesystem::directory_iterator(tiffs)->path();
  std::filesystem::copy_file(first, tiff, std::filesystem::copy_options::overwrite_existing);
  std::filesystem::copy_file(kLabels, png, std::filesystem::copy_options::overwrite_existing);
  Image image(32, 32);
  image.add_channel("Y");
  for (std::size_t i = 0; i < image.pixel_count(); ++i)
    image.channels[0].samples[i] = static_cast<float>(i * 2654435761u % 1000);
  write_exr(exr, image);
  for (const auto& path : {tiff, png, exr}) {
    ASSERT_NO_THROW(read_frame(path, 1.0)) << path;
    const std::string bytes = bytes_of(path);
    write(path, bytes.substr(0, bytes.size() * 6 / 10));
    EXPECT_THROW(read_frame(path, 1.0), InputError) << path;
  }
}

}  // namespace
}  // namespace truebox
