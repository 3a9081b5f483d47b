// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace truebox {

/// The colour of each photosite, repeating every 2 x 2 pixels from the top left: "gbrg" reads
/// green blue / red green. Nothing here interpolates: a photosite keeps what it measured.
class BayerPattern {
 public:
  BayerPattern() = default;

  /// Throws std::invalid_argument unless it is four of r, g, b with all three present.
  explicit BayerPattern(std::string pattern);

  /// 'R', 'G' or 'B' of the photosite at pixel (x, y).
  char site(int x, int y) const {
    return pattern_[2 * static_cast<std::size_t>(y & 1) + static_cast<std::size_t>(x & 1)];
  }

  const std::string& name() const { return name_; }

 private:
  std::string name_ = "gbrg";
  std::string pattern_ = "GBRG";
};

}  // namespace truebox
