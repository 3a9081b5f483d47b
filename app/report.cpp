// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "commands.h"
#include "document/writers.h"
#include "image/image_file.h"
#include "text_file.h"

namespace truebox::app {
namespace {

struct ReportArguments {
  std::string run;
  std::string output = "report.html";
};

/// Success is having written the page; what the verdict says is for `compare` and its like.
int run_report(const ReportArguments& arguments) {
  const Report report = from_json(read_text(arguments.run), arguments.run);
  write_file_atomically(arguments.output, to_html(report));
  fmt::print("{}: {}\n{}\n", to_text(report.verdict.outcome), report.verdict.sentence,
             arguments.output);
  return kAgrees;
}

}  // namespace

void add_report_command(CLI::App& program, Action& chosen) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command = program.add_subcommand(
      "report", "Writes a report again, as one offline HTML file, from its JSON");
  command->add_option("RUN", arguments->run, "report.json of an earlier run")->required();
  command->add_option("-o,--output", arguments->output, "the HTML file to write")
      ->capture_default_str();
  command->footer("Example:\n  truebox report out/report.json -o out/report.html");
  command->callback(
      [arguments, &chosen] { chosen = [arguments] { return run_report(*arguments); }; });
}

}  // namespace truebox::app
