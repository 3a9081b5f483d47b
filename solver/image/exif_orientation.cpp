// SPDX-License-Identifier: BSD-3-Clause
#include "image/exif_orientation.h"

#include <algorithm>
#include <array>

namespace truebox {
namespace {

/// Numbers of a TIFF block in its own byte order; 0 beyond its end, which no valid count is.
struct Tiff {
  std::span<const std::uint8_t> bytes;
  bool little = true;

  std::uint32_t number(std::size_t at, std::size_t size) const {
    if (at > bytes.size() || size > bytes.size() - at) return 0;
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < size; ++k)
      value = 256 * value + bytes[at + (little ? size - 1 - k : k)];
    return value;
  }
};

}  // namespace

int exif_orientation(std::span<const std::uint8_t> app1) {
  constexpr std::array<std::uint8_t, 6> kExif = {'E', 'x', 'i', 'f', 0, 0};
  constexpr std::uint32_t kOrientation = 0x0112, kShort = 3;
  if (app1.size() < 14 || !std::equal(kExif.begin(), kExif.end(), app1.begin())) return 0;
  Tiff tiff{app1.subspan(6)};
  if (tiff.bytes[0] != tiff.bytes[1] || (tiff.bytes[0] != 'I' && tiff.bytes[0] != 'M')) return 0;
  tiff.little = tiff.bytes[0] == 'I';
  const std::size_t directory = tiff.number(4, 4);
  const std::uint32_t entries = tiff.number(directory, 2);
  for (std::uint32_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + std::size_t{12} * i;
    if (tiff.number(entry, 2) != kOrientation || tiff.number(entry + 2, 2) != kShort) continue;
    const auto value = static_cast<int>(tiff.number(entry + 8, 2));
    return value >= 1 && value <= 8 ? value : 0;
  }
  return 0;
}

std::pair<int, int> Turn::upright(int x, int y) const {
  const int right = width_ - 1 - x, down = height_ - 1 - y;
  switch (orientation_) {
    case 2: return {right, y};
    case 3: return {right, down};
    case 4: return {x, down};
    case 5: return {y, x};
    case 6: return {down, x};
    case 7: return {down, right};
    case 8: return {y, right};
    default: return {x, y};
  }
}

}  // namespace truebox
