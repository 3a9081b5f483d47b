// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/mutation.h"

#include <algorithm>
#include <string_view>

namespace truebox {
namespace {

std::size_t below(std::size_t limit, std::mt19937_64& random) {
  return limit == 0 ? 0 : static_cast<std::size_t>(random() % limit);
}

void put_integer(Bytes& bytes, std::mt19937_64& random) {
  constexpr std::uint64_t kEnds[] = {0,          1,          0x7f,       0x80,       0xff,
                                     0x7fff,     0x8000,     0xffff,     0x10000,    0x7fffffff,
                                     0x80000000, 0xffffffff, 0x40000000, 0x00100000, ~0ull};
  const std::size_t size = std::size_t{1} << below(4, random);
  if (bytes.size() < size) return;
  const std::uint64_t value = kEnds[below(std::size(kEnds), random)];
  const std::size_t at = below(bytes.size() - size + 1, random);
  const bool big_endian = random() % 2 != 0;
  for (std::size_t k = 0; k < size; ++k)
    bytes[at + (big_endian ? size - 1 - k : k)] = static_cast<std::uint8_t>(value >> (8 * k));
}

/// Replaces a run of letters or digits, as a hostile author of a text file would.
void put_token(Bytes& bytes, std::mt19937_64& random) {
  constexpr std::string_view kTokens[] = {
      "0",        "-1",       "1e308", "1e-320", "nan", "inf", "2147483648", "99999999999999999999",
      "",         "\"\"",     "[",     "]]",     "{",   "=",   "\n",         "../../../etc/passwd",
      "<script>", "\xff\xfe", "null",  "true"};
  const auto is_word = [](std::uint8_t c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.';
  };
  if (bytes.empty()) return;
  auto first = bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size(), random));
  first = std::find_if(first, bytes.end(), is_word);
  const auto last = std::find_if_not(first, bytes.end(), is_word);
  const std::string_view token = kTokens[below(std::size(kTokens), random)];
  const auto at = bytes.erase(first, last);
  bytes.insert(at, token.begin(), token.end());
}

void move_block(Bytes& bytes, const Bytes& from, std::mt19937_64& random) {
  if (bytes.empty() || from.empty()) return;
  const std::size_t at = below(from.size(), random);
  const std::size_t length = 1 + below(std::min<std::size_t>(from.size() - at, 64), random);
  const Bytes block(from.begin() + static_cast<std::ptrdiff_t>(at),
                    from.begin() + static_cast<std::ptrdiff_t>(at + length));
  const auto to = bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size(), random));
  bytes.insert(to, block.begin(), block.end());
}

void cut_block(Bytes& bytes, std::mt19937_64& random) {
  if (bytes.empty()) return;
  const std::size_t at = below(bytes.size(), random);
  const std::size_t length = 1 + below(std::min<std::size_t>(bytes.size() - at, 64), random);
  const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(at);
  bytes.erase(first, first + static_cast<std::ptrdiff_t>(length));
}

}  // namespace

Bytes mutated(const Bytes& seed, const Bytes& other, std::mt19937_64& random) {
  Bytes bytes = seed;
  for (std::size_t changes = 1 + below(8, random); changes > 0; --changes) {
    switch (below(8, random)) {
      case 0:
        if (!bytes.empty())
          bytes[below(bytes.size(), random)] ^= static_cast<std::uint8_t>(1u << below(8, random));
        break;
      case 1:
      case 2: put_integer(bytes, random); break;
      case 3:
      case 4: put_token(bytes, random); break;
      case 5: move_block(bytes, random() % 2 ? bytes : other, random); break;
      case 6: cut_block(bytes, random); break;
      default:
        if (random() % 4 == 0) bytes.resize(below(bytes.size() + 1, random));
    }
  }
  return bytes;
}

}  // namespace truebox
