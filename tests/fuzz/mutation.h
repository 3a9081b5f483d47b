// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <random>
#include <vector>

namespace truebox {

using Bytes = std::vector<std::uint8_t>;

/// One to eight changes of the kinds that break readers: bits, numbers at the ends of their range,
/// cuts, doubled and swapped blocks, parts of another seed, numbers and names in text replaced.
/// Deterministic: the same engine state gives the same bytes everywhere.
Bytes mutated(const Bytes& seed, const Bytes& other, std::mt19937_64& random);

}  // namespace truebox
