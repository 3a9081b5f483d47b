// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
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
  std::vector<float> bound_uncertainty;     ///< the part of u that comes from the test's bound
  std::vector<float> degrees_of_freedom;    ///< of u, Welch-Satterthwaite; empty: infinite

  /// z = d / u. A difference without any uncertainty (u = 0, d != 0) is infinitely far away.
  double sigmas(std::size_t pixel) const;

  /// z as far out in a normal distribution as `sigmas` is in Student's; the same without degrees
  /// of freedom.
  double score(std::size_t pixel) const;
};

/// Signed difference of two images of equal size, channel by channel. Positive: the test is
/// brighter.
struct DifferenceMap {
  int width = 0;
  int height = 0;
  std::string unit;  ///< attribute "unit" of the reference, empty if it states none
  std::vector<DifferenceChannel> channels;
  double calibration_relative = 0.0;  ///< as in DifferenceOptions; part of every u
  std::vector<std::uint8_t> mask{};   ///< pixels that count are not 0; empty: all count

  bool has_uncertainty() const;
  bool counts(std::size_t pixel) const { return mask.empty() || mask[pixel] != 0; }
  std::size_t pixel_count() const;  ///< of the pixels that count
};

struct DifferenceOptions {
  std::optional<double> band_nm;                 ///< only the band nearest to this wavelength
  const Image* test_uncertainty = nullptr;       ///< standard uncertainty of each test sample
  const Image* reference_uncertainty = nullptr;  ///< likewise; both: u^2 = u_test^2 + u_reference^2
  const Image* test_error_bound = nullptr;       ///< of each test sample; u = bound / sqrt(3)
  double calibration_relative = 0.0;  ///< u of the scale that all pixels share, over the reference
  double test_samples = 0.0;          ///< independent samples behind each u; 0: very many
  double reference_samples = 0.0;     ///< likewise
  const Image* mask = nullptr;        ///< one channel; pixels where it is 0 are left out
  double wavelength_tolerance_nm = 0.01;  ///< channel names are rounded by their writers
};

/// Compares channels of equal name; spectral bands (S0.400,0nm) by wavelength, whatever the digits.
/// Where both images are spectral only the bands count: their R, G, B are derived for viewers.
/// u^2 = u_test^2 + u_reference^2 + bound^2 / 3 + (calibration_relative reference)^2: the bound is
/// taken as a rectangular distribution (JCGM 100:2008 (GUM), 4.3.7). Few samples make Student's t
/// of d / u (Welch 1947, Biometrika 34; degrees of freedom: GUM, G.4.1).
/// Throws MismatchError on other sizes, bands or channels (saying both) or units, and
/// std::invalid_argument if there are samples below 2 or a negative calibration uncertainty.
DifferenceMap difference_map(const Image& test, const Image& reference,
                             const DifferenceOptions& options = {});

/// The map as an image to be written: "<name>" the difference, "<name>.z" in sigmas if known.
Image to_image(const DifferenceMap& map);

}  // namespace truebox
