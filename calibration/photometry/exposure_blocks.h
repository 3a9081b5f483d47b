// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "photometry/camera_response.h"
#include "photometry/master_dark.h"
#include "readings/photograph.h"

namespace truebox {

/// How still scenes are cut into square blocks of photosites of one colour.
struct BlockOptions {
  double saturation_dn = 255.0;  ///< a block with any reading of any colour at or above is left out
  double floor_dn = 0.0;         ///< a block with a reading below is left out
  int block_px = 16;             ///< even
  CameraResponse response;
  bool mosaic = true;
  BayerPattern bayer;
  std::vector<std::uint8_t> excluded{};  ///< nonzero: photosite not used; empty: all are
  std::vector<std::uint8_t> labels{};    ///< a block must lie in one label, not 0; empty: anywhere
  const std::vector<MasterDark>* darks = nullptr;  ///< subtracted where one matches the exposure

  bool is_excluded(std::size_t i) const { return !excluded.empty() && excluded[i] != 0; }
  const MasterDark* dark_of(const Frame& frame) const {
    return darks ? matching_dark(*darks, frame.exposure_s) : nullptr;
  }
  char site(int x, int y) const { return mosaic ? bayer.site(x, y) : 'Y'; }
  int stride() const { return mosaic ? 2 : 1; }
};

/// The frames, shortest exposure first. Throws MismatchError on frames of different sizes.
std::vector<const Frame*> sorted_by_exposure(const std::vector<Frame>& frames);

/// False where the block at (x, y) leaves its label, or where a photosite in it or within 2 px is
/// saturated or not finite: charge spills over to its neighbours.
bool block_usable(const Frame& frame, int x, int y, const BlockOptions& options);

/// Mean readings of each block and colour over the exposures in which it is in range: what
/// `estimate_response` needs. Blocks with fewer than two exposures are left out.
std::vector<ExposureSeries> block_series(const std::vector<Frame>& frames,
                                         const BlockOptions& options);

}  // namespace truebox
