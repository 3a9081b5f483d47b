// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace truebox::app {

/// Exit codes of the program, as users of `idiff` know them.
enum ExitCode : int {
  kAgrees = 0,
  kWarning = 1,
  kFailsGate = 2,
  kMismatch = 3,
  kUnreadable = 4,
  kNotSolved = 5,
  kUsage = 64,
  kCannotWrite = 74,
};

/// What a subcommand does once its arguments are parsed; returns an ExitCode.
using Action = std::function<int()>;

// Each adds one subcommand and sets `chosen` when the user picked it. One file a subcommand.
void add_accept_command(CLI::App& program, Action& chosen);
void add_align_command(CLI::App& program, Action& chosen);
void add_calibrate_command(CLI::App& program, Action& chosen);
void add_chart_command(CLI::App& program, Action& chosen);
void add_compare_command(CLI::App& program, Action& chosen);
void add_demo_command(CLI::App& program, Action& chosen);
void add_export_command(CLI::App& program, Action& chosen);
void add_fit_command(CLI::App& program, Action& chosen);
void add_generate_command(CLI::App& program, Action& chosen);
void add_plan_command(CLI::App& program, Action& chosen);
void add_probe_command(CLI::App& program, Action& chosen);
void add_render_command(CLI::App& program, Action& chosen);
void add_report_command(CLI::App& program, Action& chosen);
void add_solve_command(CLI::App& program, Action& chosen);
void add_suite_command(CLI::App& program, Action& chosen);
void add_validate_command(CLI::App& program, Action& chosen);

/// The shipped measurements: $TRUEBOX_REFERENCE, else beside the installed program, else the
/// checkout the program was built from. Throws InputError if none is there.
std::string reference_directory();

}  // namespace truebox::app
