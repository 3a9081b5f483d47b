// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "image/image_file.h"
#include "support/scratch.h"

namespace truebox {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHostile = "<script>alert(1)<!--'\" onerror=\"x & ..";

/// From files to the page as a user makes it: names of files, channels, units and sources.
TEST(HostileNames, StayTextInThePageAndInsideTheFolder) {
  const fs::path folder = scratch_path("hostile_names");
  const fs::path file = folder / "<script>alert(1)<b>.exr", out = folder / "out";
  Image image(4, 3);
  image.add_channel(kHostile, 0.5f);
  image.attributes["unit"] = image.attributes["source"] = kHostile;
  write_exr(file, image);
  const std::string command = "TRUEBOX_REFERENCE='" TRUEBOX_REFERENCE_DIR "' '" TRUEBOX_PROGRAM
                              "' compare '" +
                              file.string() + "' '" + file.string() + "' --fail 0.1 -o '" +
                              out.string() + "' > /dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream page(out / "report.html");
  const std::string html{std::istreambuf_iterator<char>(page), {}};
  EXPECT_THAT(html, testing::HasSubstr("&lt;script&gt;alert(1)"));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("<script>alert")));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("<!--'")));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("\" onerror=\"")));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 2);  // the image and the folder
}

}  // namespace
}  // namespace truebox
