// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "commands.h"
#include "run_ledger.h"

namespace truebox::app {

/// What makes one command many jobs: more scenes, varied settings, and one's own share of them.
struct ArrayArguments {
  std::vector<std::string> more_scenes;
  std::vector<std::string> vary;  ///< "elements=500,1000"
  std::string index;              ///< of this part, from 0; "auto": what the scheduler says
  std::size_t parts = 0;          ///< 0: as the scheduler says, or 1
  bool restart = false;

  bool is_many() const { return !more_scenes.empty() || !vary.empty() || !index.empty(); }
};

/// Adds more SCENEs, --vary, --index, --parts and --restart to a command that has a SCENE.
void add_array_options(CLI::App& command, ArrayArguments& arguments);

/// --index and --parts alone, for a command with jobs of its own.
void add_share_options(CLI::App& command, std::string& index, std::size_t& parts);

/// The part of --index and --parts, with "auto" from SLURM_ARRAY_TASK_ID, _MIN and _COUNT, or
/// PBS_ARRAY_INDEX and --parts. InputError for a part that there is not.
JobShare share_of_jobs(const std::string& index, std::size_t parts);

/// The state file of a part in a folder: "run.json", or "part-2-of-8.json".
std::string state_file(const std::string& folder, const JobShare& share);

/// Runs the jobs of this part, each as a command line of its own, and prints the table if they are
/// all. `output` is a folder: each job leaves its file with `extension` there, and the state is
/// kept. A run that was stopped goes on. The worst exit code of the jobs.
int run_array(const CLI::App& command, const ArrayArguments& array, const std::string& first_scene,
              const std::string& output, const std::string& extension);

/// The table of a finished run: one row a job. Also as CSV where a file is named.
int present_array(const RunLedger& ledger, const std::string& csv);

void add_merge_command(CLI::App& program, Action& chosen);

/// Runs a command line ("solve", "scene.toml", ...) in this process; its exit code.
int run_command_line(std::vector<std::string> arguments);

}  // namespace truebox::app
