// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "image/codecs.h"
#include "radiometry/input_error.h"

namespace truebox {

void codecs::require_believable_size(const std::filesystem::path& path, std::int64_t width,
                                     std::int64_t height, std::int64_t samples_per_pixel) {
  // Deflate, the densest of the formats' codings but for runs of one value, makes at most 1032
  // bytes of one; what no file of this size can hold is refused before memory is asked for. The
  // constant leaves room for small pictures of one colour.
  constexpr double kDensest = 1100.0, kSmall = 16e6;
  const auto declared = std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
                        std::to_string(samples_per_pixel) + " samples";
  if (width < 1 || height < 1 || samples_per_pixel < 1)
    throw InputError(path.string(), 0, "an image with at least one pixel and channel", declared);
  constexpr auto kMostPixels = static_cast<std::int64_t>(kMaxPixels);
  constexpr auto kMostSamples = static_cast<std::int64_t>(kMaxSamples);
  if (width > kMostPixels / height || samples_per_pixel > kMostSamples / (width * height))
    throw InputError(path.string(), 0, "an image of at most 2^28 pixels and 2^31 samples",
                     declared);
  std::error_code none;
  const auto bytes = std::filesystem::file_size(path, none);
  const double samples = static_cast<double>(width * height * samples_per_pixel);
  if (!none && samples > kDensest * static_cast<double>(bytes) + kSmall)
    throw InputError(path.string(), 0, "a complete image",
                     declared + " declared in a file of " + std::to_string(bytes) + " bytes");
}

}  // namespace truebox
