// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "document/writers.h"
#include "image/image_file.h"
#include "validation_checks.h"

namespace truebox::app {
namespace {

struct ValidateArguments {
  std::string only, json, junit, p_values;
  std::size_t elements = 6000;
  bool details = false;
};

nlohmann::json as_json(const std::vector<AccuracyCheck>& checks) {
  nlohmann::json list = nlohmann::json::array();
  for (const AccuracyCheck& c : checks)
    list.push_back({{"group", c.group},
                    {"name", c.name},
                    {"computed", c.computed},
                    {"certified", c.certified},
                    {"allowed", c.allowed},
                    {"unit", c.unit},
                    {"reason", c.reason},
                    {"digits", matching_digits(c.computed, c.certified)},
                    {"passed", c.passed()}});
  return {{"checks", list}};
}

void print(const std::vector<AccuracyCheck>& checks, bool details) {
  std::map<std::string, std::vector<const AccuracyCheck*>> groups;
  for (const AccuracyCheck& c : checks) groups[c.group].push_back(&c);
  fmt::print("{:<12}{:>7}{:>8}{:>14}{:>14}\n", "group", "checks", "failed", "fewest digits",
             "median digits");
  for (const auto& [group, members] : groups) {
    std::vector<double> digits;
    std::size_t failed = 0;
    for (const AccuracyCheck* c : members) {
      digits.push_back(matching_digits(c->computed, c->certified));
      failed += !c->passed();
    }
    std::sort(digits.begin(), digits.end());
    fmt::print("{:<12}{:>7}{:>8}{:>14.1f}{:>14.1f}\n", group, members.size(), failed,
               digits.front(), digits[digits.size() / 2]);
  }
  for (const AccuracyCheck& c : checks)
    if (details || !c.passed())
      fmt::print(
          "{} {}: {}: {:.12g}, certified {:.12g}, {:.1f} digits, differs by {:.2g}, allowed "
          "{:.2g} {} ({})\n",
          c.passed() ? "  ok  " : "FAILED", c.group, c.name, c.computed, c.certified,
          matching_digits(c.computed, c.certified), std::abs(c.computed - c.certified), c.allowed,
          c.unit, c.reason);
}

int validate(const ValidateArguments& a) {
  const auto progress = terminal_progress();
  Image p_values;
  const auto checks =
      run_validation(reference_directory(), a.only, a.elements, progress, &p_values);
  if (progress) progress("", 1.0);
  print(checks, a.details);
  if (!a.p_values.empty()) write_exr(a.p_values, p_values);
  if (!a.json.empty()) write_file_atomically(a.json, as_json(checks).dump(1) + "\n");
  if (!a.junit.empty()) {
    Report report;
    report.title = "truebox validate";
    report.checks = report_checks(checks);
    report.verdict = {worst_outcome(report.checks), "closed forms and certified values"};
    write_file_atomically(a.junit, to_junit(report));
  }
  for (const AccuracyCheck& c : checks)
    if (!c.passed()) return kFailsGate;
  return kAgrees;
}

}  // namespace

void add_validate_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "validate", "the program against closed forms and certified values, in digits");
  auto arguments = std::make_shared<ValidateArguments>();
  auto* only =
      command->add_option("--only", arguments->only, "one group; render runs only when named")
          ->check(CLI::IsMember({"viewfactors", "furnace", "plates", "bases", "cube", "cie171",
                                 "cornellbox", kRender}));
  command->add_option("--elements", arguments->elements, "elements of the Cornell Box")
      ->capture_default_str();
  command->add_option("--json", arguments->json, "every check as JSON");
  command->add_option("--junit", arguments->junit, "every check as JUnit XML");
  command
      ->add_option("--p-values", arguments->p_values,
                   "OpenEXR of the p-value of each pixel and band, with --only render")
      ->needs(only);
  command->add_flag("--details", arguments->details, "print every check, not only failures");
  command->footer("Example: truebox validate --only viewfactors --details");
  command->callback([=, &chosen] { chosen = [=] { return validate(*arguments); }; });
}

}  // namespace truebox::app
