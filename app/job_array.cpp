// SPDX-License-Identifier: BSD-3-Clause
#include "job_array.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <set>

#include "image/image_file.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "radiometry/processor_time.h"
#include "scene/scene_file.h"
#include "text_file.h"
#include "version.h"

namespace truebox::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Variation {
  std::string option;
  std::vector<std::string> values;
};

struct Job {
  std::string name;
  std::string scene;
  std::vector<std::string> settings;  // "--elements", "500", ...
};

std::optional<std::size_t> number_in(const std::string& text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

std::optional<std::size_t> environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? number_in(value) : std::nullopt;
}

Variation variation_of(const CLI::App& command, const std::string& text) {
  const std::size_t equal = text.find('=');
  Variation variation{text.substr(0, equal), {}};
  if (equal == std::string::npos || equal == 0 || equal + 1 == text.size())
    throw InputError("--vary", 0, "OPTION=VALUE,VALUE,...", text);
  const CLI::Option* option = command.get_option_no_throw("--" + variation.option);
  if (!option || option->get_expected_min() == 0 || variation.option == "output")
    throw InputError("--vary", 0, "an option of this command that takes a value", variation.option);
  if (option->count() > 0)
    throw InputError("--vary", 0, "an option that is not given as well", "--" + variation.option);
  std::string value;
  for (const char c : text.substr(equal + 1) + ",") {
    if (c != ',') {
      value += c;
    } else if (value.empty()) {
      throw InputError("--vary", 0, "values between commas", text);
    } else {
      variation.values.push_back(std::exchange(value, {}));
    }
  }
  return variation;
}

// Names of scenes without folders where those already differ.
std::vector<std::string> names_of(const std::vector<std::string>& scenes) {
  std::vector<std::string> names;
  for (const std::string& scene : scenes) names.push_back(fs::path(scene).stem().string());
  if (std::set<std::string>(names.begin(), names.end()).size() == names.size()) return names;
  names.clear();
  for (std::size_t k = 0; k < scenes.size(); ++k)
    names.push_back(fmt::format("{}_{}", k, fs::path(scenes[k]).stem().string()));
  return names;
}

std::vector<Job> jobs_of(const std::vector<std::string>& scenes,
                         const std::vector<Variation>& variations) {
  std::vector<Job> jobs;
  const auto names = names_of(scenes);
  for (std::size_t k = 0; k < scenes.size(); ++k) jobs.push_back({names[k], scenes[k], {}});
  for (const Variation& variation : variations) {
    std::vector<Job> more;
    for (const Job& job : jobs)
      for (const std::string& value : variation.values) {
        Job& next = more.emplace_back(job);
        std::string label = value;
        std::replace(label.begin(), label.end(), '/', '_');
        next.name += fmt::format("_{}-{}", variation.option, label);
        next.settings.insert(next.settings.end(), {"--" + variation.option, value});
      }
    jobs = std::move(more);
  }
  return jobs;
}

// What was typed beside the scenes, the output and the array's own options.
std::vector<std::string> common_arguments(const CLI::App& command) {
  static const std::set<std::string> kOwn = {"vary",   "index", "parts", "restart",
                                             "output", "help",  "quiet"};
  std::vector<std::string> arguments;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty()) continue;
    const std::string name = option->get_lnames().front();
    if (kOwn.contains(name)) continue;
    if (option->get_expected_min() == 0) {
      arguments.push_back(fmt::format("--{}={}", name, option->results().front()));
    } else {
      arguments.push_back("--" + name);
      for (const std::string& value : option->results()) arguments.push_back(value);
    }
  }
  return arguments;
}

// The numbers of a job for the table: those of a solve's file, or what is known of any.
json outcome_of(const Job& job, const std::string& file, int code, double processor_s) {
  json result = {{"job", job.name},
                 {"scene", job.scene},
                 {"settings", job.settings},
                 {"exit_code", code},
                 {"processor_s", processor_s},
                 {"file", fs::path(file).filename().string()}};
  if (!fs::exists(file)) return result;
  result["file_fingerprint"] = fingerprint(read_text(file));
  if (fs::path(file).extension() != ".json") return result;
  const json solution = json::parse(read_text(file));
  for (const char* key :
       {"elements", "bands", "bands_solved", "largest_relative_bound_of_a_surface"})
    if (solution.contains(key)) result["numbers"][key] = solution[key];
  double area = 0.0, irradiance = 0.0;
  for (const json& surface : solution.at("surfaces"))
    for (const json& value : surface.at("irradiance")) {
      irradiance += surface.at("area").get<double>() * value.get<double>();
      area += surface.at("area").get<double>();
    }
  if (area > 0.0) result["numbers"]["mean_irradiance"] = irradiance / area;
  return result;
}

LedgerHeader header_of(const CLI::App& command, const std::vector<Job>& jobs,
                       const std::vector<std::string>& common, const JobShare& share) {
  LedgerHeader header;
  header.command = command.get_name();
  header.version = kVersion;
  header.share = share;
  std::string settings;
  for (const std::string& argument : common) settings += (settings.empty() ? "" : " ") + argument;
  header.inputs["settings"] = settings;
  for (const Job& job : jobs) {
    header.jobs.push_back(job.name);
    if (!header.inputs.contains("scene " + job.scene))
      header.inputs["scene " + job.scene] = fingerprint(read_scene(job.scene));
  }
  return header;
}

int worst_code(const RunLedger& ledger) {
  int worst = kAgrees;
  for (std::size_t job = 0; job < ledger.header().jobs.size(); ++job)
    if (ledger.has(job)) worst = std::max(worst, ledger.result(job).at("exit_code").get<int>());
  return worst;
}

}  // namespace

void add_share_options(CLI::App& command, std::string& index, std::size_t& parts) {
  command.add_option("--index", index,
                     "do only this part of the work, from 0; \"auto\": as SLURM or PBS say");
  command.add_option("--parts", parts, "of so many parts (with --index)")
      ->check(CLI::Range(1, 1000000));
}

void add_array_options(CLI::App& command, ArrayArguments& a) {
  command.add_option("SCENES", a.more_scenes, "more scene files: one job each, -o a folder");
  command
      .add_option("--vary", a.vary,
                  "OPTION=VALUE,VALUE,...: a job for each value of an option, of each scene")
      ->take_all();
  add_share_options(command, a.index, a.parts);
  command.add_flag("--restart", a.restart, "do not continue an earlier run in that folder");
}

JobShare share_of_jobs(const std::string& index, std::size_t parts) {
  JobShare share{0, std::max<std::size_t>(1, parts)};
  if (index.empty()) {
    if (parts > 1) throw InputError("--parts", 0, "--index, which part this is", "none");
    return share;
  }
  if (index == "auto") {
    const auto slurm = environment("SLURM_ARRAY_TASK_ID"), pbs = environment("PBS_ARRAY_INDEX");
    if (!slurm && !pbs)
      throw InputError("--index auto", 0, "SLURM_ARRAY_TASK_ID or PBS_ARRAY_INDEX set", "neither");
    const std::size_t first = slurm ? environment("SLURM_ARRAY_TASK_MIN").value_or(0) : 0;
    share.index = (slurm ? *slurm : *pbs) - first;
    if (parts == 0) share.parts = environment("SLURM_ARRAY_TASK_COUNT").value_or(0);
    if (share.parts == 0)
      throw InputError("--index auto", 0, "--parts, how many there are", "none");
  } else {
    const auto value = number_in(index);
    if (!value) throw InputError("--index", 0, "a whole number from 0, or auto", index);
    if (parts == 0) throw InputError("--index", 0, "--parts, how many parts there are", "none");
    share.index = *value;
  }
  if (share.index >= share.parts)
    throw InputError("--index", 0, fmt::format("a part from 0 to {}", share.parts - 1),
                     std::to_string(share.index));
  return share;
}

std::string state_file(const std::string& folder, const JobShare& share) {
  const std::string name =
      share.parts == 1 ? "run.json" : fmt::format("part-{}-of-{}.json", share.index, share.parts);
  return (fs::path(folder) / name).string();
}

int run_array(const CLI::App& command, const ArrayArguments& array, const std::string& first_scene,
              const std::string& output, const std::string& extension) {
  if (output.empty()) throw InputError("-o", 0, "a folder for the results of all jobs", "none");
  static const std::set<std::string> kFiles = {".json", ".vtu", ".glb", ".html",
                                               ".exr",  ".tif", ".png"};
  if ((fs::exists(output) && !fs::is_directory(output)) ||
      kFiles.contains(fs::path(output).extension().string()))
    throw InputError(output, 0, "a folder for the results of all jobs", "a file");
  const JobShare share = share_of_jobs(array.index, array.parts);
  std::vector<std::string> scenes = {first_scene};
  scenes.insert(scenes.end(), array.more_scenes.begin(), array.more_scenes.end());
  std::vector<Variation> variations;
  for (const std::string& text : array.vary) variations.push_back(variation_of(command, text));
  const std::vector<Job> jobs = jobs_of(scenes, variations);
  const std::vector<std::string> common = common_arguments(command);
  const std::string state = state_file(output, share);
  if (array.restart) fs::remove(state);
  RunLedger ledger(state, header_of(command, jobs, common, share));
  fs::create_directories(output);
  const std::vector<std::size_t> to_do = ledger.missing();
  for (std::size_t k = 0; k < to_do.size(); ++k) {
    const Job& job = jobs[to_do[k]];
    fmt::print("[{} of {}] {}\n", k + 1, to_do.size(), job.name);
    std::fflush(stdout);
    const std::string file = (fs::path(output) / (job.name + extension)).string();
    std::vector<std::string> line = {command.get_name(), job.scene};
    line.insert(line.end(), common.begin(), common.end());
    line.insert(line.end(), job.settings.begin(), job.settings.end());
    line.insert(line.end(), {"-o", file});
    const double start = process_cpu_s();
    const int code = run_command_line(std::move(line));
    ledger.add(to_do[k], outcome_of(job, file, code, process_cpu_s() - start));
  }
  if (share.parts > 1) {
    fmt::print("part {} of {} is done: {}\n", share.index, share.parts, state);
    return worst_code(ledger);
  }
  return present_array(ledger, {});
}

int present_array(const RunLedger& ledger, const std::string& csv) {
  std::vector<std::string> columns;
  for (std::size_t job = 0; job < ledger.header().jobs.size(); ++job)
    if (ledger.result(job).contains("numbers"))
      for (const auto& [key, value] : ledger.result(job)["numbers"].items())
        if (std::find(columns.begin(), columns.end(), key) == columns.end()) columns.push_back(key);
  std::string text = "job,exit_code,processor_s,file";
  for (const std::string& column : columns) text += "," + column;
  text += "\n";
  for (std::size_t job = 0; job < ledger.header().jobs.size(); ++job) {
    const json& r = ledger.result(job);
    text +=
        fmt::format("{},{},{:.3f},{}", r.at("job").get<std::string>(), r.at("exit_code").get<int>(),
                    r.at("processor_s").get<double>(), r.at("file").get<std::string>());
    for (const std::string& column : columns)
      text += r.contains("numbers") && r["numbers"].contains(column)
                  ? fmt::format(",{:.10g}", r["numbers"][column].get<double>())
                  : ",";
    text += "\n";
  }
  fmt::print("{}", text);
  if (!csv.empty()) write_file_atomically(csv, text);
  return worst_code(ledger);
}

}  // namespace truebox::app
