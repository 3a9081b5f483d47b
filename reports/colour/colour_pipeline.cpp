// SPDX-License-Identifier: BSD-3-Clause
#include "colour/colour_pipeline.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "radiometry/input_error.h"

namespace ocio = OCIO_NAMESPACE;

namespace truebox {
namespace embedded {
extern const char* const kOcioConfig;
}

namespace {

// Half an 8-bit step: less than this outside [0, 1] rounds to the edge and loses nothing.
constexpr float kClampTolerance = 0.5f / 255.0f;
constexpr std::uint8_t kNotFiniteColour[3] = {255, 0, 255};

ocio::ConstConfigRcPtr load_config(std::string& name) {
  const char* path = std::getenv("OCIO");
  if (path == nullptr || *path == '\0') {
    name = "built-in config 'truebox'";
    std::istringstream text(embedded::kOcioConfig);
    return ocio::Config::CreateFromStream(text);
  }
  name = fmt::format("config {} ($OCIO)", path);
  try {
    auto config = ocio::Config::CreateFromFile(path);
    config->validate();
    return config;
  } catch (const ocio::Exception& error) {
    throw InputError(path, 0, "an OpenColorIO config of profile version 2.1 or older ($OCIO)",
                     error.what());
  }
}

/// The config's name for scene-linear BT.709: the usual ones first, then the role.
std::string source_space(const ocio::Config& config) {
  for (const char* name : {"lin_rec709_scene", "lin_rec709", "Linear Rec.709 (sRGB)",
                           "Utility - Linear - sRGB", "lin_srgb", "Linear"})
    if (config.getColorSpace(name)) return config.getColorSpace(name)->getName();
  if (const auto space = config.getColorSpace(ocio::ROLE_SCENE_LINEAR)) return space->getName();
  throw InputError("$OCIO", 0, "a colour space for linear BT.709, or the role scene_linear",
                   "a config with neither");
}

}  // namespace

struct ColourPipeline::State {
  ocio::ConstCPUProcessorRcPtr processor;
  std::string description;
};

namespace {

/// The default, or the name asked for if the config has it.
std::string chosen(const std::string& config, const char* what, const std::string& name,
                   const std::string& fallback, const std::vector<std::string>& known) {
  if (name.empty()) return fallback;
  if (std::find(known.begin(), known.end(), name) != known.end()) return name;
  throw InputError(config, 0, fmt::format("one of the {}s {}", what, fmt::join(known, ", ")),
                   fmt::format("\"{}\"", name));
}

}  // namespace

ColourPipeline::ColourPipeline(const ViewChoice& choice) : state_(std::make_unique<State>()) {
  std::string name;
  const auto config = load_config(name);
  const std::string source = source_space(*config);
  std::vector<std::string> displays, views;
  for (int i = 0; i < config->getNumDisplays(); ++i) displays.push_back(config->getDisplay(i));
  const std::string display =
      chosen(name, "display", choice.display, config->getDefaultDisplay(), displays);
  for (int i = 0; i < config->getNumViews(display.c_str()); ++i)
    views.push_back(config->getView(display.c_str(), i));
  const std::string view =
      chosen(name, "view", choice.view, config->getDefaultView(display.c_str()), views);
  try {
    state_->processor = config
                            ->getProcessor(source.c_str(), display.c_str(), view.c_str(),
                                           ocio::TRANSFORM_DIR_FORWARD)
                            ->getDefaultCPUProcessor();
  } catch (const ocio::Exception& error) {
    throw InputError(name, 0, fmt::format("a transform from {} to {} / {}", source, display, view),
                     error.what());
  }
  state_->description =
      fmt::format("{}, {} to display {}, view {}, white D65", name, source, display, view);
}
ColourPipeline::~ColourPipeline() = default;
ColourPipeline::ColourPipeline(ColourPipeline&&) noexcept = default;
ColourPipeline& ColourPipeline::operator=(ColourPipeline&&) noexcept = default;

const std::string& ColourPipeline::description() const { return state_->description; }

namespace {

/// Clamps one pixel to 8 bit and keeps count of what that changed.
void quantise(const float* display, bool finite, std::size_t pixel, DisplayPicture& picture) {
  std::uint8_t* out = &picture.rgb[3 * pixel];
  if (!finite) {
    ++picture.not_finite_pixels;
    picture.flags[pixel] = kNotFinite;
    std::copy_n(kNotFiniteColour, 3, out);
    return;
  }
  bool clipped = false, out_of_gamut = false;
  for (int c = 0; c < 3; ++c) {
    clipped = clipped || display[c] > 1.0f + kClampTolerance;
    out_of_gamut = out_of_gamut || display[c] < -kClampTolerance;
    out[c] = static_cast<std::uint8_t>(std::lround(std::clamp(display[c], 0.0f, 1.0f) * 255.0f));
  }
  picture.flags[pixel] =
      static_cast<std::uint8_t>((clipped ? kClipped : 0) | (out_of_gamut ? kOutOfGamut : 0));
  picture.clipped_pixels += clipped;
  picture.out_of_gamut_pixels += out_of_gamut;
}

DisplayPicture convert(const ocio::CPUProcessor& processor, const std::string& description,
                       int width, int height, std::span<const float> const (&planes)[3],
                       double exposure) {
  if (!(exposure > 0.0 && std::isfinite(exposure)))
    throw std::invalid_argument("the exposure must be a positive number");
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  DisplayPicture picture;
  picture.width = width;
  picture.height = height;
  picture.exposure = exposure;
  picture.rgb.resize(3 * pixels);
  picture.flags.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    float value[3];
    bool finite = true;
    for (int c = 0; c < 3; ++c) {
      finite = finite && std::isfinite(planes[c][i]);
      value[c] = finite ? static_cast<float>(exposure * planes[c][i]) : 0.0f;
    }
    processor.applyRGB(value);
    quantise(value, finite, i, picture);
  }
  const auto percent = [&](std::size_t n) {
    return 100.0 * static_cast<double>(n) / static_cast<double>(std::max<std::size_t>(1, pixels));
  };
  picture.note = fmt::format(
      "exposure {:.3g} (white = {:.3g}); {:.2g} % clipped, {:.2g} % out of gamut", exposure,
      1.0 / exposure, percent(picture.clipped_pixels), percent(picture.out_of_gamut_pixels));
  if (picture.not_finite_pixels > 0)
    picture.note += fmt::format(", {} pixels not finite (magenta)", picture.not_finite_pixels);
  picture.description = fmt::format(
      "{}, exposure {:.4g} (display white = {:.4g}), {} of {} pixels clipped, {} out of gamut, "
      "{} not finite",
      description, exposure, 1.0 / exposure, picture.clipped_pixels, pixels,
      picture.out_of_gamut_pixels, picture.not_finite_pixels);
  return picture;
}

}  // namespace

DisplayPicture ColourPipeline::picture(const Image& image, double exposure) const {
  std::span<const float> planes[3];
  const char* names[] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    const Channel* channel = image.find(names[c]);
    if (channel == nullptr)
      throw MismatchError(
          fmt::format("a colour picture needs R, G and B; {} is missing", names[c]));
    planes[c] = channel->samples;
  }
  return convert(*state_->processor, state_->description, image.width, image.height, planes,
                 exposure);
}

DisplayPicture ColourPipeline::grey_picture(int width, int height, std::span<const float> plane,
                                            double exposure) const {
  if (plane.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("the plane has other than width x height samples");
  const std::span<const float> planes[3] = {plane, plane, plane};
  return convert(*state_->processor, state_->description, width, height, planes, exposure);
}

std::vector<std::uint8_t> flagged_picture(const DisplayPicture& picture) {
  constexpr std::uint8_t kColours[5][3] = {
      {0, 0, 0}, {230, 60, 40}, {60, 110, 230}, {150, 60, 200}, {255, 0, 255}};
  std::vector<std::uint8_t> rgb(picture.rgb.size());
  for (std::size_t i = 0; i < picture.flags.size(); ++i) {
    const std::uint8_t* from = &picture.rgb[3 * i];
    const auto grey = static_cast<std::uint8_t>((from[0] + 2 * from[1] + from[2]) / 8);
    for (std::size_t c = 0; c < 3; ++c)
      rgb[3 * i + c] = picture.flags[i] == 0 ? grey : kColours[picture.flags[i]][c];
  }
  return rgb;
}

double exposure_for_quantile(std::span<const float> values, double quantile) {
  std::vector<float> lit;
  for (float v : values)
    if (std::isfinite(v) && v > 0.0f) lit.push_back(v);
  if (lit.empty()) return 1.0;
  const auto rank = static_cast<std::size_t>(std::clamp(quantile, 0.0, 1.0) *
                                             static_cast<double>(lit.size() - 1));
  const auto at = lit.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(lit.begin(), at, lit.end());
  return 1.0 / *at;
}

}  // namespace truebox
