// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>

#include "document/codecs.h"

namespace truebox::detail {
namespace {

constexpr std::array<std::string_view, 11> kElements = {
    "svg", "g", "title", "desc", "rect", "path", "circle", "line", "polyline", "polygon", "text"};
constexpr std::string_view kNameCharacters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-";
constexpr std::string_view kNamespace = "http://www.w3.org/2000/svg";

std::string_view take_name(std::string_view& s) {
  const std::string_view name =
      s.substr(0, std::min(s.find_first_not_of(kNameCharacters), s.size()));
  s.remove_prefix(name.size());
  return name;
}

void skip_space(std::string_view& s) {
  s.remove_prefix(std::min(s.find_first_not_of(" \t\r\n"), s.size()));
}

bool attribute_is_plain(std::string_view name, std::string_view value) {
  if (name == "xmlns") return value == kNamespace;
  if (name.empty() || name.starts_with("on") || name.find("href") != name.npos || name == "src")
    return false;
  // A style or a fill could fetch something, or hide that it does behind escapes.
  for (std::string_view bad :
       {"url", "URL", "Url", "://", "\\", "@", "&", "<", ">", "/*", "expression"})
    if (value.find(bad) != value.npos) return false;
  return true;
}

/// Reads `name="value"` pairs up to '>', or says what is wrong.
std::optional<std::string> attributes_objection(std::string_view& s) {
  for (;;) {
    skip_space(s);
    if (s.starts_with('/')) s.remove_prefix(1);
    if (s.starts_with('>')) {
      s.remove_prefix(1);
      return std::nullopt;
    }
    const std::string_view name = take_name(s);
    if (name.empty() || !s.starts_with("=\"")) return "a tag that is not well formed";
    s.remove_prefix(2);
    const std::size_t end = s.find('"');
    if (end == s.npos) return "an attribute without an end";
    if (!attribute_is_plain(name, s.substr(0, end)))
      return "the attribute " + std::string(name) + "=\"" + std::string(s.substr(0, end)) + "\"";
    s.remove_prefix(end + 1);
  }
}

}  // namespace

std::optional<std::string> svg_objection(std::string_view svg) {
  if (svg.empty()) return std::nullopt;
  if (!svg.starts_with("<svg ")) return "a figure that does not start with <svg";
  std::vector<std::string_view> open;
  while (!svg.empty()) {
    const std::size_t tag = svg.find('<');
    if (tag == svg.npos || (open.empty() && tag > 0)) break;
    svg.remove_prefix(tag + 1);
    const bool closing = svg.starts_with('/');
    if (closing) svg.remove_prefix(1);
    const std::string_view name = take_name(svg);
    if (std::find(kElements.begin(), kElements.end(), name) == kElements.end())
      return "the element <" + std::string(name) + ">";
    if (closing && (open.empty() || open.back() != name)) return "tags that do not match";
    const std::size_t end = svg.find('>');
    const bool empty_element = end != svg.npos && end > 0 && svg[end - 1] == '/';
    if (auto objection = attributes_objection(svg)) return objection;
    if (closing) open.pop_back();
    if (!closing && !empty_element) open.push_back(name);
    if (open.empty()) return svg.empty() ? std::nullopt : std::optional("text after </svg>");
  }
  return "a figure without its end";
}

}  // namespace truebox::detail
