// SPDX-License-Identifier: BSD-3-Clause
// A TOML table whose mistakes name their place. Internal to this folder's sources.
#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace truebox::detail {

/// One table of a TOML file. Each key asked for is ticked off; finish() refuses the others.
class TomlTable {
 public:
  /// Parses a file. InputError: missing, or not TOML.
  static TomlTable parse(const std::filesystem::path& path);
  ~TomlTable();
  TomlTable(TomlTable&&) noexcept;

  bool has(const std::string& key) const;
  int line() const;                       ///< where the table begins
  std::vector<std::string> keys() const;  ///< where names are the author's own
  bool is_text(const std::string& key);
  std::string text(const std::string& key);
  std::string text_or(const std::string& key, const std::string& fallback);
  /// A number in [low, high].
  double number(const std::string& key, double low = -std::numeric_limits<double>::infinity(),
                double high = std::numeric_limits<double>::infinity());
  double number_or(const std::string& key, double fallback, double low, double high);
  int integer(const std::string& key, int low, int high);
  std::vector<std::string> texts(const std::string& key);
  /// So many finite numbers.
  std::vector<double> numbers(const std::string& key, std::size_t count);
  std::vector<int> integers(const std::string& key, int low, int high);
  TomlTable table(const std::string& key);
  std::vector<TomlTable> tables(const std::string& key);
  /// A path relative to the file that exists.
  std::string existing_file(const std::string& key);
  std::vector<std::string> existing_files(const std::string& key);

  /// InputError at a key that nobody asked for.
  void finish() const;
  [[noreturn]] void fail(const std::string& key, const std::string& expected,
                         const std::string& found) const;

 private:
  struct State;
  explicit TomlTable(std::unique_ptr<State> state);
  std::string resolved(const std::string& key, const std::string& name) const;
  std::unique_ptr<State> state_;
};

}  // namespace truebox::detail
