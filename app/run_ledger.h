// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace truebox::app {

/// Many jobs over one or several parts (a job array of a cluster): part `index` of `parts` does
/// jobs index, index + parts, ...
struct JobShare {
  std::size_t index = 0, parts = 1;

  bool is_mine(std::size_t job) const { return job % parts == index; }
};

/// What must agree between two runs whose results are to be put together.
struct LedgerHeader {
  std::string command;                        ///< "sweep", "solve", "render"
  std::string version;                        ///< of the program
  std::map<std::string, std::string> inputs;  ///< name -> settings, or fingerprint of a scene
  std::vector<std::string> jobs;              ///< of all parts, in their order
  JobShare share;
};

/// Results of the jobs done so far, in one JSON file that is complete at any time: what an
/// interrupted run continues from, and what `truebox merge` puts together.
class RunLedger {
 public:
  /// Continues `path` if it is there. InputError where it is of another version, of other inputs or
  /// jobs, naming what differs. An empty path keeps everything in memory.
  RunLedger(std::filesystem::path path, LedgerHeader header);

  /// Reads a finished or unfinished file. InputError for anything that is not one.
  static RunLedger read(const std::filesystem::path& path);

  const LedgerHeader& header() const { return header_; }
  const std::filesystem::path& path() const { return path_; }
  bool has(std::size_t job) const { return results_.contains(job); }
  const nlohmann::json& result(std::size_t job) const { return results_.at(job); }
  /// Jobs of this part that are not done.
  std::vector<std::size_t> missing() const;

  /// Keeps a result, and the file.
  void add(std::size_t job, nlohmann::json result);
  /// Something that all jobs share, such as what they are held to; kept with the file.
  const nlohmann::json& shared() const { return shared_; }
  void set_shared(nlohmann::json shared);

 private:
  RunLedger() = default;
  void write() const;

  std::filesystem::path path_;
  LedgerHeader header_;
  nlohmann::json shared_;
  std::map<std::size_t, nlohmann::json> results_;
};

/// All parts of one run as one. InputError where a part is missing, is there twice, is of another
/// version, command, inputs or jobs, or has not done its jobs; the message names the file and what
/// differs.
RunLedger merged(const std::vector<std::filesystem::path>& paths);

/// 16 hexadecimal digits of everything in the scene that an answer depends on: geometry, materials
/// in their bands, cameras. Comments and formatting of its file do not count.
std::string fingerprint(const Scene& scene);
std::string fingerprint(const std::string& text);

}  // namespace truebox::app
