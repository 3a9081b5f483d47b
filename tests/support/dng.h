// SPDX-License-Identifier: BSD-3-Clause
// A minimal RAW file, since none may be shipped: an uncompressed Digital Negative.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace truebox {

/// Little-endian DNG 1.4 of width x height photosites, 16 bit, mosaic "rggb" ... "gbrg".
/// Source: Adobe (2019), Digital Negative Specification; TIFF 6.0.
inline std::vector<std::uint8_t> dng_bytes(int width, int height,
                                           const std::vector<std::uint16_t>& samples,
                                           const std::string& pattern, int black, int white) {
  struct Entry {
    std::uint16_t tag, type;
    std::uint32_t count;
    std::vector<std::uint8_t> value;
  };
  std::vector<Entry> entries;
  const auto bytes_of = [](std::uint32_t v, int n) {
    std::vector<std::uint8_t> b;
    for (int k = 0; k < n; ++k) b.push_back(static_cast<std::uint8_t>(v >> (8 * k)));
    return b;
  };
  const auto shorts = [&](std::uint16_t tag, const std::vector<int>& values) {
    Entry e{tag, 3, static_cast<std::uint32_t>(values.size()), {}};
    for (int v : values)
      for (std::uint8_t b : bytes_of(static_cast<std::uint32_t>(v), 2)) e.value.push_back(b);
    entries.push_back(e);
  };
  const auto longs = [&](std::uint16_t tag, std::uint32_t v) {
    entries.push_back({tag, 4, 1, bytes_of(v, 4)});
  };
  const auto bytes = [&](std::uint16_t tag, const std::vector<std::uint8_t>& values,
                         std::uint16_t type = 1) {
    entries.push_back({tag, type, static_cast<std::uint32_t>(values.size()), values});
  };
  const auto text = [&](std::uint16_t tag, const std::string& s) {
    std::vector<std::uint8_t> values(s.begin(), s.end());
    values.push_back(0);
    bytes(tag, values, 2);
  };
  const auto rationals = [&](std::uint16_t tag, std::uint16_t type, const std::vector<int>& tops) {
    Entry e{tag, type, static_cast<std::uint32_t>(tops.size()), {}};
    for (int top : tops)
      for (std::uint32_t v : {static_cast<std::uint32_t>(top), 100u})
        for (std::uint8_t b : bytes_of(v, 4)) e.value.push_back(b);
    entries.push_back(e);
  };
  std::vector<std::uint8_t> colours;
  for (char c : pattern) colours.push_back(c == 'r' ? 0 : c == 'g' ? 1 : 2);
  const auto size = static_cast<std::uint32_t>(2 * samples.size());
  longs(254, 0);
  shorts(256, {width});
  shorts(257, {height});
  shorts(258, {16});
  shorts(259, {1});
  shorts(262, {32803});
  text(271, "Simulated");
  text(272, "Simulated camera");
  longs(273, 8);
  shorts(274, {1});
  shorts(277, {1});
  shorts(278, {height});
  longs(279, size);
  shorts(284, {1});
  shorts(33421, {2, 2});
  bytes(33422, colours);
  bytes(50706, {1, 4, 0, 0});
  text(50708, "Simulated camera");
  shorts(50714, {black});
  shorts(50717, {white});
  rationals(50721, 10, {100, 0, 0, 0, 100, 0, 0, 0, 100});
  rationals(50728, 5, {100, 100, 100});
  shorts(50778, {21});

  std::vector<std::uint8_t> file = {'I', 'I', 42, 0};
  const std::uint32_t directory = 8 + size + size % 2;
  for (std::uint8_t b : bytes_of(directory, 4)) file.push_back(b);
  for (std::uint16_t s : samples)
    for (std::uint8_t b : bytes_of(s, 2)) file.push_back(b);
  std::uint32_t extra = directory + 2 + 12 * static_cast<std::uint32_t>(entries.size()) + 4;
  std::vector<std::uint8_t> values;
  for (std::uint8_t b : bytes_of(static_cast<std::uint32_t>(entries.size()), 2)) file.push_back(b);
  for (const Entry& e : entries) {
    for (std::uint8_t b : bytes_of(e.tag, 2)) file.push_back(b);
    for (std::uint8_t b : bytes_of(e.type, 2)) file.push_back(b);
    for (std::uint8_t b : bytes_of(e.count, 4)) file.push_back(b);
    auto value = e.value;
    if (value.size() > 4) {
      for (std::uint8_t b : bytes_of(extra + static_cast<std::uint32_t>(values.size()), 4))
        file.push_back(b);
      if (value.size() % 2) value.push_back(0);
      values.insert(values.end(), value.begin(), value.end());
    } else {
      value.resize(4, 0);
      file.insert(file.end(), value.begin(), value.end());
    }
  }
  file.insert(file.end(), 4, 0);
  file.insert(file.end(), values.begin(), values.end());
  return file;
}

}  // namespace truebox
