// SPDX-License-Identifier: BSD-3-Clause
#include "readings/toml_reader.h"

#include <toml++/toml.h>

#include <cmath>
#include <set>
#include <sstream>

#include "radiometry/input_error.h"

namespace truebox::detail {

struct TomlTable::State {
  std::filesystem::path path;
  std::shared_ptr<toml::table> root;  // keeps `table` alive
  const toml::table* table = nullptr;
  std::set<std::string> used;

  const toml::node* find(const std::string& key) {
    used.insert(key);
    return table->get(key);
  }
};

namespace {

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

std::string described(const toml::node& node) {
  if (node.is_table()) return "a table";
  std::ostringstream text;
  text << toml::node_view<const toml::node>(node);
  const std::string value = text.str();
  return value.size() > 60 ? value.substr(0, 57) + "..." : value;
}

std::string range_text(const char* kind, double low, double high) {
  std::ostringstream text;
  text << kind;
  if (std::isfinite(low)) text << " from " << low;
  if (std::isfinite(high)) text << " to " << high;
  return text.str();
}

}  // namespace

TomlTable::TomlTable(std::unique_ptr<State> state) : state_(std::move(state)) {}
TomlTable::TomlTable(TomlTable&&) noexcept = default;
TomlTable::~TomlTable() = default;

TomlTable TomlTable::parse(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path))
    throw InputError(path.string(), 0, "a measurement file", "no such file");
  auto state = std::make_unique<State>();
  state->path = path;
  try {
    state->root = std::make_shared<toml::table>(toml::parse_file(path.string()));
  } catch (const toml::parse_error& error) {
    throw InputError(path.string(), static_cast<int>(error.source().begin.line), "valid TOML",
                     std::string(error.description()));
  }
  state->table = state->root.get();
  return TomlTable(std::move(state));
}

void TomlTable::fail(const std::string& key, const std::string& expected,
                     const std::string& found) const {
  const toml::node* node = state_->table->get(key);
  throw InputError(state_->path.string(), line_of(node ? *node : *state_->table),
                   key + " = " + expected, found);
}

bool TomlTable::has(const std::string& key) const { return state_->table->contains(key); }

int TomlTable::line() const { return line_of(*state_->table); }

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, node] : *state_->table) names.emplace_back(key.str());
  return names;
}

bool TomlTable::is_text(const std::string& key) {
  const toml::node* node = state_->find(key);
  return node && node->is_string();
}

std::string TomlTable::text(const std::string& key) {
  const toml::node* node = state_->find(key);
  if (!node) fail(key, "a text in quotes", "no such key");
  if (!node->is_string()) fail(key, "a text in quotes", described(*node));
  return *node->value<std::string>();
}

std::string TomlTable::text_or(const std::string& key, const std::string& fallback) {
  return has(key) ? text(key) : fallback;
}

double TomlTable::number(const std::string& key, double low, double high) {
  const toml::node* node = state_->find(key);
  const std::string expected = range_text("a number", low, high);
  if (!node) fail(key, expected, "no such key");
  const auto value = node->value<double>();
  if (!node->is_number() || !value || !std::isfinite(*value) || *value < low || *value > high)
    fail(key, expected, described(*node));
  return *value;
}

double TomlTable::number_or(const std::string& key, double fallback, double low, double high) {
  return has(key) ? number(key, low, high) : fallback;
}

int TomlTable::integer(const std::string& key, int low, int high) {
  const double value = number(key, low, high);
  if (value != std::floor(value)) fail(key, range_text("an integer", low, high), "a fraction");
  return static_cast<int>(value);
}

std::vector<std::string> TomlTable::texts(const std::string& key) {
  const toml::node* node = state_->find(key);
  if (!node || !node->is_array() || node->as_array()->empty())
    fail(key, "a list of texts", node ? described(*node) : "no such key");
  std::vector<std::string> values;
  for (const auto& item : *node->as_array()) {
    if (!item.is_string())
      throw InputError(state_->path.string(), line_of(item), key + " = a list of texts",
                       described(item));
    values.push_back(*item.value<std::string>());
  }
  return values;
}

std::vector<double> TomlTable::numbers(const std::string& key, std::size_t count) {
  const toml::node* node = state_->find(key);
  const std::string expected = "a list of " + std::to_string(count) + " numbers";
  if (!node || !node->is_array() || node->as_array()->size() != count)
    fail(key, expected, node ? described(*node) : "no such key");
  std::vector<double> values;
  for (const auto& item : *node->as_array()) {
    const auto value = item.value<double>();
    if (!value || !std::isfinite(*value))
      throw InputError(state_->path.string(), line_of(item), key + " = " + expected,
                       described(item));
    values.push_back(*value);
  }
  return values;
}

std::vector<int> TomlTable::integers(const std::string& key, int low, int high) {
  const toml::node* node = state_->find(key);
  if (!node || !node->is_array() || node->as_array()->empty())
    fail(key, "a list of integers", node ? described(*node) : "no such key");
  std::vector<int> values;
  for (const auto& item : *node->as_array()) {
    const auto value = item.value<std::int64_t>();
    if (!item.is_integer() || !value || *value < low || *value > high)
      throw InputError(state_->path.string(), line_of(item),
                       key + " = " + range_text("integers", low, high), described(item));
    values.push_back(static_cast<int>(*value));
  }
  return values;
}

TomlTable TomlTable::table(const std::string& key) {
  const toml::node* node = state_->find(key);
  if (!node || !node->is_table()) fail(key, "a table", node ? described(*node) : "no such key");
  auto state = std::make_unique<State>();
  state->path = state_->path;
  state->root = state_->root;
  state->table = node->as_table();
  return TomlTable(std::move(state));
}

std::vector<TomlTable> TomlTable::tables(const std::string& key) {
  const toml::node* node = state_->find(key);
  if (!node || !node->is_array() || node->as_array()->empty())
    fail(key, "a list of tables", node ? described(*node) : "no such key");
  std::vector<TomlTable> values;
  for (const auto& item : *node->as_array()) {
    if (!item.is_table())
      throw InputError(state_->path.string(), line_of(item), key + " = a list of tables",
                       described(item));
    auto state = std::make_unique<State>();
    state->path = state_->path;
    state->root = state_->root;
    state->table = item.as_table();
    values.push_back(TomlTable(std::move(state)));
  }
  return values;
}

std::string TomlTable::resolved(const std::string& key, const std::string& name) const {
  const auto path = state_->path.parent_path() / name;
  if (!std::filesystem::is_regular_file(path)) fail(key, "an existing file", "\"" + name + "\"");
  return path.string();
}

std::string TomlTable::existing_file(const std::string& key) { return resolved(key, text(key)); }

std::vector<std::string> TomlTable::existing_files(const std::string& key) {
  std::vector<std::string> paths;
  for (const auto& name : texts(key)) paths.push_back(resolved(key, name));
  return paths;
}

void TomlTable::finish() const {
  for (const auto& [key, node] : *state_->table) {
    if (state_->used.contains(std::string(key.str()))) continue;
    std::string known;
    for (const auto& name : state_->used) known += (known.empty() ? "" : ", ") + name;
    throw InputError(state_->path.string(), static_cast<int>(key.source().begin.line),
                     "one of the keys " + known, "\"" + std::string(key.str()) + "\"");
  }
}

}  // namespace truebox::detail
