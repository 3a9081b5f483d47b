// SPDX-License-Identifier: BSD-3-Clause
#include "readings/measurement_file.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

const std::string kFolder = std::string(TRUEBOX_REFERENCE_DIR) + "/llanos_narrowband/";

std::string shipped_text() {
  std::ifstream file(kFolder + "measurement.toml");
  return {std::istreambuf_iterator<char>(file), {}};
}

int line_of(const std::string& text, const std::string& needle) {
  return 1 + static_cast<int>(std::count(
                 text.begin(), text.begin() + static_cast<long>(text.find(needle)), '\n'));
}

/// A copy of the shipped file with one change, its paths made absolute.
std::string changed(std::string text, const std::string& from, const std::string& to,
                    const std::string& name) {
  if (!from.empty()) text.replace(text.find(from), from.size(), to);
  for (const std::string start : {"\"photographs/", "\"dark/", "\"labels/", "\"chart.toml",
                                  "\"chart_reflectance", "\"filter_transmission"})
    for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at + 1))
      text.insert(at + 1, kFolder);
  const std::string path = scratch_path("measurement_" + name + ".toml");
  std::ofstream(path) << text;
  return path;
}

TEST(MeasurementFile, ReadsTheShippedMeasurement) {
  const MeasurementFile file = read_measurement(kFolder + "measurement.toml");
  EXPECT_EQ(file.bands.size(), 7u);
  EXPECT_EQ(file.darks.size(), 7u);
  EXPECT_EQ(file.chart.patches.size(), 24u);
  EXPECT_EQ(file.known.patches.size(), 6u);
  EXPECT_FALSE(file.instrument.gain_dn.has_value());
  for (const auto& band : file.bands) EXPECT_EQ(band.photographs.size(), 7u) << band.name;
}

struct Mistake {
  std::string name, from, to, expected, found;
};

class MeasurementMistake : public testing::TestWithParam<Mistake> {};

TEST_P(MeasurementMistake, NamesFileLineExpectedAndFound) {
  const Mistake& mistake = GetParam();
  const std::string text = shipped_text();
  ASSERT_NE(text.find(mistake.from), std::string::npos);
  const std::string path = changed(text, mistake.from, mistake.to, mistake.name);
  try {
    read_measurement(path);
    FAIL() << mistake.name << " was accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), path);
    EXPECT_EQ(error.line(), line_of(text, mistake.from));
    EXPECT_THAT(error.what(), HasSubstr(mistake.expected));
    EXPECT_THAT(error.what(), HasSubstr(mistake.found));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Each, MeasurementMistake,
    testing::Values(
        Mistake{"unknown_key", "veil_threshold", "veil_treshold", "one of the keys",
                "veil_treshold"},
        Mistake{"wrong_type", "bits = 8 ", "bits = \"8\" ", "a number", "8"},
        Mistake{"out_of_range", "saturation_dn = 246", "saturation_dn = 300", "from 1 to 255",
                "300"},
        Mistake{"bayer", "bayer = \"gbrg\"", "bayer = \"gbrx\"", "gbrg", "gbrx"},
        Mistake{"gain_word", "gain = \"estimate\"", "gain = \"guess\"", "estimate", "guess"},
        Mistake{"standard", "standards = [\"white_9.5\"", "standards = [\"pink\"",
                "names of chart patches", "pink"},
        Mistake{"no_file", "\"filter_transmission.csv\", column = \"filter_400\"",
                "\"nowhere.csv\", column = \"filter_400\"", "an existing file", "nowhere.csv"}),
    [](const auto& mistake) { return mistake.param.name; });

TEST(MeasurementFile, NamesAMissingFile) {
  try {
    read_measurement(scratch_path("no_such_measurement.toml"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no such file"));
  }
}

std::string written(const std::string& name, const std::string& text) {
  const std::string path = scratch_path(name + ".toml");
  std::ofstream(path) << text;
  std::ofstream(scratch_path("frame.png")) << "no picture is opened";
  return path;
}

const std::string kPlain =
    "title = \"t\"\nsource = \"s\"\n[instrument]\nbits = 16\nbayer = \"none\"\n"
    "saturation_dn = 60000\n[[bands]]\nname = \"b\"\nphotographs = [{ file = \"frame.png\", "
    "exposure_s = 1 }]\n";

TEST(MeasurementFile, NeedsNoChart) {
  const MeasurementFile file = read_measurement(written("plain", kPlain));
  EXPECT_FALSE(file.has_chart());
  EXPECT_FALSE(file.instrument.mosaic);
  EXPECT_EQ(file.instrument.response, "fitted");
  EXPECT_EQ(file.glare.region.width, 0);
}

TEST(MeasurementFile, ReadsFlatGlareAndScale) {
  const MeasurementFile file = read_measurement(written(
      "full", kPlain + "[flat]\nfiles = [\"frame.png\"]\nexposure_s = 2\nmodel = \"cos4\"\n"
                       "uncertainty = 0.01\n[defects]\nmask = \"frame.png\"\n[glare]\nregion = "
                       "[1, 2, 3, 4]\n[[scale]]\nregion = [0, 0, 2, 2]\nvalue = 80\nuncertainty = "
                       "2\nunit = \"cd m^-2\"\n"));
  EXPECT_EQ(file.flat.model, "cos4");
  EXPECT_FALSE(file.defect_mask.empty());
  EXPECT_EQ(file.glare.region.height, 4);
  ASSERT_EQ(file.scales.size(), 1u);
  EXPECT_EQ(file.scales[0].value.standard_uncertainty, 2.0);
}

TEST(MeasurementFile, RefusesWhatCalibrationCannotMean) {
  const std::vector<std::pair<std::string, std::string>> mistakes = {
      {"[glare]\nregion = [1, 2, 3]\n", "left, top, width, height"},
      {"[flat]\nfiles = [\"frame.png\"]\nexposure_s = 1\nuncertainty = 0\nmodel = \"even\"\n",
       "polynomial"},
      {"[[scale]]\npatch = \"white\"\nvalue = 1\nuncertainty = 0\nunit = \"1\"\n", "chart patch"},
      {"[defects]\nmask = \"missing.png\"\n", "existing file"},
      {"[[bands]]\nname = \"b\"\nphotographs = [{ file = \"frame.png\", exposure_s = 1 }]\n",
       "different names"}};
  for (const auto& [text, expected] : mistakes) {
    try {
      read_measurement(written("mistake", kPlain + text));
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(expected));
      EXPECT_GT(error.line(), 0) << text;
    }
  }
  std::string mosaic = kPlain;
  mosaic.replace(mosaic.find("bits = 16"), 9, "response = \"debevec\"\nbits = 16");
  EXPECT_THROW(read_measurement(written("deep", mosaic)), InputError);
}

}  // namespace
}  // namespace truebox
