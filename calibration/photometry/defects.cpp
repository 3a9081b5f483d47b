// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/defects.h"

#include <algorithm>
#include <cmath>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr double kDeadBelow = 0.5, kStuckChange_sigma = 10.0;

template <class T>
double median_of(std::vector<T>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

/// Values of the neighbours of one colour in a square of 5 x 5 of them, the centre left out.
std::vector<float> neighbours(const std::vector<float>& plane, int width, int height, int x, int y,
                              int stride) {
  std::vector<float> values;
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx) {
      const int nx = x + dx * stride, ny = y + dy * stride;
      if ((dx == 0 && dy == 0) || nx < 0 || ny < 0 || nx >= width || ny >= height) continue;
      const float v = plane[static_cast<std::size_t>(ny) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(nx)];
      if (std::isfinite(v)) values.push_back(v);
    }
  return values;
}

void mark(std::vector<std::uint8_t>& flags, std::size_t i, PhotositeFlag flag, std::size_t& count) {
  if ((flags[i] & flag) == 0) ++count;
  flags[i] = static_cast<std::uint8_t>(flags[i] | flag);
}

}  // namespace

std::size_t DefectMap::total() const {
  std::size_t n = 0;
  for (std::uint8_t f : flags) n += f != 0 ? 1 : 0;
  return n;
}

void mark_hot(const MasterDark& dark, double sigmas, DefectMap& defects) {
  defects.flags.resize(dark.mean_dn.size(), 0);
  std::vector<float> values = dark.mean_dn;
  const double middle = median_of(values);
  for (float& v : values) v = static_cast<float>(std::abs(double{v} - middle));
  const double spread = std::max(1.4826 * median_of(values), std::sqrt(dark.variance_dn2));
  defects.hot_limit_dn = middle + sigmas * spread;
  for (std::size_t i = 0; i < dark.mean_dn.size(); ++i)
    if (dark.mean_dn[i] > defects.hot_limit_dn) mark(defects.flags, i, kHotPhotosite, defects.hot);
}

void mark_dead(const std::vector<float>& relative, const BlockOptions& options, int width,
               int height, DefectMap& defects) {
  defects.flags.resize(relative.size(), 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(x);
      auto around = neighbours(relative, width, height, x, y, options.stride());
      if (around.size() < 3) continue;
      const double ratio = relative[i] / median_of(around);
      if (!(ratio >= kDeadBelow && ratio <= 1.0 / kDeadBelow))
        mark(defects.flags, i, kDeadPhotosite, defects.dead);
    }
}

void mark_stuck(const std::vector<Frame>& frames, const BlockOptions& options, double sigma_dn,
                DefectMap& defects) {
  if (frames.size() < 2) return;
  const auto sorted = sorted_by_exposure(frames);
  const Image& first = sorted.front()->image;
  const Image& last = sorted.back()->image;
  defects.flags.resize(first.pixel_count(), 0);
  for (std::size_t i = 0; i < first.pixel_count(); ++i) {
    const float reading = first.channels[0].samples[i];
    if (!(reading < options.saturation_dn) || reading <= options.floor_dn + 3.0 * sigma_dn)
      continue;
    const bool same = std::all_of(sorted.begin(), sorted.end(), [&](const Frame* frame) {
      return frame->image.channels[0].samples[i] == reading;
    });
    if (!same) continue;
    const int x = static_cast<int>(i) % first.width, y = static_cast<int>(i) / first.width;
    auto before =
        neighbours(first.channels[0].samples, first.width, first.height, x, y, options.stride());
    auto after =
        neighbours(last.channels[0].samples, first.width, first.height, x, y, options.stride());
    if (before.size() < 3) continue;
    if (std::abs(median_of(after) - median_of(before)) > kStuckChange_sigma * sigma_dn)
      mark(defects.flags, i, kStuckPhotosite, defects.stuck);
  }
}

void mark_unusable(const std::vector<Frame>& frames, const std::vector<float>& mask,
                   DefectMap& defects) {
  for (const Frame& frame : frames) {
    const auto& samples = frame.image.channels[0].samples;
    defects.flags.resize(samples.size(), 0);
    if (!mask.empty() && mask.size() != samples.size())
      throw MismatchError("the mask of defects has another size than " + frame.path);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!std::isfinite(samples[i]))
        mark(defects.flags, i, kNotFinitePhotosite, defects.not_finite);
      if (!mask.empty() && mask[i] != 0.0f)
        mark(defects.flags, i, kMaskedPhotosite, defects.masked);
    }
  }
}

}  // namespace truebox
