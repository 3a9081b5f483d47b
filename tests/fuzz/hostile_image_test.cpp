// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "document/writers.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

std::string seed(const char* name) {
  std::ifstream file(std::string(TRUEBOX_SOURCE_DIR) + "/tests/fuzz/corpus/image/" + name,
                     std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string written(const char* name, const std::string& bytes) {
  const std::string path = scratch_path(name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

long peak_memory_kib() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

std::string with_int(std::string bytes, std::size_t at, std::uint32_t value, bool big_endian) {
  if (bytes.size() < at + 4) throw std::out_of_range("no such place in the file");
  for (std::size_t k = 0; k < 4; ++k)
    bytes[at + k] = static_cast<char>(value >> (8 * (big_endian ? 3 - k : k)));
  return bytes;
}

/// A header that announces so many pixels is refused, and no memory was asked for: the few MiB are
/// what the libraries themselves take.
void expect_refused_at_once(const std::string& path) {
  const long before = peak_memory_kib();
  EXPECT_THROW(read_image(path), InputError) << path;
  EXPECT_LT(peak_memory_kib() - before, 64 * 1024) << path;
}

TEST(HostileImage, HeadersThatLieAreRefusedBeforeMemoryIsAskedFor) {
  const std::string exr = seed("zip_float.exr"), png = seed("rgb8.png"), tiff = seed("rgb8.tif");
  ASSERT_NO_THROW(read_image(written("good.exr", exr)));
  const std::size_t window =
      exr.find("dataWindow") + std::strlen("dataWindow") + 1 + std::strlen("box2i") + 1 + 4;
  for (const std::uint32_t most : {0x7fffffffu, 0x7ffffffeu, 65535u, 20000u}) {
    const auto lie = with_int(with_int(exr, window + 8, most, false), window + 12, most, false);
    expect_refused_at_once(written("lie.exr", lie));
    expect_refused_at_once(
        written("lie.png", with_int(with_int(png, 16, most, true), 20, most, true)));
  }
  // A TIFF's directory: 12 bytes an entry, of which tag (256: width, 257: height), type, value.
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(tiff.at(at)); };
  const std::size_t directory = byte(4) + 256u * byte(5);
  int lies = 0;
  for (int entry = 0; entry < byte(directory); ++entry) {
    const std::size_t at = directory + 2 + 12 * static_cast<std::size_t>(entry);
    if (byte(at + 1) != 1 || byte(at) > 1) continue;
    std::string lie = with_int(tiff, at + 8, 0x7fffffff, false);
    lie[at + 2] = 4;  // a 32-bit number
    expect_refused_at_once(written("lie.tif", lie));
    ++lies;
  }
  EXPECT_EQ(lies, 2);
  // Min beyond max: no pixels at all.
  expect_refused_at_once(written("none.exr", with_int(exr, window, 0x7fffffff, false)));
}

TEST(HostileImage, TruncatedFilesAreRefusedAtEveryLength) {
  for (const char* name : {"zip_float.exr", "rgb8.png", "rgb8_lzw.tif"}) {
    const std::string whole = seed(name);
    for (std::size_t length = 0; length + 12 < whole.size(); length += 7)
      EXPECT_THROW(read_image(written("cut", whole.substr(0, length))), InputError)
          << name << " " << length;
  }
}

/// A disk that takes no more than some bytes of a file.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);  // then the write fails, as on a full disk
    const rlimit less{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &less);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

TEST(FullDisk, LeavesTheWholeOldReport) {
  const auto folder = std::filesystem::path(scratch_path("full_disk_report"));
  const auto text_of = [&](const char* name) {
    std::ifstream file(folder / name);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  Report report;
  report.title = "old";
  // JSON takes two bytes for such a character: the numbers outgrow the page beside them.
  report.checks = {{std::string(60000, '\\'), Agreement::agrees, 1.0, 2.0, "1", ""}};
  write_report(folder, report);
  const std::size_t files =
      static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
  const std::string page = text_of("report.html"), numbers = text_of("report.json");
  report.title = "new";
  ASSERT_GT(numbers.size(), page.size() + 1000) << "the page, which comes first, must fit";
  {
    const FullDisk full(static_cast<rlim_t>(page.size() + 500));
    EXPECT_THROW(write_report(folder, report), std::runtime_error);
  }
  EXPECT_TRUE(text_of("report.html") == page) << "a new page beside old numbers";
  EXPECT_TRUE(text_of("report.json") == numbers);
  EXPECT_EQ(
      static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {})),
      files);
}

TEST(FullDisk, LeavesTheOldFileAndNoOther) {
  const auto folder = std::filesystem::path(scratch_path("full_disk"));
  write_file_atomically(folder / "report.html", "the old report");
  Image image(64, 64);
  for (float& v : image.add_channel("Y").samples)
    v = static_cast<float>(&v - &image.channels[0].samples[0]);
  write_exr(folder / "image.exr", Image(image));
  const auto size = std::filesystem::file_size(folder / "image.exr");
  {
    const FullDisk full(1000);
    EXPECT_THROW(write_file_atomically(folder / "report.html", std::string(5000, 'x')),
                 std::runtime_error);
    EXPECT_THROW(write_exr(folder / "image.exr", image), std::runtime_error);
  }
  std::ifstream file(folder / "report.html");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "the old report");
  EXPECT_EQ(std::filesystem::file_size(folder / "image.exr"), size);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 2);
}

}  // namespace
}  // namespace truebox
