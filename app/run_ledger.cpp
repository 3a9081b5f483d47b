// SPDX-License-Identifier: BSD-3-Clause
#include "run_ledger.h"

#include <fmt/format.h>

#include <bit>
#include <set>

#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "text_file.h"

namespace truebox::app {
namespace {

using nlohmann::json;

constexpr char kFormat[] = "truebox-run-1";

// FNV-1a over bytes (Fowler, Noll, Vo): no protection against a forger, and none is needed.
class Hash {
 public:
  void add(const std::string& text) {
    for (const char c : text) add_byte(static_cast<unsigned char>(c));
    add_byte(0);
  }
  void add(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int k = 0; k < 8; ++k) add_byte(static_cast<unsigned char>(bits >> (8 * k)));
  }
  void add(const std::vector<double>& values) {
    add(static_cast<double>(values.size()));
    for (const double v : values) add(v);
  }
  void add(const Vec3& v) {
    for (int k = 0; k < 3; ++k) add(v[k]);
  }
  std::string text() const { return fmt::format("{:016x}", state_); }

 private:
  void add_byte(unsigned char byte) { state_ = (state_ ^ byte) * 0x100000001b3ULL; }
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

json to_json(const LedgerHeader& h) {
  return {{"command", h.command}, {"version", h.version},   {"inputs", h.inputs},
          {"jobs", h.jobs},       {"index", h.share.index}, {"parts", h.share.parts}};
}

LedgerHeader header_of(const json& j) {
  LedgerHeader h;
  j.at("command").get_to(h.command);
  j.at("version").get_to(h.version);
  j.at("inputs").get_to(h.inputs);
  j.at("jobs").get_to(h.jobs);
  j.at("index").get_to(h.share.index);
  j.at("parts").get_to(h.share.parts);
  return h;
}

[[noreturn]] void differs(const std::filesystem::path& path, const std::string& what,
                          const std::string& expected, const std::string& found) {
  throw InputError(path.string(), 0, what + " " + expected, found);
}

// Everything but the part itself.
void require_same_run(const std::filesystem::path& path, const LedgerHeader& expected,
                      const LedgerHeader& found) {
  if (found.command != expected.command)
    differs(path, "results of the command", expected.command, found.command);
  if (found.version != expected.version)
    differs(path, "results of version", expected.version, found.version);
  for (const auto& [name, value] : expected.inputs) {
    const auto other = found.inputs.find(name);
    const std::string there = other == found.inputs.end() ? "(none)" : other->second;
    if (there != value)
      differs(path, name, value, there + "; it has changed since, --restart begins anew");
  }
  if (found.inputs.size() != expected.inputs.size())
    differs(path, "as many inputs as", std::to_string(expected.inputs.size()),
            std::to_string(found.inputs.size()));
  if (found.jobs != expected.jobs)
    differs(path, "the same list of", std::to_string(expected.jobs.size()) + " jobs",
            std::to_string(found.jobs.size()) + " jobs, or others");
  if (found.share.parts != expected.share.parts)
    differs(path, "one of so many parts:", std::to_string(expected.share.parts),
            std::to_string(found.share.parts));
}

}  // namespace

RunLedger::RunLedger(std::filesystem::path path, LedgerHeader header)
    : path_(std::move(path)), header_(std::move(header)) {
  if (path_.empty() || !std::filesystem::exists(path_)) return;
  const RunLedger old = read(path_);
  require_same_run(path_, header_, old.header_);
  if (old.header_.share.index != header_.share.index)
    differs(path_, "part", std::to_string(header_.share.index),
            std::to_string(old.header_.share.index));
  results_ = old.results_;
  shared_ = old.shared_;
}

RunLedger RunLedger::read(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path))
    throw InputError(path.string(), 0, "the state of a run", "no such file");
  RunLedger ledger;
  ledger.path_ = path;
  try {
    const json j = json::parse(read_text(path.string()));
    if (j.at("format") != kFormat) throw std::invalid_argument("another format");
    ledger.header_ = header_of(j.at("run"));
    const JobShare& share = ledger.header_.share;
    if (share.parts < 1 || share.index >= share.parts)
      throw std::invalid_argument("a part that there is not");
    ledger.shared_ = j.at("shared");
    for (const auto& [key, value] : j.at("results").items()) {
      const std::size_t job = std::stoul(key);
      if (job >= ledger.header_.jobs.size() || !share.is_mine(job))
        throw std::invalid_argument("a result of a job that is not this part's");
      ledger.results_[job] = value;
    }
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(path.string(), 0, "the state of a run, as this program writes it",
                     error.what());
  }
  return ledger;
}

std::vector<std::size_t> RunLedger::missing() const {
  std::vector<std::size_t> jobs;
  for (std::size_t job = 0; job < header_.jobs.size(); ++job)
    if (header_.share.is_mine(job) && !has(job)) jobs.push_back(job);
  return jobs;
}

void RunLedger::add(std::size_t job, json result) {
  results_[job] = std::move(result);
  write();
}

void RunLedger::set_shared(json shared) {
  shared_ = std::move(shared);
  write();
}

void RunLedger::write() const {
  if (path_.empty()) return;
  json results = json::object();
  for (const auto& [job, result] : results_) results[std::to_string(job)] = result;
  const json all = {
      {"format", kFormat}, {"run", to_json(header_)}, {"shared", shared_}, {"results", results}};
  write_file_atomically(path_, all.dump(1) + "\n");
}

RunLedger merged(const std::vector<std::filesystem::path>& paths) {
  if (paths.empty()) throw InputError("merge", 0, "files of parts", "none");
  const RunLedger first = RunLedger::read(paths.front());
  LedgerHeader whole = first.header();
  whole.share = {};
  RunLedger all({}, whole);
  std::map<std::size_t, std::string> seen;
  for (const auto& path : paths) {
    const RunLedger part = RunLedger::read(path);
    require_same_run(path, first.header(), part.header());
    const std::size_t index = part.header().share.index;
    if (const auto [where, is_new] = seen.emplace(index, path.string()); !is_new)
      differs(path, "each part once; part", std::to_string(index), "also in " + where->second);
    if (const auto missing = part.missing(); !missing.empty())
      differs(path, "all jobs done,", "also \"" + part.header().jobs[missing.front()] + "\"",
              fmt::format("{} of them missing: run this part again, it continues", missing.size()));
    if (all.shared().is_null()) all.set_shared(part.shared());  // a part may have had no job
    if (!part.shared().is_null() && part.shared() != all.shared())
      differs(path, "what all parts are held to:", all.shared().dump(), part.shared().dump());
    for (std::size_t job = 0; job < part.header().jobs.size(); ++job)
      if (part.has(job)) all.add(job, part.result(job));
  }
  for (std::size_t k = 0; k < first.header().share.parts; ++k)
    if (!seen.contains(k))
      throw InputError("merge", 0, fmt::format("all {} parts", first.header().share.parts),
                       fmt::format("no part {}", k));
  return all;
}

std::string fingerprint(const std::string& text) {
  Hash hash;
  hash.add(text);
  return hash.text();
}

std::string fingerprint(const Scene& scene) {
  Hash hash;
  hash.add(scene.bands.centres_nm());
  hash.add(scene.bands.widths_nm());
  for (const Material& m : scene.materials) {
    hash.add(m.name);
    hash.add(static_cast<double>(m.scattering));
    hash.add(m.reflectance.values);
    hash.add(m.exitance.values);
    hash.add(m.refractive_index.values);
    hash.add(m.absorption_index.values);
    hash.add(m.roughness);
  }
  for (const Surface& s : scene.surfaces) {
    hash.add(s.name);
    hash.add(static_cast<double>(s.material));
    hash.add(static_cast<double>(2 * s.is_opening + s.two_sided));
    for (const Polygon& piece : s.pieces)
      for (const Vec3& v : piece) hash.add(v);
  }
  for (const auto& [name, camera] : scene.cameras) {
    hash.add(name);
    hash.add(camera.position_m);
    hash.add(camera.direction);
    hash.add(camera.up);
    hash.add(camera.focal_length_m);
    for (int k = 0; k < 2; ++k) {
      hash.add(camera.film_m[static_cast<std::size_t>(k)]);
      hash.add(static_cast<double>(camera.pixels[static_cast<std::size_t>(k)]));
    }
  }
  return hash.text();
}

}  // namespace truebox::app
