// SPDX-License-Identifier: BSD-3-Clause
// Parts of an OpenEXR file that hold many samples a pixel. Internal to this folder.
#pragma once

#include <filesystem>
#include <vector>

#include "image/image.h"

namespace truebox::codecs {

/// What a camera would see of the samples of each pixel of part `index`: those nearer hide those
/// behind as much as their opacity says (channel A, or all of them where there is none), and
/// colours count as they stand, multiplied by it already. Z becomes the nearest sample's; pixels
/// without samples are 0. One plane a channel, in the header's order. InputError for tiles, for
/// samples without Z, and for volumes that overlap in depth. Source: Hillman (2012), The Theory of
/// OpenEXR Deep Samples.
std::vector<std::vector<float>> read_flattened(const std::filesystem::path& path, int index);

}  // namespace truebox::codecs
