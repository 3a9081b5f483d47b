// SPDX-License-Identifier: BSD-3-Clause
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "document/codecs.h"
#include "image/half.h"

namespace truebox::detail {
namespace {

/// The power of two that brings the largest finite value into [2^14, 2^15): within a half's range
/// whatever the rounding, and with the most room for small ones.
int scale_exponent(const std::vector<float>& plane) {
  float largest = 0.0f;
  for (float v : plane)
    if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
  int exponent = 15;
  if (largest > 0.0f) std::frexp(largest, &exponent);
  return exponent - 15;
}

/// Rounds the mantissa to `kUncertaintyBits` of its 10 bits; what is not finite stays.
std::uint16_t round_uncertainty(std::uint16_t bits) {
  constexpr int kUncertaintyBits = 6, kDropped = 10 - kUncertaintyBits;
  if ((bits & 0x7c00) == 0x7c00) return bits;
  return static_cast<std::uint16_t>((bits + (1 << (kDropped - 1))) >> kDropped << kDropped);
}

}  // namespace

PackedPlane half_plane(const std::vector<float>& plane, bool is_uncertainty) {
  PackedPlane packed{{}, scale_exponent(plane)};
  packed.bits.reserve(plane.size());
  for (float v : plane) {
    const std::uint16_t bits = half_bits(std::ldexp(v, -packed.exponent));
    packed.bits.push_back(is_uncertainty ? round_uncertainty(bits) : bits);
  }
  return packed;
}

std::vector<std::uint8_t> deflate_planes(const std::vector<PackedPlane>& planes, std::size_t period,
                                         std::size_t predicted) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t p = 0; p < planes.size(); ++p) {
    const auto& bits = planes[p].bits;
    const bool follows = p >= period && p < predicted;
    const std::size_t low = bytes.size(), high = low + bits.size();
    bytes.resize(high + bits.size());
    for (std::size_t i = 0; i < bits.size(); ++i) {
      const auto d =
          static_cast<std::uint16_t>(bits[i] - (follows ? planes[p - period].bits[i] : 0));
      bytes[low + i] = static_cast<std::uint8_t>(d);
      bytes[high + i] = static_cast<std::uint8_t>(d >> 8);
    }
  }
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::vector<std::uint8_t> packed(size);
  if (compress2(packed.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 9) != Z_OK)
    throw std::runtime_error("zlib refuses to compress an image");
  packed.resize(size);
  return packed;
}

std::optional<std::vector<std::uint8_t>> inflate_exactly(const std::vector<std::uint8_t>& packed,
                                                         std::size_t size) {
  // Deflate makes at most 1032 bytes of one: a small file that claims more is not believed.
  if (size / 1032 > packed.size() + 1) return std::nullopt;
  std::vector<std::uint8_t> bytes(size);
  auto length = static_cast<uLongf>(size);
  auto used = static_cast<uLong>(packed.size());
  const int status = uncompress2(bytes.data(), &length, packed.data(), &used);
  if (status != Z_OK || length != size || used != packed.size()) return std::nullopt;
  return bytes;
}

}  // namespace truebox::detail
