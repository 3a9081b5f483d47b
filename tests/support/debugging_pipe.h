// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace truebox {

/// A child process that reads messages from its descriptor 3 and writes them to its descriptor 4,
/// each ended by a zero byte. Its own output goes nowhere; it and its children end with this.
class DebuggingPipe {
 public:
  /// Throws std::runtime_error if no process can be started.
  explicit DebuggingPipe(const std::vector<std::string>& command);
  ~DebuggingPipe();
  DebuggingPipe(const DebuggingPipe&) = delete;
  DebuggingPipe& operator=(const DebuggingPipe&) = delete;

  void send(const std::string& message);
  /// The next message, or none after that many milliseconds or at the child's end.
  std::optional<std::string> receive(int timeout_ms);

 private:
  pid_t child_ = -1;
  int to_child_ = -1, from_child_ = -1;
  std::string received_;
};

}  // namespace truebox
