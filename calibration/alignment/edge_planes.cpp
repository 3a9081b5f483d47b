// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/edge_planes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace truebox {
namespace {

double srgb_to_linear(double v) {  // IEC 61966-2-1:1999, 5.2
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

double white_of(const Image& image) {
  const auto white = image.attributes.find("white_dn");
  const double value = white == image.attributes.end() ? 1.0 : std::atof(white->second.c_str());
  return value > 0.0 ? value : 1.0;
}

bool is_coded(const Image& image) {
  const auto transfer = image.attributes.find("transfer");
  return transfer != image.attributes.end() && transfer->second == "sRGB";
}

void scale_to_one(std::vector<std::vector<float>>& planes) {
  std::vector<float> sorted;
  for (const auto& plane : planes) sorted.insert(sorted.end(), plane.begin(), plane.end());
  if (sorted.empty()) return;
  const auto top = sorted.begin() + static_cast<std::ptrdiff_t>(0.999 * double(sorted.size() - 1));
  std::nth_element(sorted.begin(), top, sorted.end());
  if (!(*top > 0.0f)) return;
  const float factor = 1.0f / *top;
  for (auto& plane : planes)
    for (float& v : plane) v *= factor;
}

}  // namespace

std::vector<float> linear_light(const Image& image, const Channel& channel) {
  const bool coded = is_coded(image);
  const double white = white_of(image);
  std::vector<float> plane(channel.samples.size());
  for (std::size_t i = 0; i < plane.size(); ++i) {
    const double v = channel.samples[i];
    plane[i] = !std::isfinite(v) ? 0.0f
               : coded           ? static_cast<float>(srgb_to_linear(v / white))
                                 : static_cast<float>(v);
  }
  plane.resize(image.pixel_count());
  return plane;
}

double saturation_of(const Image& image) {
  const auto white = image.attributes.find("white_dn");
  return white == image.attributes.end() ? std::numeric_limits<double>::infinity()
                                         : std::atof(white->second.c_str());
}

std::vector<float> reduced(const std::vector<float>& plane, int width, int height, int n) {
  if (n == 1) return plane;
  const int w = width / n, h = height / n;
  std::vector<float> small;
  small.reserve(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      double sum = 0.0;
      for (int dy = 0; dy < n; ++dy)
        for (int dx = 0; dx < n; ++dx)
          sum += plane[static_cast<std::size_t>(y * n + dy) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(x * n + dx)];
      small.push_back(static_cast<float>(sum / (n * n)));
    }
  return small;
}

EdgePlanes edge_planes(const Image& photograph, int most_px) {
  EdgePlanes planes;
  while (std::max(photograph.width, photograph.height) > most_px * planes.reduction)
    ++planes.reduction;
  planes.width = photograph.width / planes.reduction;
  planes.height = photograph.height / planes.reduction;
  const auto add = [&](const std::vector<float>& plane) {
    planes.linear.push_back(reduced(plane, photograph.width, photograph.height, planes.reduction));
  };
  if (photograph.find("R") && photograph.find("G") && photograph.find("B")) {
    for (const char* name : {"R", "G", "B"}) add(linear_light(photograph, *photograph.find(name)));
  } else {
    std::vector<float> mean(photograph.pixel_count(), 0.0f);
    for (const Channel& channel : photograph.channels) {
      const auto plane = linear_light(photograph, channel);
      for (std::size_t i = 0; i < mean.size(); ++i)
        mean[i] += plane[i] / static_cast<float>(photograph.channels.size());
    }
    add(mean);
  }
  scale_to_one(planes.linear);
  for (const auto& plane : planes.linear) {
    planes.guide.push_back(plane);
    for (float& v : planes.guide.back()) v = std::sqrt(std::clamp(v, 0.0f, 1.5f));
  }
  return planes;
}

}  // namespace truebox
