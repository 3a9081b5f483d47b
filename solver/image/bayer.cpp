// SPDX-License-Identifier: BSD-3-Clause
#include "image/bayer.h"

#include <stdexcept>

namespace truebox {

BayerPattern::BayerPattern(std::string pattern) : name_(std::move(pattern)), pattern_(name_) {
  for (char& c : pattern_) c = static_cast<char>(c - 'a' + 'A');
  const auto count = [&](char c) {
    int n = 0;
    for (char s : pattern_) n += s == c;
    return n;
  };
  if (pattern_.size() != 4 || count('R') != 1 || count('G') != 2 || count('B') != 1)
    throw std::invalid_argument("a Bayer pattern is rggb, bggr, grbg or gbrg, not " + name_);
}

}  // namespace truebox
