// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "image/image.h"

namespace truebox {

/// Reads EXR (half, float or integer), PNG (8 or 16 bit), TIFF (8 or 16 bit, float), JPEG (grey or
/// RGB, upright as its Exif says) or Radiance pictures (EXPOSURE divided out), by content. RAW
/// files of cameras (DNG by content, others by their ending) give the photosites of the visible
/// area as they were read, not demosaiced, not scaled, black level not subtracted: one channel "Y",
/// attributes "bayer", "white_level_dn", where the file states them "black_level_dn" (one for all
/// photosites) and "exposure_s". Integer samples keep their digital numbers (DN), nothing is
/// linearised or scaled, NaN and Inf stay; palette PNGs keep their indices.
/// Of an EXR with several parts, the first part's channels keep their names, others are called
/// "<part>.<channel>". InputError: missing, truncated, of another kind; RAW data that is no 2 x 2
/// mosaic; EXR parts that are deep (several samples a pixel) or of different windows, which are no
/// one image.
Image read_image(const std::filesystem::path& path);

/// Writes float32 OpenEXR (ZIP), text attributes included; chromaticities are BT.709's, attribute
/// "whiteLuminance" (a number, cd m^-2 of R = G = B = 1) is written as the standard's own type. The
/// file appears under its final name only when complete. Throws std::runtime_error when the disk
/// refuses.
void write_exr(const std::filesystem::path& path, const Image& image);

/// Writes whole digital numbers (0 to 65535) of one channel or of three as 16-bit grey or RGB, PNG
/// or TIFF by the file's ending, `description` inside it. Complete or not at all, as above.
/// InputError: another ending, another number of channels, a sample that is no such number.
void write_counts(const std::filesystem::path& path, const Image& image,
                  const std::string& description);

/// Encodes an 8-bit RGB image (3 x width x height interleaved bytes) as PNG.
std::vector<std::uint8_t> encode_png_rgb8(int width, int height,
                                          const std::vector<std::uint8_t>& rgb);

/// Writes bytes through a temporary neighbour and a rename, so that no half-written file is left.
void write_file_atomically(const std::filesystem::path& path, const void* bytes, std::size_t size);
void write_file_atomically(const std::filesystem::path& path, const std::string& text);

}  // namespace truebox
