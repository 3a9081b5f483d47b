// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace truebox {

/// The bit pattern of the nearest half (IEEE 754 binary16: 11 significant bits, largest 65504) and
/// back. What is larger becomes infinite; NaN stays NaN.
std::uint16_t half_bits(float value);
float half_value(std::uint16_t bits);

}  // namespace truebox
