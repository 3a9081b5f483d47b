// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <string>

namespace truebox {

struct CommandOutcome {
  int code = -1;     ///< -1 where a signal ended it
  std::string text;  ///< stdout and stderr
};

/// What a shell makes of a command.
inline CommandOutcome run_command(const std::string& command) {
  CommandOutcome result;
  FILE* pipe = popen(("( " + command + " ) 2>&1").c_str(), "r");
  if (!pipe) return result;
  char buffer[4096];
  for (std::size_t n; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;)
    result.text.append(buffer, n);
  const int status = pclose(pipe);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

}  // namespace truebox
