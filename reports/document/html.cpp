// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <kainjow/mustache.hpp>
#include <stdexcept>

#include "document/codecs.h"
#include "document/image_set_json.h"
#include "document/writers.h"
#include "figures/colour_map.h"
#include "figures/text.h"

namespace truebox {
namespace embedded {
extern const char* const kReportTemplate;
extern const char* const kReportStyle;
extern const char* const kReportScript;
extern const char* const kViewerStyle;
extern const char* const kViewerScript;
}  // namespace embedded

namespace {

using kainjow::mustache::data;
using List = data;

List list() { return data(data::type::list); }

/// The words and the icon of an outcome: never its colour alone.
void set_outcome(data& target, Agreement outcome) {
  constexpr const char* kIcons[] = {"M5 12.5l4.5 4.5L19 7.5", "M12 5v9M12 18v.5",
                                    "M6.5 6.5l11 11M17.5 6.5l-11 11", "M12 5v7l4 3"};
  const std::string text = to_text(outcome);
  target.set("outcome", text);
  target.set("outcome_class", outcome == Agreement::not_run ? "fails" : text);
  target.set("outcome_icon", kIcons[static_cast<int>(outcome)]);
}

/// Mustache looks a missing key up in the parents, so every key is set, if only to "".
data texts(std::initializer_list<std::pair<const char*, std::string>> pairs) {
  data result{data::type::object};
  for (const auto& [key, value] : pairs) result.set(key, value);
  return result;
}

std::string cell_text(const Cell& cell, const Column& column) {
  if (!cell.number) return cell.text;
  std::string number;
  if (cell.standard_uncertainty) {
    number = estimate_text(*cell.number, *cell.standard_uncertainty, column.digits);
  } else {
    number = column.fixed ? fixed_text(*cell.number, column.digits)
                          : number_text(*cell.number, column.digits);
  }
  return cell.text.empty() ? number : number + " " + cell.text;
}

data block_data(const Paragraph& paragraph) {
  data d = texts({{"text", paragraph.text}});
  d.set("is_paragraph", true);
  return d;
}

bool is_numeric(const Table& table, std::size_t column) {
  for (const auto& row : table.rows)
    if (row[column].number) return true;
  return false;
}

data block_data(const Table& table) {
  data d = texts({{"caption", table.caption}});
  d.set("is_table", true);
  for (const auto& row : table.rows)
    if (row.size() != table.columns.size())
      throw std::invalid_argument("table '" + table.caption + "' has a row of another length");
  List columns = list(), rows = list();
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    columns << texts({{"name", table.columns[c].name},
                      {"column_unit", unit_text(table.columns[c].unit)},
                      {"cell_class", is_numeric(table, c) ? "number" : ""}});
  for (const auto& row : table.rows) {
    List cells = list();
    for (std::size_t c = 0; c < row.size(); ++c) {
      data cell = texts({{"cell_text", cell_text(row[c], table.columns[c])},
                         {"cell_class", row[c].number ? "number" : ""}});
      cell.set("is_row_header", c == 0);
      cell.set("is_cell", c != 0);
      cell.set("marked", row[c].mark.has_value());
      if (row[c].mark) set_outcome(cell, *row[c].mark);
      cells << cell;
    }
    data r{data::type::object};
    r.set("cells", cells);
    rows << r;
  }
  d.set("columns", columns);
  d.set("rows", rows);
  return d;
}

std::string checked_svg(const std::string& svg) {
  if (const auto objection = detail::svg_objection(valid_text(svg)))
    throw std::invalid_argument("a figure holds " + *objection);
  return valid_text(svg);
}

data block_data(const Figure& figure) {
  data d = texts({{"figure_title", figure.title},
                  {"svg", checked_svg(figure.svg)},
                  {"caption", figure.caption}});
  d.set("is_figure", true);
  return d;
}

/// JSON inside a script element: there only "</script" and "<!--" mean anything to HTML.
std::string script_json(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (char c : json) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

/// 256 steps of both false-colour maps, for the viewer.
std::string colour_maps_json() {
  std::string sequential, diverging;
  for (int i = 0; i < 256; ++i) {
    const Rgb8 s = sequential_colour(i / 255.0), d = diverging_colour(i / 127.5 - 1.0);
    sequential += fmt::format("{:02x}{:02x}{:02x}", s[0], s[1], s[2]);
    diverging += fmt::format("{:02x}{:02x}{:02x}", d[0], d[1], d[2]);
  }
  return fmt::format(R"({{"sequential":"{}","diverging":"{}"}})", sequential, diverging);
}

bool has_image_set(const Report& report) {
  for (const auto& section : report.sections)
    for (const auto& block : section.blocks)
      if (const auto* row = std::get_if<PictureRow>(&block); row != nullptr && row->image_set)
        return true;
  return false;
}

data block_data(const PictureRow& row) {
  data d = texts({{"caption", row.caption}});
  d.set("is_pictures", true);
  d.set("several", row.panels.size() > 1);
  d.set("has_image_set", row.image_set.has_value());
  if (row.image_set) d.set("image_set", script_json(detail::image_set_text(*row.image_set)));
  List panels = list();
  for (const auto& p : row.panels)
    panels << texts({{"panel_title", p.title},
                     {"alt", p.alt},
                     {"png", detail::base64_encode(p.picture.png)},
                     {"width", std::to_string(p.picture.width_px)},
                     {"height", std::to_string(p.picture.height_px)},
                     {"pixel_class", p.picture.width_px < 300 ? "coarse" : "fine"},
                     {"scale_bar", checked_svg(p.picture.scale_bar_svg)},
                     {"panel_note", p.picture.note}});
  d.set("panels", panels);
  return d;
}

/// Counts are whole and are written so.
std::string check_number(double value) {
  const bool whole = value == std::floor(value) && std::abs(value) < 1e9;
  return whole ? fixed_text(value, 0) : number_text(value, 4);
}

data check_data(const Check& check) {
  data d = texts({{"name", check.name},
                  {"measured", check_number(check.measured)},
                  {"limit", check_number(check.limit)},
                  {"check_unit", unit_text(check.unit)},
                  {"message", check.message}});
  set_outcome(d, check.outcome);
  return d;
}

data section_data(const Section& section, std::size_t index) {
  data d = texts({{"section_title", section.title}, {"section_id", fmt::format("s{}", index + 1)}});
  List blocks = list();
  for (const auto& block : section.blocks) {
    data b = std::visit([](const auto& x) { return block_data(x); }, block);
    for (const char* kind : {"is_paragraph", "is_table", "is_figure", "is_pictures"})
      if (b.get(kind) == nullptr) b.set(kind, false);
    blocks << b;
  }
  d.set("blocks", blocks);
  return d;
}

}  // namespace

std::string to_html(const Report& report) {
  const bool viewer = has_image_set(report);
  const auto with_viewer = [&](const char* text, const char* more) {
    return viewer ? std::string(text) + more : std::string(text);
  };
  data d = texts({{"title", report.title},
                  {"subtitle", report.subtitle},
                  {"sentence", report.verdict.sentence},
                  {"style", with_viewer(embedded::kReportStyle, embedded::kViewerStyle)},
                  {"script", with_viewer(embedded::kReportScript, embedded::kViewerScript)},
                  {"colour_maps", viewer ? colour_maps_json() : ""}});
  d.set("has_viewer", viewer);
  set_outcome(d, report.verdict.outcome);
  List key_numbers = list(), sections = list(), checks = list(), provenance = list();
  for (const auto& n : report.key_numbers)
    key_numbers << texts({{"label", n.label},
                          {"value", number_text(n.value, n.digits)},
                          {"key_unit", unit_text(n.unit)},
                          {"note", n.note}});
  for (std::size_t i = 0; i < report.sections.size(); ++i)
    sections << section_data(report.sections[i], i);
  for (const auto& c : report.checks) checks << check_data(c);
  for (const auto& s : report.provenance)
    provenance << texts({{"name", s.name}, {"value", s.value}});
  d.set("has_key_numbers", !report.key_numbers.empty());
  d.set("has_checks", !report.checks.empty());
  d.set("has_provenance", !report.provenance.empty());
  d.set("has_contents", report.sections.size() > 1);
  d.set("key_numbers", key_numbers);
  d.set("sections", sections);
  d.set("checks", checks);
  d.set("provenance", provenance);
  kainjow::mustache::mustache page(embedded::kReportTemplate);
  page.set_custom_escape([](const std::string& text) { return xml_escape(text); });
  if (!page.is_valid()) throw std::logic_error("report.mustache: " + page.error_message());
  return page.render(d);
}

}  // namespace truebox
