// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "job_array.h"
#include "radiometry/input_error.h"
#include "run_ledger.h"
#include "sweep.h"
#include "text_file.h"
#include "version.h"

namespace truebox::app {
namespace {

namespace fs = std::filesystem;

struct MergeArguments {
  std::vector<std::string> parts;
  std::string csv;
  SweepArguments sweep;  // what to leave behind of one
};

// The files that the jobs left, unchanged since: a table of what is gone helps nobody.
void require_files(const RunLedger& all, const std::vector<fs::path>& parts) {
  for (std::size_t job = 0; job < all.header().jobs.size(); ++job) {
    const nlohmann::json& result = all.result(job);
    if (!result.contains("file_fingerprint")) continue;
    const std::string name = result.at("file").get<std::string>();
    bool found = false;
    for (const fs::path& part : parts) {
      const fs::path file = part.parent_path() / name;
      if (!fs::exists(file)) continue;
      found = true;
      if (fingerprint(read_text(file.string())) == result.at("file_fingerprint")) continue;
      throw InputError(file.string(), 0, "the file that its job wrote", "another one");
    }
    if (!found)
      throw InputError(
          name, 0, "the file of job \"" + all.header().jobs[job] + "\" beside its part", "none");
  }
}

int merge(const MergeArguments& a) {
  const std::vector<fs::path> paths(a.parts.begin(), a.parts.end());
  const RunLedger all = merged(paths);
  if (all.header().version != kVersion)
    throw InputError(a.parts.front(), 0, std::string("results of this version, ") + kVersion,
                     all.header().version);
  if (all.header().command.starts_with("sweep")) {
    if (!a.csv.empty()) throw InputError("--csv", 0, "parts of solve or render", "of a sweep");
    std::vector<std::pair<std::string, std::string>> provenance = {
        {"Program", "truebox " + all.header().version}, {"Parts", std::to_string(a.parts.size())}};
    for (const auto& [name, value] : all.header().inputs) provenance.emplace_back(name, value);
    return present(sweep_of(all), a.sweep, provenance);
  }
  require_files(all, paths);
  return present_array(all, a.csv);
}

}  // namespace

void add_merge_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "merge", "puts the parts of a job array together, as if it had been one run");
  auto a = std::make_shared<MergeArguments>();
  command->add_option("PARTS", a->parts, "part-K-of-N.json of every part")->required();
  command->add_option("--csv", a->csv, "of solve and render: the table as CSV");
  command->add_option("-o,--output", a->sweep.output, "of a sweep: folder for the report");
  command->add_option("--json", a->sweep.json, "of a sweep: every number as JSON");
  command->add_option("--plot", a->sweep.plot, "of a sweep: error against time as SVG");
  command->footer(
      "Refuses parts that are missing, unfinished, there twice, or of another version of the "
      "program,\nof other scenes or settings.\n"
      "Example: for k in 0 1 2; do truebox solve a.toml b.toml --vary elements=500,1000 "
      "--index $k --parts 3 -o runs; done\n         truebox merge runs/part-*-of-3.json --csv "
      "table.csv");
  command->callback([=, &chosen] { chosen = [=] { return merge(*a); }; });
}

}  // namespace truebox::app
