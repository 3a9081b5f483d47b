// SPDX-License-Identifier: BSD-3-Clause
#include "difference/regions.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "radiometry/input_error.h"
#include "uncertainty/en_score.h"

namespace truebox {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const std::vector<float>& plane_of(const Image& image, int width, int height, const char* what) {
  if (image.width != width || image.height != height)
    throw MismatchError(fmt::format("{} is {} x {} px, the images are {} x {} px", what,
                                    image.width, image.height, width, height));
  if (image.channels.size() != 1)
    throw MismatchError(
        fmt::format("{} must have one channel, it has {}", what, image.channels.size()));
  return image.channels[0].samples;
}

RegionDifference region_difference(const DifferenceMap& map, const DifferenceChannel& channel,
                                   const Region& region) {
  RegionDifference r;
  r.region = region.name;
  r.channel = channel.name;
  r.wavelength_nm = channel.wavelength_nm;
  const bool known = !channel.standard_uncertainty.empty();
  double sum_d = 0, sum_r = 0, sum_square = 0, independent = 0, bound = 0, chi2 = 0;
  for (std::size_t i : region.pixels) {
    if (!map.counts(i)) continue;
    const double d = channel.difference[i], reference = channel.reference[i];
    if (!std::isfinite(d) || !std::isfinite(reference)) {
      ++r.not_finite;
      continue;
    }
    ++r.pixels;
    sum_d += d;
    sum_r += reference;
    sum_square += d * d;
    if (!known) continue;
    const double u = channel.standard_uncertainty[i];
    const double b = channel.bound_uncertainty.empty() ? 0.0 : channel.bound_uncertainty[i];
    const double c = map.calibration_relative * reference;
    independent += std::max(0.0, u * u - b * b - c * c);
    if (std::isnan(u)) independent = kNaN;
    bound += b;
    chi2 += channel.score(i) * channel.score(i);
  }
  const auto n = static_cast<double>(r.pixels);  // 0 / 0 is NaN: nothing was compared
  r.reference_mean = sum_r / n;
  r.test_mean = (sum_r + sum_d) / n;
  r.difference.value = sum_d / n;
  r.relative = sum_r != 0.0 ? sum_d / sum_r : kNaN;
  r.rms = std::sqrt(sum_square / n);
  r.en = r.chi_squared = kNaN;
  if (!known) return r;
  const double calibration = map.calibration_relative * r.reference_mean;
  r.difference.standard_uncertainty =
      std::hypot(std::sqrt(independent) / n, bound / n, calibration);
  r.en = en_score(r.difference, {0.0, 0.0}).value;
  r.chi_squared = chi2;
  return r;
}

}  // namespace

std::vector<Region> regions_from_ids(const Image& ids, const std::map<int, std::string>& names,
                                     int width, int height) {
  std::map<int, Region> found;
  const auto& plane = plane_of(ids, width, height, "the image of regions");
  for (std::size_t i = 0; i < plane.size(); ++i) {
    const float v = plane[i];
    if (!(v >= 0.0f && v <= 65535.0f) || v != std::floor(v))
      throw MismatchError(fmt::format(
          "an image of regions holds whole numbers from 0 to 65535; pixel ({}, {}) is {}",
          i % static_cast<std::size_t>(width), i / static_cast<std::size_t>(width), v));
    if (v > 0.0f) found[static_cast<int>(v)].pixels.push_back(i);
  }
  std::vector<Region> regions;
  for (auto& [id, region] : found) {
    const auto name = names.find(id);
    region.name = name != names.end() ? name->second : fmt::format("region {}", id);
    regions.push_back(std::move(region));
  }
  return regions;
}

Region region_from_mask(std::string name, const Image& mask, int width, int height) {
  Region region{std::move(name), {}};
  const auto& plane = plane_of(mask, width, height, "a mask");
  for (std::size_t i = 0; i < plane.size(); ++i)
    if (plane[i] != 0.0f) region.pixels.push_back(i);
  if (region.pixels.empty())
    throw MismatchError(fmt::format("the mask of {} holds no pixel", region.name));
  return region;
}

std::vector<RegionDifference> region_differences(const DifferenceMap& map,
                                                 const std::vector<Region>& regions) {
  std::vector<RegionDifference> result;
  for (const Region& region : regions)
    for (const DifferenceChannel& channel : map.channels)
      result.push_back(region_difference(map, channel, region));
  return result;
}

}  // namespace truebox
