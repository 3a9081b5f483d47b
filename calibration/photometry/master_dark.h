// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "readings/photograph.h"

namespace truebox {

/// The mean of dark frames of one exposure time, pixel by pixel, DN.
/// `variance_dn2` is that of the mean: the pooled frame-to-frame variance (the pixels of two frames
/// say nothing apart) or the quantisation variance, whichever is larger, over the frames. From
/// three frames on each pixel has its own: its sample variance and the pooled one, the latter with
/// the weight of four frames (an inverse-gamma prior), so that a flickering pixel is known for one.
struct MasterDark {
  double exposure_s = 0.0;
  int width = 0, height = 0;
  std::vector<float> mean_dn;
  double variance_dn2 = 0.0;
  std::vector<float> pixel_variance_dn2;  ///< of the mean, pixel by pixel; empty: not known apart
  std::size_t frames = 0;
  double average_dn = 0.0;
  double clipped_fraction = 0.0;  ///< pixels at 0 in every frame: their true level is not known

  double variance_at(std::size_t pixel) const {
    return pixel_variance_dn2.empty() ? variance_dn2 : double{pixel_variance_dn2[pixel]};
  }
};

/// Throws MismatchError on frames of other sizes, std::invalid_argument on none.
MasterDark mean_dark(const std::vector<Frame>& frames);

/// The dark of the nearest exposure time; nullptr if there is none within 1 %.
const MasterDark* matching_dark(const std::vector<MasterDark>& darks, double exposure_s);

/// The dark at an exposure time between two measured ones, by linear interpolation (dark current
/// grows in proportion to time), its variance with them. MismatchError outside of their range.
MasterDark interpolated_dark(const std::vector<MasterDark>& darks, double exposure_s);

}  // namespace truebox
