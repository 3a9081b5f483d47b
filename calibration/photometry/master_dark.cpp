// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/master_dark.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "photometry/noise_model.h"
#include "radiometry/input_error.h"

namespace truebox {

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
  dark.variance_dn2 = std::max(pooled / pixels, kQuantisationVariance_dn2) / count;
  return dark;
}

const MasterDark* matching_dark(const std::vector<MasterDark>& darks, double exposure_s) {
  for (const MasterDark& dark : darks)
    if (std::abs(dark.exposure_s - exposure_s) <= 0.01 * exposure_s) return &dark;
  return nullptr;
}

}  // namespace truebox
