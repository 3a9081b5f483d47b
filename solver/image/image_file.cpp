// SPDX-License-Identifier: BSD-3-Clause
#include "image/image_file.h"

#include <unistd.h>

#include <array>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "image/codecs.h"
#include "radiometry/input_error.h"

namespace truebox {

Image read_image(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    throw InputError(path.string(), 0, "a readable image", "no such file");
  std::array<unsigned char, 8> magic{};
  file.read(reinterpret_cast<char*>(magic.data()), magic.size());
  if (file.gcount() < 4) throw InputError(path.string(), 0, "an image", "a file of under 4 bytes");
  file.close();
  const auto starts_with = [&](std::initializer_list<int> bytes) {
    std::size_t i = 0;
    for (int b : bytes)
      if (magic[i++] != b) return false;
    return true;
  };
  if (starts_with({0x76, 0x2f, 0x31, 0x01})) return codecs::read_exr(path);
  if (starts_with({0x89, 'P', 'N', 'G'})) return codecs::read_png(path);
  if (codecs::is_raw(path)) return codecs::read_raw(path);
  if (starts_with({'I', 'I', 42, 0}) || starts_with({'M', 'M', 0, 42}))
    return codecs::read_tiff(path);
  if (starts_with({0xff, 0xd8, 0xff})) return codecs::read_jpeg(path);
  if (starts_with({'#', '?', 'R', 'A'}) || starts_with({'#', '?', 'R', 'G'}))
    return codecs::read_hdr(path);
  throw InputError(path.string(), 0, "an OpenEXR, PNG, TIFF, JPEG, Radiance or RAW image",
                   "another kind of file");
}

void write_counts(const std::filesystem::path& path, const Image& image,
                  const std::string& description) {
  const std::string ending = path.extension().string();
  const bool is_png = ending == ".png";
  if (!is_png && ending != ".tif" && ending != ".tiff")
    throw InputError(path.string(), 0, "an output ending in .png, .tif or .tiff", ending);
  const std::size_t planes = image.channels.size();
  if (planes != 1 && planes != 3)
    throw InputError(path.string(), 0, "one channel or three", std::to_string(planes));
  std::vector<std::uint16_t> samples(planes * image.pixel_count());
  for (std::size_t c = 0; c < planes; ++c)
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
      const float value = image.channels[c].samples[i];
      const bool fits = value >= 0.0f && value <= 65535.0f;
      const auto whole = static_cast<std::uint16_t>(fits ? value : 0.0f);
      if (!fits || static_cast<float>(whole) != value)
        throw InputError(path.string(), 0,
                         "whole numbers from 0 to 65535 (a sensor of 1 to 16 bits); .exr holds all",
                         std::to_string(value));
      samples[planes * i + c] = whole;
    }
  const int count = static_cast<int>(planes);
  if (is_png) {
    const auto bytes = codecs::encode_png16(image.width, image.height, count, samples, description);
    return write_file_atomically(path, bytes.data(), bytes.size());
  }
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
  auto temporary = path;
  temporary += ".part" + std::to_string(::getpid());
  try {
    codecs::write_tiff16(temporary, image.width, image.height, count, samples, description);
    std::filesystem::rename(temporary, path);
  } catch (const std::exception& error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw std::runtime_error("cannot write " + path.string() + ": " + error.what());
  }
}

void write_file_atomically(const std::filesystem::path& path, const void* bytes, std::size_t size) {
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
  auto temporary = path;
  temporary += ".part" + std::to_string(::getpid());
  {
    std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
    file.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
    file.close();
    if (!file) {
      std::error_code ignored;
      std::filesystem::remove(temporary, ignored);
      throw std::runtime_error("cannot write " + path.string() + ": " + std::strerror(errno));
    }
  }
  std::filesystem::rename(temporary, path);
}

void write_file_atomically(const std::filesystem::path& path, const std::string& text) {
  write_file_atomically(path, text.data(), text.size());
}

}  // namespace truebox
