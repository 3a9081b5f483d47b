// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ctime>

namespace truebox {

inline double clock_s(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Processor time so far, s: of all threads of this process, or of this thread alone. Unlike wall
/// clock it does not count the work of others on the same machine.
inline double process_cpu_s() { return clock_s(CLOCK_PROCESS_CPUTIME_ID); }
inline double thread_cpu_s() { return clock_s(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace truebox
