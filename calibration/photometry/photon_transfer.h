// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "photometry/exposure_blocks.h"
#include "photometry/noise_model.h"
#include "radiometry/estimate.h"
#include "readings/photograph.h"

namespace truebox {

/// What two frames of one still scene say about noise in one block of photosites of one colour:
///   d = x_b - r x_a,   r = mean(x_b) / mean(x_a),   variance = sum d^2 / (n - 1)
/// x: linearised signals, DN. Texture, shading, lamp and exposure times cancel in d, whatever the
/// ratio of the exposures; equal exposures (r = 1) are the usual photon transfer. Its expectation:
///   floor_weight * floor + gain_weight * gain
///   floor_weight = 1 / s_b^2 + r^2 / s_a^2,   gain_weight = x_b / s_b^2 + r^2 x_a / s_a^2
/// with the slopes s of the response, which turn the variance of readings into that of signals.
struct PairSample {
  std::size_t band = 0;       ///< index given by the caller
  char site = 'Y';            ///< 'R', 'G', 'B'; 'Y' without a mosaic
  bool shares_frame = false;  ///< the block's previous pair used one of these frames too
  double mean_dn = 0.0;       ///< signal of the brighter frame
  double variance_dn2 = 0.0, floor_weight = 2.0, gain_weight = 0.0;
  std::size_t dof = 0;
};

/// Samples of all pairs of neighbouring exposures. Blocks are left out where a photosite in or near
/// them is saturated (`block_usable`), below the floor, or where fewer than 12 remain. Throws
/// MismatchError on frames of different sizes.
std::vector<PairSample> pair_samples(const std::vector<Frame>& frames, std::size_t band,
                                     const BlockOptions& options);

/// variance(reading) = floor + gain signal, fitted to samples, and how well it holds.
struct PhotonTransfer {
  bool found = false;  ///< false: fewer than 20 samples, or signals too alike to part the two
  std::string why_not;
  NoiseModel model;
  double floor_u_dn2 = 0.0, gain_u_dn = 0.0, correlation = 0.0;
  double chi2_per_dof = 0.0;  ///< mean of measured over predicted variance, outliers left out
  double dispersion = 0.0;    ///< their scatter over that of chi^2: 1 if noise is all there is
  std::size_t samples = 0, outliers = 0;

  /// sqrt(floor - quantisation variance), with its uncertainty; 0 where the floor is all rounding.
  Estimate read_noise_dn(double step_dn) const;
};

/// Weighted least squares of gamma-distributed variances (weight dof / (2 V^2), iterated).
/// Samples whose variance exceeds the prediction by 3.3 of the scatter of the bulk
/// (Wilson-Hilferty) are left out as moving or misregistered edges, and counted. Uncertainties are
/// enlarged by the square root of the dispersion and, where pairs share frames, by up to sqrt(3/2)
/// (the variance of a chain of successive differences; von Neumann 1941).
PhotonTransfer fit_photon_transfer(const std::vector<PairSample>& samples);

/// Measured over predicted variance of samples that the model has not seen.
struct NoiseCheck {
  double chi2_per_dof = 0.0;
  double u = 0.0;  ///< standard uncertainty of chi2_per_dof, from the samples' own scatter
  std::size_t samples = 0, outliers = 0;
};
NoiseCheck check_noise(const NoiseModel& model, const std::vector<PairSample>& samples);

}  // namespace truebox
