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
  if (starts_with({'I', 'I', 42, 0}) || starts_with({'M', 'M', 0, 42}))
    return codecs::read_tiff(path);
  throw InputError(path.string(), 0, "an OpenEXR, PNG or TIFF image", "another kind of file");
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
