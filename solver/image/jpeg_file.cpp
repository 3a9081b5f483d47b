// SPDX-License-Identifier: BSD-3-Clause
// jpeglib.h needs FILE and does not include it.
// clang-format off
#include <cstdio>
#include <jpeglib.h>
// clang-format on

#include <array>
#include <memory>
#include <stdexcept>

#include "image/codecs.h"
#include "image/exif_orientation.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

[[noreturn]] void fail(j_common_ptr jpeg) {
  std::array<char, JMSG_LENGTH_MAX> text{};
  jpeg->err->format_message(jpeg, text.data());
  throw std::runtime_error(text.data());
}

// libjpeg warns where data are damaged and invents the rest; measurements are refused instead.
void fail_on_warning(j_common_ptr jpeg, int level) {
  if (level < 0) fail(jpeg);
}

struct Reader {
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{nullptr, &std::fclose};
  jpeg_error_mgr errors{};
  jpeg_decompress_struct jpeg{};

  Reader() {
    jpeg.err = jpeg_std_error(&errors);
    errors.error_exit = &fail;
    errors.emit_message = &fail_on_warning;
    jpeg_create_decompress(&jpeg);
  }
  ~Reader() { jpeg_destroy_decompress(&jpeg); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
};

int orientation_of(const jpeg_decompress_struct& jpeg) {
  for (auto* marker = jpeg.marker_list; marker != nullptr; marker = marker->next)
    if (marker->marker == JPEG_APP0 + 1)
      if (const int found = exif_orientation({marker->data, marker->data_length})) return found;
  return 1;
}

void refuse_many_scans(const jpeg_decompress_struct& jpeg) {
  // A progressive file may refine each coefficient a bit a scan; a hostile one goes on for hours.
  constexpr int kMostScans = 500;
  if (jpeg.input_scan_number > kMostScans) throw std::runtime_error("more than 500 scans");
}

}  // namespace

Image codecs::read_jpeg(const std::filesystem::path& path) try {
  Reader reader;
  jpeg_decompress_struct& jpeg = reader.jpeg;
  reader.file.reset(std::fopen(path.c_str(), "rb"));
  if (!reader.file) throw std::runtime_error("no such file");
  jpeg_stdio_src(&jpeg, reader.file.get());
  jpeg_save_markers(&jpeg, JPEG_APP0 + 1, 0xffff);
  jpeg_read_header(&jpeg, TRUE);
  const bool grey = jpeg.jpeg_color_space == JCS_GRAYSCALE;
  if (!grey && jpeg.jpeg_color_space != JCS_YCbCr && jpeg.jpeg_color_space != JCS_RGB)
    throw InputError(path.string(), 0, "a grey or RGB JPEG",
                     std::to_string(jpeg.num_components) + " components (CMYK is for printing)");
  const int planes = grey ? 1 : 3;
  require_believable_size(path, jpeg.image_width, jpeg.image_height, planes);
  jpeg.out_color_space = grey ? JCS_GRAYSCALE : JCS_RGB;
  jpeg.dct_method = JDCT_ISLOW;  // the most exact of the integer transforms
  jpeg.buffered_image = jpeg_has_multiple_scans(&jpeg);
  jpeg_start_decompress(&jpeg);
  if (jpeg.buffered_image) {
    while (!jpeg_input_complete(&jpeg)) {
      if (jpeg_consume_input(&jpeg) == JPEG_SUSPENDED) throw std::runtime_error("truncated");
      refuse_many_scans(jpeg);
    }
    jpeg_start_output(&jpeg, jpeg.input_scan_number);
  }
  const int width = static_cast<int>(jpeg.output_width);
  const int height = static_cast<int>(jpeg.output_height);
  const Turn turn(orientation_of(jpeg), width, height);
  Image image(turn.width(), turn.height());
  static const char* const kColours[] = {"R", "G", "B"};
  for (int c = 0; c < planes; ++c) image.add_channel(grey ? "Y" : kColours[c]);
  std::vector<JSAMPLE> row(static_cast<std::size_t>(width) * static_cast<std::size_t>(planes));
  for (int y = 0; y < height; ++y) {
    JSAMPROW rows[] = {row.data()};
    if (jpeg_read_scanlines(&jpeg, rows, 1) != 1) throw std::runtime_error("truncated");
    for (int x = 0; x < width; ++x) {
      const auto [to_x, to_y] = turn.upright(x, y);
      for (int c = 0; c < planes; ++c)
        image.channels[static_cast<std::size_t>(c)].samples[image.index(to_x, to_y)] =
            row[static_cast<std::size_t>(x * planes + c)];
    }
  }
  if (jpeg.buffered_image) jpeg_finish_output(&jpeg);
  jpeg_finish_decompress(&jpeg);
  image.attributes["unit"] = "DN";
  image.attributes["transfer"] = "sRGB";  // no JPEG is linear
  image.attributes["white_dn"] = "255";
  return image;
} catch (const InputError&) {
  throw;
} catch (const std::exception& error) {
  throw InputError(path.string(), 0, "a complete JPEG image", error.what());
}

}  // namespace truebox
