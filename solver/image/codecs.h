// SPDX-License-Identifier: BSD-3-Clause
// The readers behind read_image, one library a file. Internal to this folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "image/image.h"

namespace truebox::codecs {

Image read_exr(const std::filesystem::path& path);
Image read_hdr(const std::filesystem::path& path);
Image read_jpeg(const std::filesystem::path& path);
Image read_png(const std::filesystem::path& path);
Image read_tiff(const std::filesystem::path& path);

/// A camera's RAW file: by its ending, or a TIFF that names a DNG version.
bool is_raw(const std::filesystem::path& path);
Image read_raw(const std::filesystem::path& path);

/// 16-bit samples, `planes` interleaved.
std::vector<std::uint8_t> encode_png16(int width, int height, int planes,
                                       const std::vector<std::uint16_t>& samples,
                                       const std::string& description);
void write_tiff16(const std::filesystem::path& path, int width, int height, int planes,
                  const std::vector<std::uint16_t>& samples, const std::string& description);

/// A header may lie: larger images are refused before memory is asked for.
inline constexpr std::size_t kMaxPixels = std::size_t{1} << 28;
inline constexpr std::size_t kMaxSamples = std::size_t{1} << 31;

/// Throws InputError where there are no pixels, more than these limits, or more than a file of that
/// length can hold however it is compressed.
void require_believable_size(const std::filesystem::path& path, std::int64_t width,
                             std::int64_t height, std::int64_t samples_per_pixel);

}  // namespace truebox::codecs
