// SPDX-License-Identifier: BSD-3-Clause
#include "text_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "radiometry/input_error.h"

namespace truebox::app {

std::string read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    throw InputError(path, 0, "a file", file ? "a folder" : "no such file");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace truebox::app
