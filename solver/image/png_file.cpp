// SPDX-License-Identifier: BSD-3-Clause
#include <png.h>

#include <cstdio>
#include <memory>
#include <stdexcept>

#include "image/codecs.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

[[noreturn]] void fail(png_structp, png_const_charp text) { throw std::runtime_error(text); }
void ignore(png_structp, png_const_charp) {}

struct Reader {
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{nullptr, &std::fclose};
  png_structp png = nullptr;
  png_infop info = nullptr;
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

}  // namespace

Image codecs::read_png(const std::filesystem::path& path) try {
  Reader reader;
  reader.file.reset(std::fopen(path.c_str(), "rb"));
  if (!reader.file) throw std::runtime_error("no such file");
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, &fail, &ignore);
  reader.info = png_create_info_struct(reader.png);
  png_init_io(reader.png, reader.file.get());
  png_read_info(reader.png, reader.info);
  Image image(static_cast<int>(png_get_image_width(reader.png, reader.info)),
              static_cast<int>(png_get_image_height(reader.png, reader.info)));
  const int depth = png_get_bit_depth(reader.png, reader.info);
  const int planes = png_get_channels(reader.png, reader.info);
  require_believable_size(path, image.width, image.height, planes);
  if (depth < 8) png_set_packing(reader.png);  // one index a byte, not scaled
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  const std::size_t stride = png_get_rowbytes(reader.png, reader.info);
  std::vector<png_byte> bytes(stride * static_cast<std::size_t>(image.height));
  std::vector<png_bytep> rows;
  rows.reserve(static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y)
    rows.push_back(bytes.data() + stride * static_cast<std::size_t>(y));
  png_read_image(reader.png, rows.data());
  png_read_end(reader.png, nullptr);

  static const char* const kNames[4][4] = {
      {"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
  for (int c = 0; c < planes; ++c) image.add_channel(kNames[planes - 1][c]);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < planes; ++c) {
        const auto i = static_cast<std::size_t>(x) * static_cast<std::size_t>(planes) +
                       static_cast<std::size_t>(c);
        const int dn = depth == 16 ? rows[y][2 * i] * 256 + rows[y][2 * i + 1] : rows[y][i];
        image.channels[c].samples[image.index(x, y)] = static_cast<float>(dn);
      }
  image.attributes["unit"] = "DN";
  // Colours of 8 bit are made for displays; those of 16 bit are a sensor's counts, which are
  // linear.
  if (planes >= 3 && depth == 8) {
    image.attributes["transfer"] = "sRGB";
    image.attributes["white_dn"] = "255";
  }
  return image;
} catch (const InputError&) {
  throw;
} catch (const std::exception& error) {
  throw InputError(path.string(), 0, "a complete PNG image", error.what());
}

namespace {

// Encodes rows of interleaved samples, 16-bit ones with their high byte first.
std::vector<std::uint8_t> encode(int width, int height, int depth, int colour_type,
                                 const std::uint8_t* rows, const std::string& description) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, &fail, &ignore);
  png_infop info = png_create_info_struct(png);
  std::vector<std::uint8_t> bytes;
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, png_size_t size) {
        auto* out = static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(p));
        out->insert(out->end(), data, data + size);
      },
      [](png_structp) {});
  try {
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
                 depth, colour_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    std::string key = "Description", text = description;
    png_text comment{};
    comment.compression = PNG_TEXT_COMPRESSION_NONE;
    comment.key = key.data();
    comment.text = text.data();
    comment.text_length = text.size();
    if (!text.empty()) png_set_text(png, info, &comment, 1);
    png_write_info(png, info);
    const std::size_t stride = png_get_rowbytes(png, info);
    for (int y = 0; y < height; ++y)
      png_write_row(png, rows + stride * static_cast<std::size_t>(y));
    png_write_end(png, info);
  } catch (...) {
    png_destroy_write_struct(&png, &info);
    throw;
  }
  png_destroy_write_struct(&png, &info);
  return bytes;
}

}  // namespace

std::vector<std::uint8_t> encode_png_rgb8(int width, int height,
                                          const std::vector<std::uint8_t>& rgb) {
  return encode(width, height, 8, PNG_COLOR_TYPE_RGB, rgb.data(), "");
}

std::vector<std::uint8_t> codecs::encode_png16(int width, int height, int planes,
                                               const std::vector<std::uint16_t>& samples,
                                               const std::string& description) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * samples.size());
  for (const std::uint16_t sample : samples) {
    bytes.push_back(static_cast<std::uint8_t>(sample >> 8));
    bytes.push_back(static_cast<std::uint8_t>(sample & 255));
  }
  return encode(width, height, 16, planes == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB,
                bytes.data(), description);
}

}  // namespace truebox
