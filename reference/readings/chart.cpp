// SPDX-License-Identifier: BSD-3-Clause
#include "readings/chart.h"

#include <algorithm>

#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox {

std::size_t Chart::index_of(const std::string& patch) const {
  return static_cast<std::size_t>(std::find(patches.begin(), patches.end(), patch) -
                                  patches.begin());
}

Chart read_chart(const std::filesystem::path& labels, const std::filesystem::path& reflectance,
                 std::vector<std::string> patches) {
  Chart chart;
  chart.patches = std::move(patches);
  const TableFile table = read_table(reflectance);
  chart.provenance = require_provenance(table, Use::held_out);
  for (const auto& patch : chart.patches)
    chart.reflectance.push_back(spectrum_from_table(table, patch));

  const Image image = read_image(labels);
  if (image.channels.size() != 1)
    throw InputError(labels.string(), 0, "a label image of one channel",
                     std::to_string(image.channels.size()) + " channels");
  chart.width = image.width;
  chart.height = image.height;
  std::vector<std::size_t> count(chart.patches.size() + 1, 0);
  for (float sample : image.channels[0].samples) {
    if (sample < 0.0f || sample > static_cast<float>(chart.patches.size()))
      throw InputError(labels.string(), 0,
                       "labels from 0 to " + std::to_string(chart.patches.size()),
                       std::to_string(static_cast<int>(sample)));
    chart.labels.push_back(static_cast<std::uint8_t>(sample));
    ++count[chart.labels.back()];
  }
  for (std::size_t p = 0; p < chart.patches.size(); ++p)
    if (count[p + 1] == 0)
      throw InputError(labels.string(), 0, "pixels of patch \"" + chart.patches[p] + "\"", "none");
  return chart;
}

std::vector<std::uint8_t> eroded_labels(const Chart& chart, int margin_px) {
  std::vector<std::uint8_t> labels = chart.labels;
  const int w = chart.width, h = chart.height;
  for (int step = 0; step < margin_px; ++step) {
    const std::vector<std::uint8_t> before = labels;
    const auto at = [&](int x, int y) -> int {
      return x < 0 || y < 0 || x >= w || y >= h ? 0 : before[static_cast<std::size_t>(y * w + x)];
    };
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        const int label = at(x, y);
        if (at(x - 1, y) != label || at(x + 1, y) != label || at(x, y - 1) != label ||
            at(x, y + 1) != label)
          labels[static_cast<std::size_t>(y * w + x)] = 0;
      }
  }
  return labels;
}

}  // namespace truebox
