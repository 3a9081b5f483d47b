// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"

namespace truebox {

/// Why a pixel is not shown as it is.
enum ColourFlag : std::uint8_t { kClipped = 1, kOutOfGamut = 2, kNotFinite = 4 };

/// Names of an OpenColorIO config; empty: its default.
struct ViewChoice {
  std::string display{};
  std::string view{};
};

/// A picture for a display, 8 bit, and what its making has cost.
struct DisplayPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;        ///< 3 x width x height, interleaved, from the top left
  std::size_t clipped_pixels = 0;       ///< brighter than the display's white in R, G or B
  std::size_t out_of_gamut_pixels = 0;  ///< negative in R, G or B: the display has no such colour
  std::size_t not_finite_pixels = 0;    ///< NaN or Inf, drawn magenta
  std::vector<std::uint8_t> flags;      ///< of each pixel: any of the ColourFlag
  double exposure = 1.0;
  std::string description;  ///< config, spaces, display, view, white, exposure and the counts above
  std::string note;         ///< the exposure and what was clipped, short enough for a caption
};

/// From scene-linear BT.709 (D65) to what a display shows: v = display(exposure * L).
/// The transform is OpenColorIO's: the config named by $OCIO, else the one in this program
/// (config.ocio in this folder: sRGB display, no tone curve). Nothing is tone mapped or balanced.
/// Values are clamped to the display only here, at the last step, and the clamped are counted.
class ColourPipeline {
 public:
  /// Throws InputError if $OCIO names a config that cannot be used, or one without the display or
  /// view asked for.
  explicit ColourPipeline(const ViewChoice& choice = {});
  ~ColourPipeline();
  ColourPipeline(ColourPipeline&&) noexcept;
  ColourPipeline& operator=(ColourPipeline&&) noexcept;

  /// The channels R, G, B of an image; `exposure` is 1 / (the value shown as display white).
  /// Throws MismatchError if a channel is missing, std::invalid_argument if exposure <= 0.
  DisplayPicture picture(const Image& image, double exposure) const;

  /// One plane (a band, a monochrome photograph) as a neutral grey picture.
  DisplayPicture grey_picture(int width, int height, std::span<const float> plane,
                              double exposure) const;

  /// "built-in config 'truebox', lin_rec709_scene to display sRGB, view Standard, white D65".
  const std::string& description() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The same picture darkened to grey, its flagged pixels in colour: red clipped, blue out of gamut,
/// violet both, magenta not finite.
std::vector<std::uint8_t> flagged_picture(const DisplayPicture& picture);

/// The exposure that shows the given quantile of the finite, positive values as display white; 1 if
/// there are none. For pictures of the same thing use one exposure, chosen from the reference.
double exposure_for_quantile(std::span<const float> values, double quantile);

}  // namespace truebox
