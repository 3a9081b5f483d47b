// SPDX-License-Identifier: BSD-3-Clause
// The same solve on several ranks of MPI. Skipped where there is no mpirun or no PETSc.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "support/run_command.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

const std::string kScene = std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml";
const std::string kProgram = "'" TRUEBOX_PROGRAM "'";
// More ranks than cores, and as root in a container: both must be asked for.
const std::string kMpirun =
    "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
    "OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 timeout 120 mpirun -n ";

nlohmann::json json_of(const fs::path& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

class Distributed : public testing::Test {
 protected:
  void SetUp() override {
    if (run_command("command -v mpirun").code != 0) GTEST_SKIP() << "no mpirun";
    if (run_command(kProgram + " solve nothing.toml --distributed").text.find("built with PETSc") !=
        std::string::npos)
      GTEST_SKIP() << "built without PETSc";
  }
};

constexpr char kSettings[] = " --elements 300 --solver-bound 1e-11 ";

// Both solves are within 1e-11 of the same system's solution; its factors differ by the order in
// which closure is summed, 1e-12.
TEST_F(Distributed, AnyNumberOfRanksGivesTheSerialAnswer) {
  const fs::path serial_file = scratch_path("serial.json");
  const CommandOutcome serial =
      run_command(kProgram + " solve " + kScene + kSettings +
                  "--form-factors exact-visibility -o " + serial_file.string());
  ASSERT_EQ(serial.code, 0) << serial.text;
  const auto expected = json_of(serial_file);
  for (const int ranks : {1, 2, 4}) {
    const fs::path file = scratch_path("ranks_" + std::to_string(ranks) + ".json");
    const CommandOutcome outcome =
        run_command(kMpirun + std::to_string(ranks) + " " + kProgram + " solve " + kScene +
                    kSettings + "--distributed -o " + file.string());
    ASSERT_EQ(outcome.code, 0) << outcome.text;
    EXPECT_THAT(outcome.text, HasSubstr("  " + std::to_string(ranks) + " ranks: at most"));
    const auto found = json_of(file);
    ASSERT_EQ(found["surfaces"].size(), expected["surfaces"].size());
    for (std::size_t s = 0; s < found["surfaces"].size(); ++s)
      for (const char* quantity : {"radiosity", "radiosity_error_bound", "irradiance"})
        for (std::size_t b = 0; b < found["band_centres_nm"].size(); ++b) {
          const double value = found["surfaces"][s][quantity][b];
          const double wanted = expected["surfaces"][s][quantity][b];
          // A bound holds the solver's own, 1e-11 of the largest radiosity and 1e-7 of the bound,
          // which depends on where it stopped.
          const double relative = quantity == std::string("radiosity_error_bound") ? 1e-4 : 1e-8;
          EXPECT_NEAR(value, wanted, relative * std::abs(wanted) + 1e-12)
              << ranks << " ranks, " << found["surfaces"][s]["name"] << ", " << quantity;
        }
    // Not those hidden: the walk by rows meets some of them from behind, where nothing is counted.
    for (const char* count : {"pairs_unoccluded", "pairs_sampled"})
      EXPECT_EQ(found["form_factors"][count], expected["form_factors"][count]) << count;
  }
}

TEST_F(Distributed, OptionsOfPetscPassThrough) {
  const CommandOutcome outcome =
      run_command(kMpirun + "2 " + kProgram + " solve " + kScene +
                  " --elements 300 --distributed --petsc-options '-ksp_type gmres -ksp_view'");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_THAT(outcome.text, HasSubstr("type: gmres"));
  EXPECT_THAT(outcome.text, HasSubstr("type: shell"));
}

TEST_F(Distributed, AMistakeIsToldOnce) {
  const CommandOutcome outcome =
      run_command(kMpirun + "2 " + kProgram + " solve no_such_scene.toml --distributed");
  EXPECT_EQ(outcome.code, 4) << outcome.text;
  const auto first = outcome.text.find("truebox: no_such_scene.toml");
  ASSERT_NE(first, std::string::npos) << outcome.text;
  EXPECT_EQ(outcome.text.find("truebox: no_such_scene.toml", first + 1), std::string::npos);
}

// The second rank is given one second of processor time for work that takes many.
TEST_F(Distributed, ARankThatDiesEndsTheRunAndLeavesNoFile) {
  const fs::path file = scratch_path("dead.json");
  const std::string limited =
      "bash -c 'if [ \"$OMPI_COMM_WORLD_RANK\" = 1 ]; then ulimit -t 1; fi; exec \"$0\" \"$@\"' ";
  const CommandOutcome outcome =
      run_command(kMpirun + "2 " + limited + kProgram + " solve " + kScene +
                  " --elements 6000 --distributed -o " + file.string());
  EXPECT_NE(outcome.code, 0);
  EXPECT_NE(outcome.code, 124) << "it hung";  // of timeout
  EXPECT_THAT(outcome.text, HasSubstr("signal"));
  EXPECT_FALSE(fs::exists(file));
  for (const auto& entry : fs::directory_iterator(file.parent_path()))
    EXPECT_EQ(entry.path().filename().string().find("dead"), std::string::npos) << entry.path();
}

}  // namespace
}  // namespace truebox
