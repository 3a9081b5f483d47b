// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "document/codecs.h"
#include "document/image_set_json.h"
#include "document/writers.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

using Json = nlohmann::json;

double number(const Json& json) {
  if (!json.is_string()) return json.get<double>();
  const auto text = json.get<std::string>();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (text == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (text == "inf") return kInfinity;
  if (text == "-inf") return -kInfinity;
  throw std::invalid_argument("'" + text + "' is no number");
}

std::string text(const Json& json, const char* key) { return json.at(key).get<std::string>(); }

Agreement agreement(const Json& json, const char* key) {
  return agreement_from_text(text(json, key));
}

int digits(const Json& json) {
  const int value = json.at("digits").get<int>();
  if (value < 0 || value > 17) throw std::invalid_argument("digits must lie in 0 to 17");
  return value;
}

std::string drawing(const Json& json, const char* key) {
  std::string svg = text(json, key);
  if (const auto objection = detail::svg_objection(svg))
    throw std::invalid_argument("a figure holds " + *objection);
  return svg;
}

Picture picture(const Json& json) {
  auto bytes = detail::base64_decode(text(json, "png_base64"));
  constexpr std::uint8_t kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  if (!bytes || bytes->size() < 8 || !std::equal(kSignature, kSignature + 8, bytes->begin()))
    throw std::invalid_argument("png_base64 holds no PNG");
  return {std::move(*bytes), json.at("width_px").get<int>(), json.at("height_px").get<int>(),
          drawing(json, "scale_bar_svg"), text(json, "note")};
}

Cell cell(const Json& json) {
  Cell result;
  if (json.contains("text")) result.text = text(json, "text");
  if (json.contains("number")) result.number = number(json["number"]);
  if (json.contains("standard_uncertainty"))
    result.standard_uncertainty = number(json["standard_uncertainty"]);
  if (json.contains("mark")) result.mark = agreement(json, "mark");
  return result;
}

Table table(const Json& json) {
  Table result{text(json, "caption"), {}, {}};
  for (const auto& c : json.at("columns"))
    result.columns.push_back(
        {text(c, "name"), text(c, "unit"), digits(c), c.at("fixed").get<bool>()});
  for (const auto& row : json.at("rows")) {
    if (row.size() != result.columns.size())
      throw std::invalid_argument("a table row with other than its columns' number of cells");
    std::vector<Cell> cells;
    for (const auto& c : row) cells.push_back(cell(c));
    result.rows.push_back(std::move(cells));
  }
  return result;
}

PictureRow picture_row(const Json& json) {
  PictureRow row{{}, text(json, "caption"), std::nullopt};
  for (const auto& p : json.at("panels"))
    row.panels.push_back({text(p, "title"), picture(p.at("picture")), text(p, "alt")});
  if (json.contains("image_set"))
    row.image_set = detail::image_set_from_text(json["image_set"].dump());
  return row;
}

Block block(const Json& json) {
  const std::string kind = text(json, "kind");
  if (kind == "paragraph") return Paragraph{text(json, "text")};
  if (kind == "table") return table(json);
  if (kind == "figure")
    return Figure{text(json, "title"), drawing(json, "svg"), text(json, "caption")};
  if (kind == "pictures") return picture_row(json);
  throw std::invalid_argument("no block is called '" + kind + "'");
}

Report read(const Json& json) {
  if (json.at("truebox_report") != 1) throw std::invalid_argument("another version of the format");
  const Json& verdict = json.at("verdict");
  Report report{text(json, "title"),
                text(json, "subtitle"),
                {agreement(verdict, "outcome"), text(verdict, "sentence")},
                {},
                {},
                {},
                {}};
  for (const auto& n : json.at("key_numbers"))
    report.key_numbers.push_back(
        {text(n, "label"), number(n.at("value")), text(n, "unit"), digits(n), text(n, "note")});
  for (const auto& c : json.at("checks")) {
    report.checks.push_back({text(c, "name"),
                             agreement(c, "outcome"),
                             number(c.at("measured")),
                             number(c.at("limit")),
                             text(c, "unit"),
                             text(c, "message"),
                             {}});
    if (c.contains("earlier"))
      for (const auto& value : c["earlier"]) report.checks.back().earlier.push_back(number(value));
  }
  for (const auto& s : json.at("sections")) {
    Section section{text(s, "title"), {}};
    for (const auto& b : s.at("blocks")) section.blocks.push_back(block(b));
    report.sections.push_back(std::move(section));
  }
  for (const auto& s : json.at("provenance"))
    report.provenance.push_back({text(s, "name"), text(s, "value")});
  return report;
}

}  // namespace

Report from_json(const std::string& json_text, const std::string& file) {
  try {
    // A hostile file may nest without end, and what walks the tree is recursive.
    constexpr int kDeepest = 64;
    return read(Json::parse(json_text, [](int depth, Json::parse_event_t, Json&) {
      if (depth > kDeepest) throw std::invalid_argument("JSON nested deeper than 64 levels");
      return true;
    }));
  } catch (const Json::parse_error& error) {
    const auto end =
        json_text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, json_text.size()));
    const auto line = 1 + std::count(json_text.begin(), end, '\n');
    throw InputError(file, static_cast<int>(line), "JSON", error.what());
  } catch (const Json::exception& error) {
    throw InputError(file, 0, "a Truebox report, version 1", error.what());
  } catch (const std::invalid_argument& error) {
    throw InputError(file, 0, "a Truebox report, version 1", error.what());
  }
}

}  // namespace truebox
