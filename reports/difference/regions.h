// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "difference/difference_map.h"
#include "radiometry/estimate.h"

namespace truebox {

/// Pixels that belong together: a surface, a patch.
struct Region {
  std::string name;
  std::vector<std::size_t> pixels;
};

/// One region for each number in an ID image (one channel, whole numbers; 0 is no region), by
/// rising number; those without a name are called "region 7". Throws MismatchError if the image
/// has other than one channel, another size, or anything but whole numbers from 0 to 65535.
std::vector<Region> regions_from_ids(const Image& ids, const std::map<int, std::string>& names,
                                     int width, int height);

/// The pixels where a mask of one channel is not 0. Throws MismatchError as above, or if it is
/// empty.
Region region_from_mask(std::string name, const Image& mask, int width, int height);

/// A region's means in one channel, over the pixels that count and are finite.
struct RegionDifference {
  std::string region;
  std::string channel;
  double wavelength_nm = -1.0;
  std::size_t pixels = 0;
  std::size_t not_finite = 0;
  double test_mean = 0.0;
  double reference_mean = 0.0;
  Estimate difference;       ///< of the means, with its standard uncertainty (0 if none is known)
  double relative = 0.0;     ///< difference / reference_mean; NaN where that is 0
  double rms = 0.0;          ///< of the pixels
  double en = 0.0;           ///< difference / (2 u); NaN where no uncertainty is known
  double chi_squared = 0.0;  ///< sum of z^2 over the pixels; NaN likewise
};

/// Every region in every channel. The uncertainty of a mean: what is independent from pixel to
/// pixel averages out; the test's bound and the calibration, which pixels share, do not:
/// u^2 = sum(u_i^2) / n^2 + (mean bound part)^2 + (calibration_relative reference_mean)^2.
std::vector<RegionDifference> region_differences(const DifferenceMap& map,
                                                 const std::vector<Region>& regions);

}  // namespace truebox
