// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "photometry/exposure_blocks.h"
#include "photometry/master_dark.h"
#include "photometry/noise_model.h"

namespace truebox {

/// How every photosite answers an even field, relative to the mean of its colour in the central
/// quarter of the frame. Measurements are divided by it.
struct FlatField {
  int width = 0, height = 0;
  std::vector<float> relative;  ///< 1; empty: no flat field
  std::vector<float> u_noise;   ///< relative, photosite by photosite (noise of the flat's frames)
  std::vector<float> u_common;  ///< relative, common to neighbours: the even field, the fitted law
  std::string model = "none";
  std::vector<double> coefficients, coefficients_u;  ///< of the law fitted
  double chi2_per_dof = 0.0;  ///< of the frames about the law; 0 where none was fitted
};

/// The mean of flat frames, dark subtracted, linearised, normalised colour by colour.
/// `uncertainty`: relative, of the even field itself. Throws MismatchError on frames of other
/// sizes; InputError (`what` names the set) if a colour's mean is not above zero or the centre
/// saturates.
FlatField flat_from_frames(const std::vector<Frame>& frames, const MasterDark* dark,
                           const NoiseModel& noise, const BlockOptions& options, double uncertainty,
                           const std::string& what);

/// Fits a law of the distance r to the frame's centre (r = 1 in the corner) to a flat field, each
/// colour with its own scale, and replaces it:
///   polynomial: 1 + a r^2 + b r^4 + c r^6          cos4: (1 + q r^2)^-2, q = (corner / f)^2
/// Weighted least squares; the law's own uncertainty, enlarged where chi^2/nu > 1, becomes part of
/// `u_common`. Photosites flagged in `options.excluded` are not used. A law that does not fit keeps
/// the frames and says so in `model`. Source of cos^4: Smith (2008), Modern Optical Engineering.
FlatField fitted_flat(const FlatField& frames, const std::string& law, const BlockOptions& options);

}  // namespace truebox
