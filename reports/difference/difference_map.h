// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "image/image.h"

namespace truebox {

/// One compared channel: d = test - reference, sample by sample, in the unit of the images.
struct DifferenceChannel {
  std::string name;             ///< as the reference names it
  double wavelength_nm = -1.0;  ///< centre of a spectral band, negative for any other channel
  std::vector<float> difference;
  std::vector<float> reference;
  std::vector<float> standard_uncertainty;  ///< u of d (k = 1); empty where nobody stated one

  /// z = d / u. A difference without any uncertainty (u = 0, d != 0) is infinitely far away.
  double sigmas(std::size_t pixel) const;
};

/// Signed difference of two images of equal size, channel by channel. Positive: the test is
/// brighter.
struct DifferenceMap {
  int width = 0;
  int height = 0;
  std::string unit;  ///< attribute "unit" of the reference, empty if it states none
  std::vector<DifferenceChannel> channels;

  bool has_uncertainty() const;
};

struct DifferenceOptions {
  std::optional<double> band_nm;                 ///< only the band nearest to this wavelength
  const Image* test_uncertainty = nullptr;       ///< standard uncertainty of each test sample
  const Image* reference_uncertainty = nullptr;  ///< likewise; both: u^2 = u_test^2 + u_reference^2
  double wavelength_tolerance_nm = 0.01;         ///< channel names are rounded by their writers
};

/// Compares channels of equal name; spectral bands (S0.400,0nm) by wavelength, whatever the digits.
/// Where both images are spectral only the bands count: their R, G, B are derived for viewers.
/// Throws MismatchError on other sizes, bands or channels (saying both) or units.
DifferenceMap difference_map(const Image& test, const Image& reference,
                             const DifferenceOptions& options = {});

/// The map as an image to be written: "<name>" the difference, "<name>.z" in sigmas if known.
Image to_image(const DifferenceMap& map);

}  // namespace truebox
