// SPDX-License-Identifier: BSD-3-Clause
#include "provenance/provenance.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

std::string write_table(const std::string& name, const std::string& text) {
  const std::string path = scratch_path("provenance_" + name + ".csv");
  std::ofstream(path) << text;
  return path;
}

const std::string kHeader = "# source: a\n# unit: 1\n# uncertainty: 1 %\n";

TEST(Provenance, KeepsWhatTheHeaderSays) {
  const auto path = write_table("full", kHeader + "# licence: facts\nwavelength_nm,a\n400,1\n");
  const Provenance provenance = require_provenance(read_table(path), Use::input);
  EXPECT_EQ(provenance.source, "a");
  EXPECT_EQ(provenance.unit, "1");
  EXPECT_EQ(provenance.uncertainty, "1 %");
  EXPECT_EQ(provenance.licence, "facts");
  EXPECT_EQ(to_string(provenance.use), "input");
}

TEST(Provenance, RefusesATableThatLacksAnyOfTheThreeAndNamesIt) {
  for (const std::string key : {"source", "unit", "uncertainty"}) {
    std::string header = kHeader;
    header.replace(header.find(key), key.size(), "other");
    const auto path = write_table("no_" + key, header + "wavelength_nm,a\n400,1\n");
    try {
      require_provenance(read_table(path));
      FAIL() << key << " was not missed";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("# " + key));
      EXPECT_EQ(error.file(), path);
    }
  }
}

TEST(Provenance, EveryShippedTableIsSourced) {
  int tables = 0;
  for (const auto& folder : {"llanos_narrowband", "colour"})
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(TRUEBOX_REFERENCE_DIR) + "/" + folder)) {
      if (entry.path().extension() != ".csv") continue;
      EXPECT_NO_THROW(require_provenance(read_table(entry.path()))) << entry.path();
      ++tables;
    }
  EXPECT_GE(tables, 5);
}

}  // namespace
}  // namespace truebox
