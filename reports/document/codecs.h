// SPDX-License-Identifier: BSD-3-Clause
// Shared by the writers; internal to this folder.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace truebox::detail {

/// Base64 with padding. Source: RFC 4648, section 4.
std::string base64_encode(const std::vector<std::uint8_t>& bytes);
std::optional<std::vector<std::uint8_t>> base64_decode(std::string_view text);

/// Why an SVG is not a plain drawing (elements, attributes and styles that `figures` writes), or
/// nothing. A report may come from a stranger; what it carries must not run or fetch anything.
std::optional<std::string> svg_objection(std::string_view svg);

/// A plane as bit patterns of halves, to be multiplied by 2^exponent.
struct PackedPlane {
  std::vector<std::uint16_t> bits;
  int exponent = 0;
};
PackedPlane half_plane(const std::vector<float>& plane, bool is_uncertainty);

/// The `packed` of an ImageSet: planes p >= period, p < predicted as differences to p - period.
std::vector<std::uint8_t> deflate_planes(const std::vector<PackedPlane>& planes, std::size_t period,
                                         std::size_t predicted);

/// The bytes of a zlib stream if there are exactly `size` of them.
std::optional<std::vector<std::uint8_t>> inflate_exactly(const std::vector<std::uint8_t>& packed,
                                                         std::size_t size);

}  // namespace truebox::detail
