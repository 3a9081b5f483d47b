// SPDX-License-Identifier: BSD-3-Clause
// One target under libFuzzer; which one is decided when it is compiled.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const truebox::FuzzTarget* const kTarget = [] {
    for (const auto& target : truebox::fuzz_targets())
      if (std::string(target.name) == TRUEBOX_FUZZ_TARGET) return &target;
    std::abort();
  }();
  if (const std::string fault = truebox::run_target(*kTarget, {data, size}); !fault.empty()) {
    std::fprintf(stderr, "%s\n", fault.c_str());
    std::abort();
  }
  return 0;
}
