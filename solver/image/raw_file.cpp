// SPDX-License-Identifier: BSD-3-Clause
#include <libraw/libraw.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>

#include "image/codecs.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr std::uint32_t kDngVersion = 50706;  // Adobe (2019), Digital Negative Specification 1.5

/// The type of the offset differs between versions of LibRaw.
template <class Offset>
void note_damage(void* damaged, const char*, Offset) {
  *static_cast<bool*>(damaged) = true;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

/// The four colours of the mosaic's cell, "rggb", from its first visible photosite; "" if it is not
/// a mosaic of 2 x 2.
std::string pattern(LibRaw& raw) {
  const auto& data = raw.imgdata.idata;
  if (data.filters < 1000 || data.colors != 3) return "";  // 9: X-Trans; 1: Leaf
  std::string cell;
  for (int row = 0; row < 8; ++row)
    for (int column = 0; column < 2; ++column) {
      const char c = data.cdesc[raw.COLOR(row, column)];
      const char lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      if (row < 2)
        cell += lower;
      else if (cell[static_cast<std::size_t>(2 * (row % 2) + column)] != lower)
        return "";  // repeats after more than two rows
    }
  return cell;
}

/// The black level common to all photosites; NaN where colours or rows have their own.
double black_level(const libraw_colordata_t& colour) {
  double extra = double(colour.cblack[0]);
  for (int k = 1; k < 4; ++k)
    if (colour.cblack[k] != colour.cblack[0]) return NAN;
  const std::size_t cells = std::size_t{colour.cblack[4]} * colour.cblack[5];
  for (std::size_t k = 0; k < std::min<std::size_t>(cells, LIBRAW_CBLACK_SIZE - 6); ++k)
    if (colour.cblack[6 + k] != colour.cblack[6]) return NAN;
  if (cells > 0) extra += double(colour.cblack[6]);
  return double(colour.black) + extra;
}

}  // namespace

bool codecs::is_raw(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static constexpr std::array<const char*, 14> kEndings = {".dng", ".cr2", ".cr3", ".crw", ".nef",
                                                           ".nrw", ".arw", ".raf", ".orf", ".rw2",
                                                           ".pef", ".srw", ".iiq", ".3fr"};
  if (std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end()) return true;
  // A TIFF whose first directory has a DNG version, whatever the file is called.
  std::ifstream file(path, std::ios::binary);
  std::array<unsigned char, 12> bytes{};
  const auto read = [&](std::size_t n) {
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(n));
    return static_cast<std::size_t>(file.gcount()) == n;
  };
  if (!read(8) || (bytes[0] != 'I' && bytes[0] != 'M') || bytes[0] != bytes[1]) return false;
  const bool little = bytes[0] == 'I';
  const auto integer = [&](std::size_t at, std::size_t n) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < n; ++k) value = (value << 8) | bytes[at + (little ? n - 1 - k : k)];
    return value;
  };
  if (integer(2, 2) != 42) return false;
  file.seekg(integer(4, 4));
  if (!read(2)) return false;
  for (std::uint32_t left = integer(0, 2); left > 0 && read(12); --left)
    if (integer(0, 2) == kDngVersion) return true;
  return false;
}

Image codecs::read_raw(const std::filesystem::path& path) {
  const auto refuse = [&](const std::string& expected, const std::string& found) {
    throw InputError(path.string(), 0, expected, found);
  };
  bool damaged = false;
  const auto raw = std::make_unique<LibRaw>(LIBRAW_OPTIONS_NONE);  // half a megabyte: no stack
  raw->set_dataerror_handler(&note_damage, &damaged);
  int error = raw->open_file(path.c_str());
  if (error != LIBRAW_SUCCESS) refuse("a camera's RAW file", libraw_strerror(error));
  const auto& sizes = raw->imgdata.sizes;
  require_believable_size(path, sizes.raw_width, sizes.raw_height, 1);
  error = raw->unpack();
  if (error != LIBRAW_SUCCESS || damaged)
    refuse("a complete RAW file",
           error == LIBRAW_SUCCESS ? "damaged or missing data" : libraw_strerror(error));
  const ushort* samples = raw->imgdata.rawdata.raw_image;
  const std::string cell = pattern(*raw);
  const bool grey = raw->imgdata.idata.filters == 0 && raw->imgdata.idata.colors == 1;
  if (!samples || (cell.empty() && !grey))
    refuse("photosites as they were read, whole numbers, a 2 x 2 mosaic or none",
           "another kind of RAW data");
  const std::size_t pitch = sizes.raw_pitch / sizeof(ushort);
  if (sizes.width < 1 || sizes.height < 1 || sizes.left_margin + sizes.width > sizes.raw_width ||
      sizes.top_margin + sizes.height > sizes.raw_height || pitch < sizes.raw_width)
    refuse("a visible area inside of the sensor", "one beyond it");
  Image image(sizes.width, sizes.height);
  auto& y = image.add_channel("Y").samples;
  for (int row = 0; row < image.height; ++row)
    for (int x = 0; x < image.width; ++x)
      y[image.index(x, row)] = samples[static_cast<std::size_t>(row + sizes.top_margin) * pitch +
                                       static_cast<std::size_t>(x + sizes.left_margin)];
  image.attributes["unit"] = "DN";
  image.attributes["bayer"] = grey ? "none" : cell;
  if (const double black = black_level(raw->imgdata.color); std::isfinite(black))
    image.attributes["black_level_dn"] = number(black);
  image.attributes["white_level_dn"] = number(double(raw->imgdata.color.maximum));
  if (raw->imgdata.other.shutter > 0.0f)
    image.attributes["exposure_s"] = number(double{raw->imgdata.other.shutter});
  return image;
}

}  // namespace truebox
