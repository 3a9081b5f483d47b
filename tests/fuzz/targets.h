// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace truebox {

/// A reader that is fed bytes of any kind. It may return or throw InputError, MismatchError or
/// std::invalid_argument; any other exception, a crash or a hang is a fault.
struct FuzzTarget {
  const char* name;  ///< also the folder of its seeds
  void (*read)(const std::string& path);
  const char* file_name;  ///< what the bytes are called when they are read
};

const std::vector<FuzzTarget>& fuzz_targets();

/// Puts the bytes into a file of this process, beside what they may name, and reads it. Returns
/// what a fault says, else "".
std::string run_target(const FuzzTarget& target, std::span<const std::uint8_t> bytes);

}  // namespace truebox
