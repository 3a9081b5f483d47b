// SPDX-License-Identifier: BSD-3-Clause
#include "figures/line_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "figures/text.h"

namespace truebox {
namespace {

// 480 units wide with 14 unit text: 10 px on a phone, 16 px in a column of a wide page.
constexpr double kWidth = 480, kPlotTop = 28, kPlotBottom = 270, kLeft = 64, kRight = 458;
constexpr double kLegendTop = 328, kLegendRow = 20, kCharacter = 7.8;
constexpr std::array kColours = {"#0072b2", "#d55e00", "#008a66", "#a4509a", "#9a7400", "#2a9fd6"};

constexpr std::array kDashes = {"6 5", "2 4", "11 4 2 4"};

// Solid series have colours of their own; laws to compare with are drawn as text is, each in a dash
// of its own, so that none is taken for a series.
struct Style {
  std::string colour, dash;
};

std::vector<Style> styles_of(const LinePlot& plot) {
  std::vector<Style> styles;
  std::size_t solid = 0, dashed = 0;
  for (const PlotSeries& s : plot.series) {
    if (s.dashed) {
      styles.push_back(
          {"currentColor", fmt::format(" stroke-opacity=\"0.75\" stroke-dasharray=\"{}\"",
                                       kDashes[dashed++ % kDashes.size()])});
    } else {
      const std::size_t i = solid++ % kColours.size();
      styles.push_back({fmt::format("var(--series-{},{})", i, kColours[i]), ""});
    }
  }
  return styles;
}

std::string marker(std::size_t series, double x, double y) {
  switch (series % 4) {
    case 0: return fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"3.6\"/>", x, y);
    case 1:
      return fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"6.6\" height=\"6.6\"/>", x - 3.3,
                         y - 3.3);
    case 2: return fmt::format("<path d=\"M{:.2f} {:.2f}l4.2 7.4h-8.4z\"/>", x, y - 4.8);
    default:
      return fmt::format("<path d=\"M{:.2f} {:.2f}l4.6 4.6l-4.6 4.6l-4.6 -4.6z\"/>", x, y - 4.6);
  }
}

void require_equal_lengths(const PlotSeries& s) {
  const auto fits = [&](const std::vector<double>& v) {
    return v.empty() || v.size() == s.x.size();
  };
  if (s.y.size() != s.x.size() || !fits(s.u_y) || !fits(s.half_width_x))
    throw std::invalid_argument("series '" + s.name + "' has vectors of different lengths");
}

/// The range to show: as asked, else what the data and their bars span.
ValueRange data_range(const LinePlot& plot, bool of_x) {
  const Axis& axis = of_x ? plot.x : plot.y;
  if (axis.range) return *axis.range;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& s : plot.series)
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      const auto& bars = of_x ? s.half_width_x : s.u_y;
      const double value = of_x ? s.x[i] : s.y[i], bar = bars.empty() ? 0.0 : bars[i];
      for (double v : {value - bar, value, value + bar})
        if (std::isfinite(v) && (!axis.logarithmic || v > 0.0)) {
          low = std::min(low, v);
          high = std::max(high, v);
        }
    }
  if (!(low <= high)) return axis.logarithmic ? ValueRange{1.0, 10.0} : ValueRange{0.0, 1.0};
  if (!of_x || axis.logarithmic) return AxisScale::nice_range({low, high}, axis.logarithmic);
  return low < high ? ValueRange{low, high} : AxisScale::nice_range({low, high}, false);
}

std::string axes(const LinePlot& plot, const AxisScale& x, const AxisScale& y) {
  std::string svg = "<g stroke=\"currentColor\" stroke-opacity=\"0.16\">";
  for (double t : x.ticks())
    svg += fmt::format("<path d=\"M{:.2f} {}V{}\"/>", x(t), kPlotTop, kPlotBottom);
  for (double t : y.ticks()) svg += fmt::format("<path d=\"M{} {:.2f}H{}\"/>", kLeft, y(t), kRight);
  svg += fmt::format("</g><path d=\"M{} {}V{}H{}\" stroke=\"currentColor\" fill=\"none\"/>", kLeft,
                     kPlotTop, kPlotBottom, kRight);
  for (double t : x.ticks())
    svg += fmt::format("<text x=\"{:.2f}\" y=\"{}\" text-anchor=\"middle\">{}</text>", x(t),
                       kPlotBottom + 18, x.tick_label(t));
  for (double t : y.ticks())
    svg += fmt::format("<text x=\"{}\" y=\"{:.2f}\" text-anchor=\"end\">{}</text>", kLeft - 7,
                       y(t) + 4.5, y.tick_label(t));
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                     (kLeft + kRight) / 2, kPlotBottom + 40, axis_title(plot.x));
  svg += fmt::format("<text x=\"6\" y=\"14\">{}</text>", axis_title(plot.y));
  return svg;
}

std::string ribbon(const PlotSeries& s, const AxisScale& x, const AxisScale& y) {
  std::string upper, lower;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!x.shows(s.x[i]) || !y.shows(s.y[i] + s.u_y[i]) || !y.shows(s.y[i] - s.u_y[i])) continue;
    upper += fmt::format("{:.2f},{:.2f} ", x(s.x[i]), y(s.y[i] + s.u_y[i]));
    lower.insert(0, fmt::format("{:.2f},{:.2f} ", x(s.x[i]), y(s.y[i] - s.u_y[i])));
  }
  return "<polygon fill-opacity=\"0.2\" stroke=\"none\" points=\"" + upper + lower + "\"/>";
}

std::string line(const PlotSeries& s, const Style& style, const AxisScale& x, const AxisScale& y) {
  std::string path;
  bool pen_down = false;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const bool shown = x.shows(s.x[i]) && y.shows(s.y[i]);
    if (shown) path += fmt::format("{}{:.2f} {:.2f}", pen_down ? 'L' : 'M', x(s.x[i]), y(s.y[i]));
    pen_down = shown;
  }
  if (path.empty()) return "";
  return fmt::format(
      "<path fill=\"none\" stroke-width=\"2\" stroke-linejoin=\"round\"{} d=\"{}\"/>", style.dash,
      path);
}

std::string bars(const PlotSeries& s, std::size_t i, const AxisScale& x, const AxisScale& y) {
  std::string svg;
  const double px = x(s.x[i]), py = y(s.y[i]);
  const auto inside = [](double v, double a, double b) { return std::clamp(v, a, b); };
  if (!s.half_width_x.empty())
    svg += fmt::format(
        "<path stroke-opacity=\"0.55\" stroke-width=\"1.4\" d=\"M{:.2f} {:.2f}H{:.2f}\"/>",
        inside(x(s.x[i] - s.half_width_x[i]), kLeft, kRight), py,
        inside(x(s.x[i] + s.half_width_x[i]), kLeft, kRight));
  if (s.u_y.empty() || s.line || !std::isfinite(s.u_y[i])) return svg;
  const double low = y.shows(s.y[i] - s.u_y[i]) ? y(s.y[i] - s.u_y[i]) : kPlotBottom;
  const double high = y.shows(s.y[i] + s.u_y[i]) ? y(s.y[i] + s.u_y[i]) : kPlotTop;
  return svg + fmt::format(
                   "<path stroke-width=\"1.4\" d=\"M{0:.2f} {1:.2f}V{2:.2f}M{3:.2f} {1:.2f}h7"
                   "M{3:.2f} {2:.2f}h7\"/>",
                   px, low, high, px - 3.5);
}

std::string draw(const PlotSeries& s, std::size_t index, const Style& style, const AxisScale& x,
                 const AxisScale& y) {
  std::string svg = fmt::format("<g style=\"stroke:{0};fill:{0}\">", style.colour);
  if (s.line && !s.u_y.empty()) svg += ribbon(s, x, y);
  if (s.line) svg += line(s, style, x, y);
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!x.shows(s.x[i]) || !y.shows(s.y[i])) continue;
    svg += bars(s, i, x, y);
    if (s.markers || !s.line) svg += marker(index, x(s.x[i]), y(s.y[i]));
  }
  return svg + "</g>";
}

/// The legend below the plot, wrapped; returns its SVG and the number of its rows.
std::pair<std::string, int> legend(const LinePlot& plot, const std::vector<Style>& styles) {
  std::string svg;
  double x = kLeft;
  int row = 0;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const PlotSeries& s = plot.series[i];
    const double width = 44 + kCharacter * static_cast<double>(s.name.size());
    if (x > kLeft && x + width > kWidth) {
      x = kLeft;
      ++row;
    }
    const double y = kLegendTop + row * kLegendRow;
    svg += fmt::format("<g style=\"stroke:{0};fill:{0}\">", styles[i].colour);
    if (s.line)
      svg += fmt::format("<path stroke-width=\"2\"{} d=\"M{} {}h22\"/>", styles[i].dash, x, y);
    if (s.markers || !s.line) svg += marker(i, x + 11, y);
    svg +=
        fmt::format("</g><text x=\"{}\" y=\"{}\">{}</text>", x + 28, y + 4.5, xml_escape(s.name));
    x += width;
  }
  return {svg, plot.series.empty() ? 0 : row + 1};
}

}  // namespace

std::string to_svg(const LinePlot& plot) {
  for (const auto& s : plot.series) require_equal_lengths(s);
  const AxisScale x(data_range(plot, true), plot.x.logarithmic, kLeft, kRight);
  const AxisScale y(data_range(plot, false), plot.y.logarithmic, kPlotBottom, kPlotTop);
  const std::vector<Style> styles = styles_of(plot);
  const auto [legend_svg, rows] = legend(plot, styles);
  std::string svg = fmt::format(
      "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" "
      "font-size=\"14\" fill=\"currentColor\"><title>{}</title>",
      kWidth, kLegendTop + rows * kLegendRow - 8, xml_escape(plot.title));
  svg += axes(plot, x, y);
  for (std::size_t i = 0; i < plot.series.size(); ++i)
    svg += draw(plot.series[i], i, styles[i], x, y);
  return svg + legend_svg + "</svg>";
}

}  // namespace truebox
