// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "acceptance.h"
#include "commands.h"
#include "comparison.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "text_file.h"

namespace truebox::app {
namespace {

using Json = nlohmann::ordered_json;

struct AcceptArguments {
  std::string test, reference, reason;
};

/// FNV-1a, 64 bit: tells by accident changed files apart, not forged ones.
/// Source: Fowler, Noll, Vo, RFC 9923.
std::string fnv1a64(const std::string& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

/// The provenance so far, or an empty one.
Json read_provenance(const std::string& path) {
  if (!std::filesystem::exists(path))
    return {{"truebox_acceptance", 1}, {"accepted", Json::array()}};
  try {
    Json json = Json::parse(read_text(path));
    if (json.at("truebox_acceptance") != 1 || !json.at("accepted").is_array())
      throw std::invalid_argument("another version of the format");
    for (const Json& entry : json["accepted"])
      for (const char* key : {"reason", "time", "from", "fnv1a64"})
        static_cast<void>(entry.at(key).get<std::string>());
    return json;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(path, 0, "the provenance that truebox accept writes", error.what());
  }
}

std::string change_text(const AcceptArguments& a) {
  if (!std::filesystem::exists(a.reference)) return "a new reference";
  ComparisonArguments c;
  c.test = a.test;
  c.reference = a.reference;
  c.no_perceptual = true;
  try {
    const DifferenceStatistics s = compare(c).statistics;
    return fmt::format("relative bias {:+.4g} %, relative root mean square {:.4g} %",
                       100.0 * s.relative_bias, 100.0 * s.relative_rms);
  } catch (const MismatchError& error) {
    return fmt::format("another kind of image: {}", error.what());
  }
}

int accept(const AcceptArguments& a) {
  read_image(a.test);  // only an image that can be read becomes a reference
  const std::string bytes = read_text(a.test), path = acceptance_path(a.reference);
  Json provenance = read_provenance(path);
  const std::string change = change_text(a);
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  provenance["accepted"].push_back(
      {{"reason", a.reason},
       {"time", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))},
       {"from", a.test},
       {"bytes", bytes.size()},
       {"fnv1a64", fnv1a64(bytes)},
       {"change", change}});
  const std::string text = provenance.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  // The reason first: a reference may be older than its provenance says, never without one.
  write_file_atomically(path, text);
  write_file_atomically(a.reference, bytes);
  fmt::print("{} is now {} ({}): {}\n", a.reference, a.test, change, a.reason);
  return kAgrees;
}

}  // namespace

std::string acceptance_path(const std::string& reference) { return reference + ".provenance.json"; }

std::string acceptance_text(const std::string& reference) {
  const std::string path = acceptance_path(reference);
  if (!std::filesystem::exists(path)) return {};
  const Json provenance = read_provenance(path);
  if (provenance["accepted"].empty()) return {};
  const Json& last = provenance["accepted"].back();
  const bool same = last["fnv1a64"] == fnv1a64(read_text(reference));
  return fmt::format("{} from {}: {}{}", last["time"].get<std::string>(),
                     last["from"].get<std::string>(), last["reason"].get<std::string>(),
                     same ? "" : " (the file has changed since)");
}

void add_accept_command(CLI::App& program, Action& chosen) {
  auto a = std::make_shared<AcceptArguments>();
  CLI::App* command = program.add_subcommand(
      "accept", "Makes TEST the new REFERENCE and keeps the reason beside it");
  command->add_option("TEST", a->test, "the image that is right")->required();
  command->add_option("REFERENCE", a->reference, "the image to replace")->required();
  command->add_option("--reason", a->reason, "why the new one is right, in words")
      ->required()
      ->check([](const std::string& text) {
        return text.find_first_not_of(" \t\r\n") == std::string::npos ? "say why, in words" : "";
      });
  command->footer(
      "The reason, time, size and change go to REFERENCE.provenance.json, which reports quote.\n"
      "Example:\n  truebox accept out/box.exr references/box.exr --reason \"finer mesh, checked "
      "against probes\"");
  command->callback([a, &chosen] { chosen = [a] { return accept(*a); }; });
}

}  // namespace truebox::app
