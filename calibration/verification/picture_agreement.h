// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "image/image.h"

namespace truebox {

/// A picture and what is known of its errors, all of one size with bands matched by wavelength.
/// A null image means that there is none of that kind.
struct UncertainPicture {
  const Image* radiance = nullptr;
  const Image* standard_error = nullptr;  ///< k = 1
  const Image* error_bound = nullptr;     ///< not noise: what a pixel can be off by
  int degrees = 0;                        ///< of freedom of the standard error; 0: very many
};

/// How two pictures agree, of which at least one is noisy. Each pixel and band is a test of
/// "they differ by no more than their bounds": p is the chance that noise alone gives
/// |difference| - bounds this large, by Student's distribution with Welch & Satterthwaite's
/// degrees.
struct PictureAgreement {
  Image p_values;  ///< channels as the reference's; 1 where neither picture has noise nor light
  std::size_t tests = 0;
  double smallest_p = 1.0;
  double family_wise_p = 1.0;  ///< of the smallest among all tests (Sidak)
  // Without the bounds, as normal scores of (test - reference) / its standard error: N(0, 1) if
  // nothing but noise is between them.
  double mean_score = 0.0;
  double rms_score = 0.0;
  double rms_bound =
      0.0;  ///< of bounds / standard errors: errors this large spread to hypot(1, that)
  double share_beyond_3 = 0.0;  ///< 0.27 % of a normal distribution
  /// Sum of all differences of a band over its standard error, the band where it is largest, and
  /// that sum over the reference's. What skewed noise of single pixels does to `mean_score` (a
  /// bright path raises mean and variance alike) it does not do here.
  double bias_score = 0.0;
  double bias = 0.0;
};

/// `block_px` > 1 first averages squares of that many pixels, which tells small differences in
/// common from noise. MismatchError if sizes or bands do not fit.
PictureAgreement picture_agreement(const UncertainPicture& test, const UncertainPicture& reference,
                                   int block_px = 1);

}  // namespace truebox
