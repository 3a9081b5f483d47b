// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "prediction_options.h"

namespace truebox::app {

/// So many lamp-weighted bands instead of the scene's, and what that does to colours.
struct BandChoice {
  std::size_t bands = 0;      ///< 0: the scene's own
  double largest_dE00 = 0.0;  ///< of an element against all of the scene's bands
  double mean_dE00 = 0.0;     ///< by area
  double processor_s = 0.0;   ///< of the solve
};

/// What fewer bands cost and save, found on a small mesh: the colour of each element's radiosity
/// (CIE 1931, white: the lamps' light at the brightest element's luminance) with 4 to 48
/// lamp-weighted bands against the colour with the scene's own. Rough to fine, the scene's own
/// last. Only counts below the scene's own are tried; empty for a scene without a tabulated lamp.
std::vector<BandChoice> band_choices(const Scene& scene, const PredictionArguments& arguments);

}  // namespace truebox::app
