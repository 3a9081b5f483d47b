// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "image/image.h"

namespace truebox {

/// How a bounded image agrees with an independent noisy one, all bands and pixels whose standard
/// error is positive.
struct RenderAgreement {
  std::size_t samples = 0;
  std::size_t outside = 0;  ///< |difference| > bound + 3 standard errors
  double mean_z = 0.0;      ///< of difference / standard error
  double rms_z = 0.0;
  double mean_bound = 0.0;  ///< mean bound / mean radiance
  double bias = 0.0;        ///< (sum of values / sum of reference) - 1

  double share_outside() const {
    return samples ? static_cast<double>(outside) / static_cast<double>(samples) : 1.0;
  }
};

/// The spectral channels of `reference` found by wavelength in a finer-banded image; the others are
/// dropped. MismatchError if one is missing.
Image matching_bands(const Image& image, const Image& reference);

/// Bands are matched by wavelength (0.01 nm), all three images have one size.
/// MismatchError otherwise.
RenderAgreement render_agreement(const Image& radiance, const Image& error_bound,
                                 const Image& reference, const Image& standard_error);

}  // namespace truebox
