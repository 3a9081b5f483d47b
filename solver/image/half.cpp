// SPDX-License-Identifier: BSD-3-Clause
#include "image/half.h"

#include <ImathConfig.h>
#include <half.h>

namespace truebox {

std::uint16_t half_bits(float value) { return Imath::half(value).bits(); }

float half_value(std::uint16_t bits) {
  Imath::half value;
  value.setBits(bits);
  return value;
}

}  // namespace truebox
