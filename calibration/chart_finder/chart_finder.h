// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "image/bayer.h"
#include "image/image.h"
#include "radiometry/estimate.h"

namespace truebox {

/// One linear plane in which a chart is looked for and measured.
struct ChartPlane {
  std::string name;             ///< "650 nm" or "R"
  std::vector<float> value;     ///< width x height, linear; NaN and infinite samples are left out
  std::vector<float> u_noise;   ///< standard uncertainty of each sample; empty: not known
  std::vector<float> u_common;  ///< shared by neighbours; empty: not known
};

/// Planes of one size; with a mosaic each photosite keeps its colour, nothing is interpolated.
struct ChartPicture {
  int width = 0, height = 0;
  bool mosaic = false;
  BayerPattern bayer;
  std::vector<ChartPlane> planes;
};

/// Mean over the middle of a patch, of one plane and one colour of photosite.
struct PatchValue {
  std::string plane;
  char site = 'Y';  ///< 'R', 'G', 'B'; 'Y' without a mosaic
  double mean = 0.0;
  double u_noise = 0.0;  ///< of the mean: the samples' own, or their scatter where not known
  double u_common = 0.0;
  double scatter = 0.0;  ///< standard deviation between samples: noise, texture, shading
  std::size_t samples = 0;
};

struct FoundPatch {
  std::string name;                      ///< "dark_skin" ... "black_2", row by row
  std::array<PixelPosition, 4> outline;  ///< of the area that was averaged
  std::vector<PatchValue> values;
};

/// A chart, or the reason why there is none.
struct ChartFinding {
  bool found = false;
  std::string why_not;
  std::array<PixelPosition, 4> corners;  ///< of the field of patches: dark skin's, bluish green's,
                                         ///< black's and white's outer corner, px
  double colour_distance = 0.0;          ///< the detector's: 0 is the chart it knows
  std::vector<FoundPatch> patches;       ///< 24
};

/// The 24 names, row by row from dark skin.
const std::vector<std::string>& colorchecker_patches();

/// Looks for a ColorChecker Classic (24 patches) on an 8-bit copy and measures it on the floats.
/// The copy shows planes 1, 2, 3 as red, green, blue (one plane: grey), each scaled to its 99th
/// percentile, gamma 2.2; a mosaic gives one pixel a 2 x 2 cell. The middle half of each patch, in
/// both directions, is averaged. No chart is an outcome. Throws std::invalid_argument on planes of
/// other sizes or a number of planes other than 1 or 3.
/// Cost: a second for a megapixel. Source: OpenCV 4.6, module mcc (Ptr<CCheckerDetector>).
ChartFinding find_chart(const ChartPicture& picture);

/// The 8-bit copy with the outlines drawn, red: 3 x width x height bytes, and its size.
struct ChartOverlay {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
ChartOverlay chart_overlay(const ChartPicture& picture, const ChartFinding& finding);

}  // namespace truebox
