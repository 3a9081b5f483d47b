// SPDX-License-Identifier: BSD-3-Clause
#include "figures/score_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "figures/axis.h"
#include "figures/text.h"

namespace truebox {
namespace {

constexpr double kWidth = 480;
constexpr const char* kBar = "var(--series-0,#0072b2)";
constexpr const char* kBad = "var(--fails,#b3261e)";
constexpr const char* kCurve = "var(--series-1,#d55e00)";

std::string open(const std::string& title, double height) {
  return fmt::format(
      "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" "
      "font-size=\"14\" fill=\"currentColor\"><title>{}</title>",
      kWidth, height, xml_escape(title));
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"{}\">{}</text>", x, y, anchor,
                     text);
}

/// Names longer than the margin are cut at a character, not inside one.
std::string shortened(const std::string& name, std::size_t characters) {
  std::size_t count = 0, bytes = 0;
  for (; bytes < name.size() && count <= characters; ++bytes)
    count += (static_cast<unsigned char>(name[bytes]) & 0xC0) != 0x80;
  return count <= characters ? name : name.substr(0, bytes - 1) + "…";
}

constexpr int kBins = 20;
constexpr double kBinWidth = 0.5, kLowest = -5.0;

/// Count expected in a bin for n draws from N(0, 1); the outermost bins hold the tails.
double expected_count(int bin, double n) {
  const auto below = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
  const double low = kLowest + bin * kBinWidth;
  return n * ((bin == kBins - 1 ? 1.0 : below(low + kBinWidth)) - (bin == 0 ? 0.0 : below(low)));
}

std::string moments_text(std::span<const double> finite, std::size_t not_finite) {
  const double n = static_cast<double>(finite.size());
  const double mean = std::accumulate(finite.begin(), finite.end(), 0.0) / n;
  double square = 0.0;
  for (double v : finite) square += (v - mean) * (v - mean);
  return fmt::format("n = {}, mean {}, standard deviation {}{}", finite.size(), fixed_text(mean, 2),
                     fixed_text(std::sqrt(square / std::max(1.0, n - 1.0)), 2),
                     not_finite == 0 ? "" : fmt::format(", {} not finite", not_finite));
}

}  // namespace

std::string en_score_svg(const std::string& title, const std::vector<NamedScore>& scores) {
  constexpr double kRow = 20, kTop = 26, kLeft = 130, kRight = 452;
  double extent = 1.25;
  bool two_sided = false;
  for (const auto& s : scores) {
    if (std::isfinite(s.value)) extent = std::max(extent, 1.05 * std::abs(s.value));
    two_sided = two_sided || s.value < 0.0;
  }
  const double bottom = kTop + kRow * static_cast<double>(scores.size());
  const AxisScale x({two_sided ? -extent : 0.0, extent}, false, kLeft, kRight);
  std::string svg = open(title, bottom + 48);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const double y = kTop + kRow * static_cast<double>(i), v = scores[i].value;
    const bool agrees = std::abs(v) <= 1.0;  // false for NaN
    svg += text_at(kLeft - 10, y + 14, "end", xml_escape(shortened(scores[i].name, 16)));
    const double from = x(0.0), to = std::isfinite(v) ? x(v) : x(extent);
    svg += fmt::format(
        "<rect x=\"{:.2f}\" y=\"{}\" width=\"{:.2f}\" height=\"12\" rx=\"2\" style=\"fill:{}\"/>",
        std::min(from, to), y + 4, std::abs(to - from), agrees ? kBar : kBad);
    if (!agrees) svg += text_at(kRight + 6, y + 15, "start", "✕");
  }
  for (double limit : {-1.0, 1.0})
    if (x.shows(limit)) {
      svg += fmt::format(
          "<path d=\"M{:.2f} {}V{}\" stroke=\"currentColor\" stroke-dasharray=\"5 4\"/>", x(limit),
          kTop - 4, bottom + 4);
      svg += text_at(x(limit), 14, "middle", limit > 0 ? "agrees up to 1" : "-1");
    }
  svg += fmt::format("<path d=\"M{} {}H{}\" stroke=\"currentColor\"/>", kLeft, bottom + 4, kRight);
  for (double t : x.ticks()) svg += text_at(x(t), bottom + 20, "middle", x.tick_label(t));
  return svg + text_at((kLeft + kRight) / 2, bottom + 42, "middle", "E_n (k = 2)") + "</svg>";
}

std::string z_histogram_svg(const std::string& title, std::span<const double> z) {
  constexpr double kTop = 28, kBottom = 240, kLeft = 56, kRight = 466;
  std::array<double, kBins> counts{};
  std::vector<double> finite;
  for (double v : z) {
    if (!std::isfinite(v)) continue;
    finite.push_back(v);
    const double bin = std::clamp(std::floor((v - kLowest) / kBinWidth), 0.0, kBins - 1.0);
    counts[static_cast<std::size_t>(bin)] += 1.0;
  }
  const double n = static_cast<double>(finite.size());
  const double top = std::max(
      {*std::max_element(counts.begin(), counts.end()), expected_count(kBins / 2, n), 1.0});
  const AxisScale x({kLowest, -kLowest}, false, kLeft, kRight);
  const AxisScale y(AxisScale::nice_range({0.0, top}, false), false, kBottom, kTop);
  std::string svg = open(title, kBottom + 66);
  for (double t : y.ticks()) {
    svg +=
        fmt::format("<path d=\"M{} {:.2f}H{}\" stroke=\"currentColor\" stroke-opacity=\"0.16\"/>",
                    kLeft, y(t), kRight);
    svg += text_at(kLeft - 7, y(t) + 4.5, "end", y.tick_label(t));
  }
  std::string expected;
  for (int bin = 0; bin < kBins; ++bin) {
    const double low = kLowest + bin * kBinWidth, count = counts[static_cast<std::size_t>(bin)];
    svg += fmt::format(
        "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" style=\"fill:{}\" "
        "fill-opacity=\"0.75\"/>",
        x(low) + 0.75, y(count), x(low + kBinWidth) - x(low) - 1.5, kBottom - y(count), kBar);
    expected += fmt::format("{}{:.2f} {:.2f}", bin == 0 ? 'M' : 'L', x(low + kBinWidth / 2),
                            y(expected_count(bin, n)));
  }
  svg += fmt::format("<path fill=\"none\" stroke-width=\"2.2\" style=\"stroke:{}\" d=\"{}\"/>",
                     kCurve, expected);
  svg += fmt::format("<path d=\"M{} {}H{}\" stroke=\"currentColor\"/>", kLeft, kBottom, kRight);
  for (double t : x.ticks()) svg += text_at(x(t), kBottom + 18, "middle", x.tick_label(t));
  svg += text_at(6, 14, "start", "count (line: expected from N(0, 1))");
  svg += text_at((kLeft + kRight) / 2, kBottom + 38, "middle", "z = (test - reference) / u");
  return svg +
         text_at((kLeft + kRight) / 2, kBottom + 58, "middle",
                 moments_text(finite, z.size() - finite.size())) +
         "</svg>";
}

}  // namespace truebox
