// SPDX-License-Identifier: BSD-3-Clause
// Radiance pictures (RGBE): three mantissas of 8 bits share an exponent, so steps are up to 1 %.
// Read here because stb_image, the small library for it, neither notices nor survives a truncated
// file. Source: Ward (1991), Real Pixels, Graphics Gems II; Radiance's file format document.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "image/codecs.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

struct Bytes {
  std::string data;
  std::size_t at = 0;
  int next() {
    if (at >= data.size()) throw std::runtime_error("the file ends too early");
    return static_cast<unsigned char>(data[at++]);
  }
  std::string line() {
    const std::size_t end = data.find('\n', at);
    if (end == std::string::npos) throw std::runtime_error("the header does not end");
    const std::string text = data.substr(at, end - at);
    at = end + 1;
    return text;
  }
};

// The product of all EXPOSURE lines: samples are divided by it to be radiances again.
double read_header(Bytes& bytes, int& width, int& height) {
  double exposure = 1.0;
  for (std::string line = bytes.line(); !line.empty(); line = bytes.line()) {
    if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
      throw std::runtime_error("\"" + line + "\", read is 32-bit_rle_rgbe only");
    if (!line.starts_with("EXPOSURE=")) continue;
    const double factor = std::strtod(line.c_str() + 9, nullptr);
    if (!std::isfinite(factor) || factor <= 0.0) throw std::runtime_error("\"" + line + "\"");
    exposure *= factor;
  }
  const std::string resolution = bytes.line();
  if (std::sscanf(resolution.c_str(), "-Y %9d +X %9d", &height, &width) != 2 || width < 1 ||
      height < 1)
    throw std::runtime_error("the resolution \"" + resolution + "\", read is -Y H +X W only");
  return exposure;
}

// A row of RGBE, component by component in runs, or pixel by pixel.
void read_row(Bytes& bytes, std::vector<unsigned char>& rgbe) {
  const std::size_t width = rgbe.size() / 4;
  int head[4];
  for (int& h : head) h = bytes.next();
  if (head[0] != 2 || head[1] != 2 || head[2] > 127) {  // not in runs
    for (std::size_t k = 0; k < 4; ++k) rgbe[k] = static_cast<unsigned char>(head[k]);
    for (std::size_t k = 4; k < rgbe.size(); ++k)
      rgbe[k] = static_cast<unsigned char>(bytes.next());
    return;
  }
  if (static_cast<std::size_t>(head[2] * 256 + head[3]) != width)
    throw std::runtime_error("a row of another length");
  for (std::size_t c = 0; c < 4; ++c)
    for (std::size_t x = 0; x < width;) {
      const int code = bytes.next();
      const std::size_t run = static_cast<std::size_t>(code > 128 ? code - 128 : code);
      if (run == 0 || x + run > width) throw std::runtime_error("a run beyond the end of its row");
      int value = code > 128 ? bytes.next() : 0;
      for (std::size_t k = 0; k < run; ++k) {
        if (code <= 128) value = bytes.next();
        rgbe[4 * x++ + c] = static_cast<unsigned char>(value);
      }
    }
}

}  // namespace

Image codecs::read_hdr(const std::filesystem::path& path) try {
  std::ifstream file(path, std::ios::binary);
  Bytes bytes{{std::istreambuf_iterator<char>(file), {}}};
  int width = 0, height = 0;
  const double exposure = read_header(bytes, width, height);
  require_believable_size(path, width, height, 3);
  Image image(width, height);
  for (const char* name : {"R", "G", "B"}) image.add_channel(name);
  std::vector<unsigned char> rgbe(4 * static_cast<std::size_t>(width));
  for (int y = 0; y < height; ++y) {
    read_row(bytes, rgbe);
    for (int x = 0; x < width; ++x) {
      const unsigned char* p = &rgbe[4 * static_cast<std::size_t>(x)];
      for (std::size_t c = 0; c < 3; ++c)
        image.channels[c].samples[image.index(x, y)] =
            p[3] == 0 ? 0.0f : static_cast<float>(std::ldexp(p[c] + 0.5, p[3] - 136) / exposure);
    }
  }
  return image;
} catch (const InputError&) {
  throw;
} catch (const std::exception& error) {
  throw InputError(path.string(), 0, "a complete Radiance picture (RGBE)", error.what());
}

}  // namespace truebox
