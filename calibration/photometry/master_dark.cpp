// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/master_dark.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "photometry/noise_model.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr double kPriorFrames = 4.0;

}  // namespace

MasterDark mean_dark(const std::vector<Frame>& frames) {
  if (frames.empty()) throw std::invalid_argument("a master dark needs at least one frame");
  MasterDark dark;
  dark.exposure_s = frames[0].exposure_s;
  dark.width = frames[0].image.width;
  dark.height = frames[0].image.height;
  const std::size_t n = frames[0].image.pixel_count();
  const double count = static_cast<double>(frames.size());
  std::vector<double> sum(n, 0.0), squares(n, 0.0);
  for (const Frame& frame : frames) {
    if (frame.image.width != dark.width || frame.image.height != dark.height)
      throw MismatchError(frame.path + ": a dark frame of another size");
    for (std::size_t i = 0; i < n; ++i) {
      const double v = frame.image.channels[0].samples[i];
      sum[i] += v;
      squares[i] += v * v;
    }
  }
  double pooled = 0.0, clipped = 0.0, total = 0.0;
  dark.mean_dn.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double mean = sum[i] / count;
    dark.mean_dn[i] = static_cast<float>(mean);
    total += mean;
    if (count > 1.0) pooled += (squares[i] - count * mean * mean) / (count - 1.0);
    if (squares[i] == 0.0) clipped += 1.0;
  }
  const double pixels = static_cast<double>(n);
  dark.average_dn = total / pixels;
  dark.clipped_fraction = clipped / pixels;
  const double single = std::max(pooled / pixels, kQuantisationVariance_dn2);
  dark.variance_dn2 = single / count;
  dark.frames = frames.size();
  if (frames.size() < 3) return dark;
  dark.pixel_variance_dn2.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double mean = sum[i] / count;
    const double squares_about_mean = std::max(squares[i] - count * mean * mean, 0.0);
    dark.pixel_variance_dn2[i] = static_cast<float>((kPriorFrames * single + squares_about_mean) /
                                                    (kPriorFrames + count - 1.0) / count);
  }
  return dark;
}

const MasterDark* matching_dark(const std::vector<MasterDark>& darks, double exposure_s) {
  for (const MasterDark& dark : darks)
    if (std::abs(dark.exposure_s - exposure_s) <= 0.01 * exposure_s) return &dark;
  return nullptr;
}

MasterDark interpolated_dark(const std::vector<MasterDark>& darks, double exposure_s) {
  const MasterDark *below = nullptr, *above = nullptr;
  for (const MasterDark& dark : darks) {
    if (dark.exposure_s <= exposure_s && (!below || dark.exposure_s > below->exposure_s))
      below = &dark;
    if (dark.exposure_s >= exposure_s && (!above || dark.exposure_s < above->exposure_s))
      above = &dark;
  }
  if (!below || !above)
    throw MismatchError("no dark frames at " + std::to_string(exposure_s) +
                        " s, nor on both sides of it to interpolate between");
  if (below->mean_dn.size() != above->mean_dn.size())
    throw MismatchError("dark frames of two sizes");
  if (below == above) return *below;
  const double share = (exposure_s - below->exposure_s) / (above->exposure_s - below->exposure_s);
  const auto mix = [&](double a, double b) { return (1.0 - share) * a + share * b; };
  const auto mix_variance = [&](double a, double b) {
    return (1.0 - share) * (1.0 - share) * a + share * share * b;
  };
  MasterDark dark = *below;
  dark.exposure_s = exposure_s;
  dark.variance_dn2 = mix_variance(below->variance_dn2, above->variance_dn2);
  dark.average_dn = mix(below->average_dn, above->average_dn);
  dark.clipped_fraction = std::max(below->clipped_fraction, above->clipped_fraction);
  dark.frames = std::min(below->frames, above->frames);
  dark.pixel_variance_dn2.resize(dark.mean_dn.size());
  for (std::size_t i = 0; i < dark.mean_dn.size(); ++i) {
    dark.mean_dn[i] = static_cast<float>(mix(below->mean_dn[i], above->mean_dn[i]));
    dark.pixel_variance_dn2[i] =
        static_cast<float>(mix_variance(below->variance_at(i), above->variance_at(i)));
  }
  return dark;
}

}  // namespace truebox
