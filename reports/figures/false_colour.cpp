// SPDX-License-Identifier: BSD-3-Clause
#include "figures/false_colour.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "figures/colour_map.h"
#include "figures/text.h"
#include "image/image_file.h"

namespace truebox {
namespace {

using ColourOf = std::function<Rgb8(double)>;  // of the position 0..1 along the bar

/// The smallest number of significant digits that tells the labels apart and states them well.
int label_digits(ValueRange range) {
  const double largest = std::max(std::abs(range.low), std::abs(range.high));
  const double step = (range.high - range.low) / 2.0;
  return std::clamp(3 + static_cast<int>(std::floor(std::log10(largest / step))), 3, 9);
}

std::string label(double x, const char* anchor, double value, int digits) {
  return fmt::format("<text x=\"{}\" y=\"32\" text-anchor=\"{}\">{}</text>", x, anchor,
                     number_text(value, digits));
}

std::string scale_bar(ValueRange range, const std::string& quantity, const std::string& unit,
                      const ColourOf& colour_of) {
  constexpr int kSteps = 75;
  const int digits = label_digits(range);
  const std::string shown_unit = unit_text(unit);
  const std::string name = xml_escape(quantity + (shown_unit.empty() ? "" : " / " + shown_unit));
  std::string svg = fmt::format(
      "<svg class=\"scale-bar\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 320 52\" "
      "role=\"img\" font-size=\"13\" fill=\"currentColor\"><title>{}: {} to {}</title>",
      name, number_text(range.low, digits), number_text(range.high, digits));
  for (int i = 0; i < kSteps; ++i) {
    const Rgb8 c = colour_of((i + 0.5) / kSteps);
    svg += fmt::format(
        "<rect x=\"{}\" y=\"2\" width=\"4.5\" height=\"14\" fill=\"#{:02x}{:02x}{:02x}\"/>",
        10 + 4 * i, c[0], c[1], c[2]);
  }
  svg += "<path d=\"M10 16v4M160 16v4M310 16v4\" stroke=\"currentColor\" fill=\"none\"/>";
  svg += label(10, "start", range.low, digits) +
         label(160, "middle", (range.low + range.high) / 2.0, digits) +
         label(310, "end", range.high, digits);
  svg += fmt::format("<text x=\"160\" y=\"48\" text-anchor=\"middle\">{}</text></svg>", name);
  return svg;
}

struct Beyond {
  std::size_t below = 0, above = 0, not_finite = 0;
};

std::string beyond_text(const Beyond& beyond, std::size_t pixels) {
  std::string text;
  const auto add = [&](std::size_t count, const char* what) {
    if (count == 0) return;
    text += fmt::format("{}{} of {} pixels {}", text.empty() ? "" : "; ", count, pixels, what);
  };
  add(beyond.above, "above the scale");
  add(beyond.below, "below the scale");
  add(beyond.not_finite, "not finite (magenta)");
  return text;
}

Picture paint(int width, int height, std::span<const float> values, ValueRange range,
              const std::string& quantity, const std::string& unit, const ColourOf& colour_of) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (values.size() != pixels) throw std::invalid_argument("width x height values are needed");
  if (!(range.low < range.high)) throw std::invalid_argument("a scale needs low < high");
  std::vector<std::uint8_t> rgb(3 * pixels);
  Beyond beyond;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double v = values[i];
    Rgb8 colour = kNotFiniteColour;
    if (std::isfinite(v)) colour = colour_of((v - range.low) / (range.high - range.low));
    beyond.not_finite += !std::isfinite(v);
    beyond.below += std::isfinite(v) && v < range.low;
    beyond.above += std::isfinite(v) && v > range.high;
    std::copy_n(colour.begin(), 3, rgb.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  return {encode_png_rgb8(width, height, rgb), width, height,
          scale_bar(range, quantity, unit, colour_of), beyond_text(beyond, pixels)};
}

float quantile(std::vector<float>& values, double q) {
  const double rank = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::lround(rank));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

ValueRange value_range(std::span<const float> values, double q) {
  std::vector<float> finite;
  for (float v : values)
    if (std::isfinite(v)) finite.push_back(v);
  if (finite.empty()) return {};
  ValueRange range{quantile(finite, q), quantile(finite, 1.0 - q)};
  if (range.low == range.high) range.high += std::max(1e-6, 1e-3 * std::abs(range.low));
  return range;
}

double symmetric_limit(std::span<const float> values, double q) {
  std::vector<float> magnitudes;
  for (float v : values)
    if (std::isfinite(v)) magnitudes.push_back(std::abs(v));
  const double limit = magnitudes.empty() ? 0.0 : quantile(magnitudes, q);
  return limit > 0.0 ? limit : 1.0;
}

Picture false_colour(int width, int height, std::span<const float> values, ValueRange range,
                     const std::string& quantity, const std::string& unit) {
  return paint(width, height, values, range, quantity, unit, sequential_colour);
}

Picture signed_false_colour(int width, int height, std::span<const float> values, double limit,
                            const std::string& quantity, const std::string& unit) {
  return paint(width, height, values, {-limit, limit}, quantity, unit,
               [](double t) { return diverging_colour(2.0 * t - 1.0); });
}

Picture plain_picture(int width, int height, const std::vector<std::uint8_t>& rgb,
                      std::string note) {
  return {encode_png_rgb8(width, height, rgb), width, height, "", std::move(note)};
}

}  // namespace truebox
