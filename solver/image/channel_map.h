// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "image/image.h"

namespace truebox {

/// The channels of another program's image under the names used here; all others are left out.
/// A map is "NAME=CHANNEL[*FACTOR], ..."; `{nm}` on both sides stands for the wavelength in a
/// channel's name, whose decimal sign may be ',', '.' or '_':
///   "R=Image.Red, G=Image.Green, B=Image.Blue"
///   "S0.{nm}nm=band_{nm}nm"                    Mitsuba's film as `truebox export` writes it
///   "S0.650nm=R*0.01, S0.550nm=G*0.01"         three colours that carry bands, in another unit
/// Throws InputError for a map that does not read so, MismatchError (saying which channels there
/// are) where the image has no such channel.
Image map_channels(const Image& image, const std::string& map);

}  // namespace truebox
