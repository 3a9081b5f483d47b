// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "photometry/camera_response.h"
#include "readings/photograph.h"

namespace truebox {

enum class ResponseMethod { debevec, robertson };

/// The signal that each of the 256 readings of a tone-mapped file stands for, in units that make
/// readings 112 to 144 mean themselves in the geometric mean (exposure series fix the curve up to a
/// scale).
struct ResponseCurve {
  bool found = false;
  std::string why_not;
  std::vector<Estimate> signal_dn;        ///< 256, rising; u: pixel sets and frames, see below
  double largest_repair = 0.0;            ///< relative change that making the curve rise took
  std::size_t lowest = 0, highest = 255;  ///< known to 30 % and told apart; beyond, u is infinite
};

/// Recovers the curve from frames of one still scene (8 bit, at least two exposures), made rising
/// by pooling adjacent violators. Its uncertainty: scatter over `resamplings` sets of pixels drawn
/// anew (bootstrap), and over the frames left out in turn (jackknife; it sees wrong exposure times
/// and what does not hold still). Frames left out need three exposures; with two, u is the
/// bootstrap's alone. The same seed gives the same curve.
/// Throws MismatchError on frames of other sizes.
/// Sources: Debevec, Malik (1997), SIGGRAPH; Robertson, Borman, Stevenson (2003), J. Electron.
/// Imaging 12(2); Efron, Tibshirani (1993), An Introduction to the Bootstrap, ch. 6 and 11.
ResponseCurve recover_response(const std::vector<Frame>& frames, ResponseMethod method,
                               std::uint64_t seed = 1, int resamplings = 16);

/// The curve as a camera's response: signals of readings outside of [lowest, highest] are the
/// curve's, but a merge should leave them out (`floor_dn`, `saturation_dn`).
CameraResponse to_camera_response(const ResponseCurve& curve);

}  // namespace truebox
