// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "photometry/exposure_blocks.h"
#include "photometry/master_dark.h"
#include "photometry/photosite_flags.h"

namespace truebox {

/// Photosites that do not measure light, as flags (PhotositeFlag), and how many of each kind.
struct DefectMap {
  std::vector<std::uint8_t> flags;  ///< one a photosite; empty: none was looked for
  std::size_t hot = 0, dead = 0, stuck = 0, masked = 0, not_finite = 0;
  double hot_limit_dn = 0.0;  ///< dark readings above it were called hot

  std::size_t total() const;
};

/// Marks photosites whose mean dark reading lies `sigmas` robust standard deviations (median
/// absolute deviation, or the noise of the mean where that is larger) above the median.
void mark_hot(const MasterDark& dark, double sigmas, DefectMap& defects);

/// Marks photosites that answer a flat field (relative response, 1 in the mean of a colour) with
/// under half or over twice the median of their up to 24 neighbours of the same colour.
void mark_dead(const std::vector<float>& relative, const BlockOptions& options, int width,
               int height, DefectMap& defects);

/// Marks photosites that read the same in every frame while the median of their neighbours of the
/// same colour changes by more than ten standard deviations, `sigma_dn` each; saturated readings
/// and those at the floor are no evidence. Needs two exposures.
void mark_stuck(const std::vector<Frame>& frames, const BlockOptions& options, double sigma_dn,
                DefectMap& defects);

/// Marks what is not finite in any frame, and what `mask` excludes (nonzero, or empty for none).
/// Throws MismatchError on a mask of another size.
void mark_unusable(const std::vector<Frame>& frames, const std::vector<float>& mask,
                   DefectMap& defects);

}  // namespace truebox
