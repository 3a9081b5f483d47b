// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "photometry/camera_response.h"
#include "photometry/master_dark.h"
#include "photometry/noise_model.h"
#include "readings/photograph.h"

namespace truebox {

struct MergeOptions {
  double saturation_dn = 255.0;
  double floor_dn = 0.0;
  NoiseModel noise;
  std::map<char, NoiseModel> noise_of_site{};  ///< by colour of photosite, in place of `noise`
  CameraResponse response;
  std::vector<std::uint8_t> linearity_mask;  ///< photosites that judge linearity; empty: all
};

/// A linear photograph and how well its exposures agree.
struct MergeResult {
  Photograph photograph;
  double chi2_per_dof = 0.0;  ///< of the exposures about the merged rate, photosites pooled
  std::size_t dof = 0;
  std::vector<double> exposures_s;
  std::vector<double>
      mean_ratio;  ///< reading over merged rate, a mean for each exposure; 0: unused
  std::vector<float>
      effective_s;  ///< sum w / sum (w / t): an offset o in DN is o / this in the rate
};

/// The rate r (DN s^-1) of every photosite from exposures t_i with linearised readings x_i:
///   r = sum w_i x_i / t_i / sum w_i,   w_i = t_i^2 / var(x_i),   var(r) = 1 / sum w_i
/// minimum variance among unbiased linear estimates. var(x_i) holds noise at the expected reading
/// (not the noisy one) and the dark's; frames that share a dark share its error. Source: Granados
/// et al. (2010), CVPR, eq. 4-6; Robertson, Borman, Stevenson (2003), J. Electron. Imaging 12(2).
/// A reading counts where the rate that the others give puts it between floor and saturation with
/// three sigma to spare, so that noise does not decide which readings are kept. A photosite
/// saturated in every exposure gets an infinite variance; one below the floor in every exposure
/// keeps its longest reading, its variance enlarged to that of +-1 DN.
/// Throws MismatchError on frames of other sizes, std::invalid_argument on none.
MergeResult merge_exposures(const std::vector<Frame>& frames, const std::vector<MasterDark>& darks,
                            const BayerPattern& bayer, const MergeOptions& options);

}  // namespace truebox
