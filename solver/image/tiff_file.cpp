// SPDX-License-Identifier: BSD-3-Clause
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "image/codecs.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

thread_local std::string last_error;

void keep_error(const char* module, const char* format, va_list arguments) {
  char text[512];
  std::vsnprintf(text, sizeof text, format, arguments);
  last_error = std::string(module ? module : "") + ": " + text;
}

void keep_errors() {
  static std::once_flag once;
  std::call_once(once, [] {
    TIFFSetErrorHandler(&keep_error);
    TIFFSetWarningHandler(nullptr);
  });
  last_error.clear();
}

float sample(const unsigned char* row, std::size_t i, int bits, bool is_float) {
  switch (bits) {
    case 8: return row[i];
    case 16: return reinterpret_cast<const std::uint16_t*>(row)[i];
    default:
      return is_float ? reinterpret_cast<const float*>(row)[i]
                      : static_cast<float>(reinterpret_cast<const std::uint32_t*>(row)[i]);
  }
}

}  // namespace

Image codecs::read_tiff(const std::filesystem::path& path) try {
  keep_errors();
  std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(TIFFOpen(path.c_str(), "r"), &TIFFClose);
  if (!tiff) throw std::runtime_error(last_error);
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 1, planes = 1, layout = PLANARCONFIG_CONTIG, format = SAMPLEFORMAT_UINT;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &planes);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_PLANARCONFIG, &layout);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLEFORMAT, &format);
  const bool is_float = format == SAMPLEFORMAT_IEEEFP;
  if ((bits != 8 && bits != 16 && bits != 32) || (is_float && bits != 32) ||
      (!is_float && format != SAMPLEFORMAT_UINT) || planes < 1 || planes > 4 ||
      (planes > 1 && layout != PLANARCONFIG_CONTIG) || TIFFIsTiled(tiff.get()))
    throw InputError(path.string(), 0, "a strip TIFF of 1 to 4 samples, 8/16 bit or float32",
                     std::to_string(planes) + " samples of " + std::to_string(bits) + " bits");
  require_believable_size(path, width, height, planes);
  Image image(static_cast<int>(width), static_cast<int>(height));
  static const char* const kNames[4][4] = {
      {"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
  for (int c = 0; c < planes; ++c) image.add_channel(kNames[planes - 1][c]);
  std::vector<unsigned char> row(static_cast<std::size_t>(TIFFScanlineSize(tiff.get())));
  if (row.size() < std::size_t{width} * planes * bits / 8)  // subsampled colours
    throw InputError(path.string(), 0, "every sample of a pixel", "fewer");
  for (std::uint32_t y = 0; y < height; ++y) {
    if (TIFFReadScanline(tiff.get(), row.data(), y) < 0)
      throw std::runtime_error("row " + std::to_string(y) + " is missing (" + last_error + ")");
    for (std::uint32_t x = 0; x < width; ++x)
      for (int c = 0; c < planes; ++c)
        image.channels[c].samples[std::size_t{y} * width + x] =
            sample(row.data(), std::size_t{x} * planes + c, bits, is_float);
  }
  image.attributes["unit"] = "DN";
  return image;
} catch (const InputError&) {
  throw;
} catch (const std::exception& error) {
  throw InputError(path.string(), 0, "a complete TIFF image", error.what());
}

void codecs::write_tiff16(const std::filesystem::path& path, int width, int height, int planes,
                          const std::vector<std::uint16_t>& samples,
                          const std::string& description) {
  keep_errors();
  std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(TIFFOpen(path.c_str(), "w"), &TIFFClose);
  if (!tiff) throw std::runtime_error(last_error);
  TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, width);
  TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, height);
  TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 16);
  TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, planes);
  TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC,
               planes == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tiff.get(), 0));
  TIFFSetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, description.c_str());
  const std::size_t stride = static_cast<std::size_t>(width) * static_cast<std::size_t>(planes);
  std::vector<std::uint16_t> row(stride);
  for (int y = 0; y < height; ++y) {
    const auto from = samples.begin() + static_cast<std::ptrdiff_t>(stride) * y;
    std::copy(from, from + static_cast<std::ptrdiff_t>(stride), row.begin());
    if (TIFFWriteScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(y)) < 0)
      throw std::runtime_error(last_error);
  }
  if (TIFFFlush(tiff.get()) == 0) throw std::runtime_error(last_error);
}

}  // namespace truebox
