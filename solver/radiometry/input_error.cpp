// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/input_error.h"

#include <utility>

namespace truebox {
namespace {

std::string message(const std::string& file, int line, const std::string& expected,
                    const std::string& found) {
  std::string text = file;
  if (line > 0) text += ":" + std::to_string(line);
  return text + ": expected " + expected + ", found " + found;
}

}  // namespace

InputError::InputError(std::string file, int line, const std::string& expected,
                       const std::string& found)
    : std::runtime_error(message(file, line, expected, found)),
      file_(std::move(file)),
      line_(line) {}

}  // namespace truebox
