// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/exposure_blocks.h"

#include <algorithm>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr int kSpill_px = 2;
constexpr std::size_t kFewestPhotosites = 12;

}  // namespace

std::vector<const Frame*> sorted_by_exposure(const std::vector<Frame>& frames) {
  std::vector<const Frame*> sorted;
  for (const Frame& frame : frames) {
    if (frame.image.width != frames[0].image.width || frame.image.height != frames[0].image.height)
      throw MismatchError(frame.path + ": a frame of another size");
    sorted.push_back(&frame);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Frame* a, const Frame* b) { return a->exposure_s < b->exposure_s; });
  return sorted;
}

bool block_usable(const Frame& frame, int x, int y, const BlockOptions& options) {
  const Image& image = frame.image;
  if (!options.labels.empty()) {
    const std::uint8_t label = options.labels[image.index(x, y)];
    if (label == 0) return false;
    for (int row = y; row < y + options.block_px; ++row)
      for (int column = x; column < x + options.block_px; ++column)
        if (options.labels[image.index(column, row)] != label) return false;
  }
  const int x1 = std::min(x + options.block_px + kSpill_px, image.width);
  const int y1 = std::min(y + options.block_px + kSpill_px, image.height);
  for (int row = std::max(y - kSpill_px, 0); row < y1; ++row)
    for (int column = std::max(x - kSpill_px, 0); column < x1; ++column) {
      const std::size_t i = image.index(column, row);
      if (options.is_excluded(i)) continue;
      if (!(image.channels[0].samples[i] < options.saturation_dn)) return false;
    }
  return true;
}

std::vector<ExposureSeries> block_series(const std::vector<Frame>& frames,
                                         const BlockOptions& options) {
  std::vector<ExposureSeries> all;
  if (frames.size() < 2) return all;
  const auto sorted = sorted_by_exposure(frames);
  const Image& first = sorted[0]->image;
  const int stride = options.stride(), size = options.block_px;
  for (int y = 0; y + size <= first.height; y += size)
    for (int x = 0; x + size <= first.width; x += size) {
      std::vector<ExposureSeries> series(static_cast<std::size_t>(stride * stride));
      for (const Frame* frame : sorted) {
        if (!block_usable(*frame, x, y, options)) break;
        const MasterDark* dark = options.dark_of(*frame);
        for (std::size_t k = 0; k < series.size(); ++k) {
          double sum = 0.0, low = 1e30;
          std::size_t n = 0;
          for (int row = y + static_cast<int>(k) / stride; row < y + size; row += stride)
            for (int column = x + static_cast<int>(k) % stride; column < x + size;
                 column += stride) {
              const std::size_t i = first.index(column, row);
              if (options.is_excluded(i)) continue;
              const double v = frame->image.channels[0].samples[i];
              sum += v - (dark ? double{dark->mean_dn[i]} : 0.0);
              low = std::min(low, v);
              ++n;
            }
          if (n < kFewestPhotosites || low < options.floor_dn) continue;
          series[k].exposures_s.push_back(frame->exposure_s);
          series[k].readings_dn.push_back(sum / static_cast<double>(n));
        }
      }
      for (ExposureSeries& s : series)
        if (s.exposures_s.size() >= 2 && s.exposures_s.back() > s.exposures_s.front())
          all.push_back(std::move(s));
    }
  return all;
}

}  // namespace truebox
