// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "image/image.h"
#include "radiometry/observer.h"
#include "radiometry/wavelength_grid.h"

namespace truebox {

/// Channel names of the spectral OpenEXR layout, "S0.400,000000nm" (emissive, unpolarised).
/// Source: Fichet, Pacanowski, Wilkie (2021), JCGT 10(3), section 3.
std::string spectral_channel_name(double wavelength_nm);

/// The wavelength in nm of such a name, whatever its number of digits, its exponent or its unit (m
/// and Hz with prefixes, as the layout allows); a negative number if the name is not a spectral
/// band ("S0.R", "T.450,0nm").
double spectral_channel_wavelength_nm(const std::string& name);

/// The image's spectral channels: indices into `channels`, ordered by wavelength.
struct SpectralChannels {
  std::vector<std::size_t> indices;
  std::vector<double> wavelengths_nm;
};
SpectralChannels spectral_channels(const Image& image);

/// Adds R, G, B (linear BT.709 of the spectral channels) and the attributes that the layout and
/// viewers need: spectralLayoutVersion, emissiveUnits, whiteLuminance (683 cd m^-2: the luminance
/// of R = G = B = 1); chromaticities come with write_exr.
void add_display_channels(Image& image, const WavelengthGrid& grid, const Observer& observer);

}  // namespace truebox
