// SPDX-License-Identifier: BSD-3-Clause
#include "suite_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "radiometry/input_error.h"
#include "text_file.h"

namespace truebox::app {
namespace {

constexpr std::array kPaths = {"test",     "reference",          "uncertainty", "reference-stderr",
                               "variance", "reference-variance", "error-bound", "mask",
                               "regions",  "region-names"};

struct Reader {
  std::string path;
  std::filesystem::path folder;

  [[noreturn]] void refuse(const toml::node& node, const std::string& expected,
                           const std::string& found) const {
    throw InputError(path, static_cast<int>(node.source().begin.line), expected, found);
  }

  std::string resolved(const std::string& file) const { return (folder / file).string(); }

  std::string scalar_text(const toml::node& node, const std::string& key) const {
    if (const auto text = node.value_exact<std::string>()) {
      if (std::find(kPaths.begin(), kPaths.end(), key) != kPaths.end()) return resolved(*text);
      const std::size_t equals = text->find('=');
      if (key == "region" && equals != std::string::npos)
        return text->substr(0, equals + 1) + resolved(text->substr(equals + 1));
      return *text;
    }
    if (const auto whole = node.value_exact<std::int64_t>()) return fmt::format("{}", *whole);
    if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
    refuse(node, fmt::format("a text or a number for {}", key), "something else");
  }

  /// "--key=value" for each value of one key.
  void add_option(const std::string& key, const toml::node& node,
                  std::vector<std::string>& arguments) const {
    if (const auto flag = node.value_exact<bool>()) {
      if (*flag) arguments.push_back("--" + key);
      return;
    }
    if (const toml::array* list = node.as_array()) {
      for (const toml::node& item : *list)
        arguments.push_back("--" + key + "=" + scalar_text(item, key));
      return;
    }
    arguments.push_back("--" + key + "=" + scalar_text(node, key));
  }

  std::string name_of(const toml::table& table) const {
    const toml::node* node = table.get("name");
    if (node == nullptr) refuse(table, "a name for each [[compare]]", "none");
    const auto name = node->value_exact<std::string>().value_or("");
    constexpr const char* kAllowed =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    if (name.empty() || name.size() > 100 || name.front() == '.' ||
        name.find_first_not_of(kAllowed) != std::string::npos)
      refuse(*node, "a name of letters, digits, '.', '_', '-' (it becomes a folder)",
             "\"" + name + "\"");
    return name;
  }

  std::vector<std::string> tags_of(const toml::table& table) const {
    std::vector<std::string> tags;
    const toml::node* node = table.get("tags");
    if (node == nullptr) return tags;
    const toml::array* list = node->as_array();
    if (list == nullptr) refuse(*node, "a list of tags", "something else");
    for (const toml::node& item : *list) {
      const auto tag = item.value_exact<std::string>();
      if (!tag) refuse(item, "a tag in quotes", "something else");
      tags.push_back(*tag);
    }
    return tags;
  }

  SuiteComparison comparison(const toml::table& table, const toml::table* defaults) const {
    SuiteComparison result{name_of(table), tags_of(table), {}};
    std::vector<std::string> arguments;
    std::set<std::string> given;
    for (const toml::table* source : {&table, defaults}) {
      if (source == nullptr) continue;
      std::set<std::string> here;
      for (const auto& [raw, node] : *source) {
        std::string key(raw.str());
        std::replace(key.begin(), key.end(), '_', '-');
        here.insert(key);
        if (key == "name" || key == "tags" || given.contains(key)) continue;
        add_option(key, node, arguments);
      }
      given.merge(here);
    }
    CLI::App parser;
    parser.set_help_flag();
    add_comparison_options(parser, result.arguments);
    try {
      std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes a vector
      parser.parse(arguments);
      check_comparison(result.arguments);
    } catch (const CLI::ParseError& error) {
      refuse(table, fmt::format("options of truebox compare for {}", result.name), error.what());
    }
    return result;
  }
};

}  // namespace

Suite read_suite(const std::string& path) {
  const Reader reader{path, std::filesystem::path(path).parent_path()};
  toml::table file;
  try {
    file = toml::parse(read_text(path), path);
  } catch (const toml::parse_error& error) {
    throw InputError(path, static_cast<int>(error.source().begin.line), "a suite in TOML",
                     std::string(error.description()));
  }
  Suite suite{std::filesystem::path(path).stem().string(), {}};
  for (const auto& [key, node] : file) {
    if (key.str() == "title")
      suite.title = node.value_exact<std::string>().value_or(suite.title);
    else if (key.str() != "defaults" && key.str() != "compare")
      reader.refuse(node, "title, [defaults] or [[compare]]", std::string(key.str()));
  }
  const toml::table* defaults = file["defaults"].as_table();
  const toml::array* list = file["compare"].as_array();
  if (list == nullptr || list->empty())
    throw InputError(path, 0, "at least one [[compare]]", "none");
  std::set<std::string> names;
  for (const toml::node& node : *list) {
    const toml::table* table = node.as_table();
    if (table == nullptr) reader.refuse(node, "[[compare]]", "something else");
    suite.comparisons.push_back(reader.comparison(*table, defaults));
    if (!names.insert(suite.comparisons.back().name).second)
      reader.refuse(node, "a name that no other comparison has", suite.comparisons.back().name);
  }
  return suite;
}

}  // namespace truebox::app
