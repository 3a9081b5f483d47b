// SPDX-License-Identifier: BSD-3-Clause
#include "support/debugging_pipe.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>

namespace truebox {
namespace {

/// A pipe whose ends lie above the descriptors that the child needs, and close on exec.
void make_pipe(int& read_end, int& write_end) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
  read_end = ::fcntl(ends[0], F_DUPFD_CLOEXEC, 10);
  write_end = ::fcntl(ends[1], F_DUPFD_CLOEXEC, 10);
  ::close(ends[0]);
  ::close(ends[1]);
}

}  // namespace

DebuggingPipe::DebuggingPipe(const std::vector<std::string>& command) {
  int child_reads = -1, child_writes = -1;
  make_pipe(child_reads, to_child_);
  make_pipe(from_child_, child_writes);
  std::vector<char*> arguments;
  for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  ::signal(SIGPIPE, SIG_IGN);  // a browser that has gone is an error to report, not our end
  child_ = ::fork();
  if (child_ < 0) throw std::runtime_error("no process");
  if (child_ == 0) {
    ::setpgid(0, 0);
    const int nowhere = ::open("/dev/null", O_RDWR);
    for (int descriptor : {0, 1, 2}) ::dup2(nowhere, descriptor);
    ::dup2(child_reads, 3);
    ::dup2(child_writes, 4);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }
  ::close(child_reads);
  ::close(child_writes);
}

DebuggingPipe::~DebuggingPipe() {
  ::close(to_child_);
  ::close(from_child_);
  ::kill(-child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
}

void DebuggingPipe::send(const std::string& message) {
  const char* at = message.c_str();
  for (std::size_t left = message.size() + 1; left > 0;) {
    const ssize_t written = ::write(to_child_, at, left);
    if (written <= 0) throw std::runtime_error("the browser has gone");
    at += written;
    left -= static_cast<std::size_t>(written);
  }
}

std::optional<std::string> DebuggingPipe::receive(int timeout_ms) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::milliseconds(timeout_ms);
  for (;;) {
    if (const std::size_t zero = received_.find('\0'); zero != received_.npos) {
      std::string message = received_.substr(0, zero);
      received_.erase(0, zero + 1);
      return message;
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    pollfd waiting{from_child_, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&waiting, 1, static_cast<int>(left.count())) <= 0)
      return std::nullopt;
    char buffer[1 << 16];
    const ssize_t count = ::read(from_child_, buffer, sizeof buffer);
    if (count <= 0) return std::nullopt;
    received_.append(buffer, static_cast<std::size_t>(count));
  }
}

}  // namespace truebox
