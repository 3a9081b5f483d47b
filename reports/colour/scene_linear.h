// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "image/image.h"
#include "radiometry/observer.h"

namespace truebox {

/// Channels R, G, B in linear BT.709 (D65), and in words where they come from.
struct SceneLinear {
  Image rgb;
  std::string origin;  ///< "7 bands 400 to 700 nm, CIE 1931 2 deg"
};

/// The colours of an image, by the first rule that fits; nothing if none does:
/// - two spectral bands or more: XYZ of `observer`, bands as wide as their spacing, no adaptation,
///   then the matrix to BT.709 (which is that of the 1931 observer: with another one, white may
///   have a tinge);
/// - R, G, B: as they are, or decoded if they are sRGB display values (attribute "transfer");
/// - a single channel: grey.
/// Throws std::invalid_argument if there are bands and `observer` is null.
std::optional<SceneLinear> scene_linear(const Image& image, const Observer* observer);

}  // namespace truebox
