// SPDX-License-Identifier: BSD-3-Clause
// The fuzz targets under a fixed number of fixed mutations, for compilers without libFuzzer. A
// crash leaves its input in /dev/shm (or the temporary folder), truebox_fuzz_<pid>.
#include "fuzz/mutation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "document/writers.h"
#include "fuzz/targets.h"
#include "image/spectral_image.h"

namespace truebox {
namespace {

namespace fs = std::filesystem;

Bytes read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// A small report with one of everything.
Bytes sample_report() {
  Image image(3, 2);
  image.add_channel(spectral_channel_name(550.0), 0.5f);
  const std::vector<float> values(6, 1.0f);
  Report report;
  report.title = "seed";
  report.verdict = {Agreement::warning, "1 of 2"};
  report.key_numbers = {{"largest", 1.5, "nm"}};
  report.checks = {{"c", Agreement::agrees, 1.0, 2.0}};
  report.provenance = {{"source", "none"}};
  const Table table{"t", {{"a"}, {"b", "1", 2, true}}, {{"x", Cell(1.0, 0.1)}}};
  const PictureRow row{{{"p", false_colour(3, 2, values, {0, 2}, "q", "1"), "alt"}},
                       "",
                       make_image_set({"T", &image}, {"R", &image, &image})};
  report.sections = {{"s", {Paragraph{"text"}, table, Figure{"f", "<svg ><g/></svg>", "c"}, row}}};
  const std::string json = to_json(report);
  return {json.begin(), json.end()};
}

std::vector<Bytes> seeds(const FuzzTarget& target) {
  const fs::path reference = TRUEBOX_REFERENCE_DIR;
  std::vector<fs::path> files;
  const fs::path corpus = fs::path(TRUEBOX_SOURCE_DIR) / "tests" / "fuzz" / "corpus" / target.name;
  if (fs::exists(corpus))
    for (const auto& entry : fs::directory_iterator(corpus)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());  // the order of a folder is the file system's whim
  const std::string name = target.name;
  if (name == "scene") files.push_back(reference / "cornell_box" / "cornell_box.toml");
  if (name == "measurement") files.push_back(reference / "llanos_narrowband" / "measurement.toml");
  if (name == "table") files.push_back(reference / "cornell_box" / "light_emission_4pt.csv");
  std::vector<Bytes> result;
  for (const auto& file : files) result.push_back(read_bytes(file));
  if (name == "report") result.push_back(sample_report());
  return result;
}

class Fuzz : public testing::TestWithParam<FuzzTarget> {};

TEST_P(Fuzz, ReaderRefusesOrReads) {
  constexpr int kMutations = 2000;
  const std::vector<Bytes> all = seeds(GetParam());
  ASSERT_FALSE(all.empty());
  for (std::size_t s = 0; s < all.size(); ++s)
    EXPECT_EQ(run_target(GetParam(), all[s]), "") << "seed " << s << " unchanged";
  std::mt19937_64 random(20240607);  // mt19937_64 is the same everywhere (C++ standard, rand.eng)
  for (int i = 0; i < kMutations; ++i) {
    const Bytes bytes = mutated(all[random() % all.size()], all[random() % all.size()], random);
    ASSERT_EQ(run_target(GetParam(), bytes), "") << "mutation " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Reader, Fuzz, testing::ValuesIn(fuzz_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace truebox
