// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace truebox {

/// Input from outside that cannot be used: unreadable, malformed, or physically impossible.
/// The message reads "file:line: expected ..., found ..."; line 0 means that no line applies.
/// The program turns it into exit code 4.
class InputError : public std::runtime_error {
 public:
  InputError(std::string file, int line, const std::string& expected, const std::string& found);

  const std::string& file() const { return file_; }
  int line() const { return line_; }

 private:
  std::string file_;
  int line_;
};

/// Two inputs that cannot be compared: other size, other bands, other unit. Exit code 3.
class MismatchError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace truebox
