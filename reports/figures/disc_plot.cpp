// SPDX-License-Identifier: BSD-3-Clause
#include "figures/disc_plot.h"

#include <fmt/format.h>

#include "figures/text.h"

namespace truebox {

std::string to_svg(const DiscPlot& plot) {
  constexpr double kCentre = 180.0, kRadius = 160.0, kWidth = 360.0, kHeight = 394.0;
  std::string svg = fmt::format(
      "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" "
      "font-size=\"14\" fill=\"currentColor\"><title>{}</title>",
      kWidth, kHeight, xml_escape(plot.title));
  svg += fmt::format(
      "<circle cx=\"{0}\" cy=\"{0}\" r=\"{1}\" fill=\"none\" "
      "stroke=\"currentColor\"/>",
      kCentre, kRadius);
  svg += fmt::format(
      "<path stroke=\"currentColor\" stroke-opacity=\"0.16\" "
      "d=\"M{0} {1}h{2}M{3} {4}v{2}\"/>",
      kCentre - kRadius, kCentre, 2.0 * kRadius, kCentre, kCentre - kRadius);
  for (const DiscRegion& region : plot.regions) {
    std::string points;
    for (const auto& [x, y] : region.outline)
      points += fmt::format("{:.2f},{:.2f} ", kCentre + kRadius * x, kCentre - kRadius * y);
    svg += fmt::format("<polygon points=\"{}\" {}/>", points,
                       region.filled
                           ? "style=\"fill:var(--series-0,#0072b2)\" fill-opacity=\"0.6\""
                           : "fill=\"none\" stroke=\"currentColor\" stroke-dasharray=\"6 5\"");
  }
  return svg + fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text></svg>",
                           kCentre, kHeight - 18.0, xml_escape(plot.caption));
}

}  // namespace truebox
