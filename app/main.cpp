// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "commands.h"
#include "job_array.h"
#include "radiometry/input_error.h"
#include "version.h"
#include "view_factor_commands.h"

namespace {

using namespace truebox::app;

int run(const Action& action) {
  try {
    return action();
  } catch (const truebox::InputError& error) {
    fmt::print(stderr, "truebox: {}\n", error.what());
    return kUnreadable;
  } catch (const truebox::MismatchError& error) {
    fmt::print(stderr, "truebox: {}\n", error.what());
    return kMismatch;
  } catch (const std::length_error& error) {  // a solve that does not fit the memory
    fmt::print(stderr, "truebox: {}\n", error.what());
    return kNotSolved;
  } catch (const std::exception& error) {
    fmt::print(stderr, "truebox: {}\n", error.what());
    return kCannotWrite;
  }
}

// Parses a command line by `parse` and does what it says.
template <class Parse>
int parse_and_run(const Parse& parse) {
  CLI::App program{
      "truebox: is this simulation of light true?\n"
      "Predicts with an error bound, measures with an uncertainty, and compares."};
  program.set_version_flag("--version", std::string("truebox ") + kVersion);
  program.require_subcommand(1);
  program.footer(
      "Exit codes: 0 agrees, 1 warning, 2 fails the gate, 3 sizes or bands do not match,\n"
      "4 unreadable or malformed input, 5 not converged or rank deficient, 64 wrong usage,\n"
      "74 a result cannot be written.\n"
      "Example: truebox demo -o out");
  Action chosen;
  for (auto* add :
       {&add_demo_command, &add_plan_command, &add_solve_command, &add_probe_command,
        &add_render_command, &add_calibrate_command, &add_chart_command, &add_align_command,
        &add_fit_command, &add_compare_command, &add_suite_command, &add_accept_command,
        &add_report_command, &add_validate_command, &add_viewfactor_command, &add_sweep_command,
        &add_merge_command, &add_export_command, &add_generate_command})
    (*add)(program, chosen);
  try {
    parse(program);
  } catch (const CLI::ParseError& error) {
    const int code = program.exit(error);
    return code == 0 ? kAgrees : kUsage;
  }
  return run(chosen);
}

}  // namespace

int truebox::app::run_command_line(std::vector<std::string> arguments) {
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes them
  return parse_and_run([&](CLI::App& program) { program.parse(arguments); });
}

int main(int argc, char** argv) {
  return parse_and_run([&](CLI::App& program) { program.parse(argc, argv); });
}
