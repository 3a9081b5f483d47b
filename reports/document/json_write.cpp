// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <nlohmann/json.hpp>

#include "document/codecs.h"
#include "document/image_set_json.h"
#include "document/writers.h"
#include "figures/text.h"

namespace truebox {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0.0 ? "inf" : "-inf";
  return value;
}

Json text(const std::string& value) { return valid_text(value); }

Json write(const KeyNumber& n) {
  return {{"label", text(n.label)},
          {"value", number(n.value)},
          {"unit", text(n.unit)},
          {"digits", n.digits},
          {"note", text(n.note)}};
}

Json write(const Check& c) {
  Json json = {{"name", text(c.name)},           {"outcome", to_text(c.outcome)},
               {"measured", number(c.measured)}, {"limit", number(c.limit)},
               {"unit", text(c.unit)},           {"message", text(c.message)}};
  if (!c.earlier.empty()) {
    json["earlier"] = Json::array();
    for (double value : c.earlier) json["earlier"].push_back(number(value));
  }
  return json;
}

Json write(const Cell& cell) {
  Json json = Json::object();
  if (!cell.text.empty()) json["text"] = text(cell.text);
  if (cell.number) json["number"] = number(*cell.number);
  if (cell.standard_uncertainty) json["standard_uncertainty"] = number(*cell.standard_uncertainty);
  if (cell.mark) json["mark"] = to_text(*cell.mark);
  return json;
}

Json write(const Picture& p) {
  return {{"png_base64", detail::base64_encode(p.png)},
          {"width_px", p.width_px},
          {"height_px", p.height_px},
          {"scale_bar_svg", text(p.scale_bar_svg)},
          {"note", text(p.note)}};
}

Json write_block(const Paragraph& p) { return {{"kind", "paragraph"}, {"text", text(p.text)}}; }

Json write_block(const Table& table) {
  Json columns = Json::array(), rows = Json::array();
  for (const auto& c : table.columns)
    columns.push_back(
        {{"name", text(c.name)}, {"unit", text(c.unit)}, {"digits", c.digits}, {"fixed", c.fixed}});
  for (const auto& row : table.rows) {
    Json cells = Json::array();
    for (const auto& cell : row) cells.push_back(write(cell));
    rows.push_back(std::move(cells));
  }
  return {
      {"kind", "table"}, {"caption", text(table.caption)}, {"columns", columns}, {"rows", rows}};
}

Json write_block(const Figure& f) {
  return {{"kind", "figure"},
          {"title", text(f.title)},
          {"svg", text(f.svg)},
          {"caption", text(f.caption)}};
}

Json write_block(const PictureRow& row) {
  Json panels = Json::array();
  for (const auto& p : row.panels)
    panels.push_back(
        {{"title", text(p.title)}, {"alt", text(p.alt)}, {"picture", write(p.picture)}});
  Json json = {{"kind", "pictures"}, {"caption", text(row.caption)}, {"panels", panels}};
  if (row.image_set) json["image_set"] = Json::parse(detail::image_set_text(*row.image_set));
  return json;
}

}  // namespace

std::string to_json(const Report& report) {
  Json json = {{"truebox_report", 1},
               {"title", text(report.title)},
               {"subtitle", text(report.subtitle)},
               {"verdict",
                {{"outcome", to_text(report.verdict.outcome)},
                 {"sentence", text(report.verdict.sentence)}}}};
  for (const char* list : {"key_numbers", "checks", "sections", "provenance"})
    json[list] = Json::array();
  for (const auto& n : report.key_numbers) json["key_numbers"].push_back(write(n));
  for (const auto& c : report.checks) json["checks"].push_back(write(c));
  for (const auto& s : report.sections) {
    Json blocks = Json::array();
    for (const auto& block : s.blocks)
      blocks.push_back(std::visit([](const auto& b) { return write_block(b); }, block));
    json["sections"].push_back({{"title", text(s.title)}, {"blocks", blocks}});
  }
  for (const auto& s : report.provenance)
    json["provenance"].push_back({{"name", text(s.name)}, {"value", text(s.value)}});
  return json.dump(1) + "\n";
}

}  // namespace truebox
