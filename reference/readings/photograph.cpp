// SPDX-License-Identifier: BSD-3-Clause
#include "readings/photograph.h"

#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox {

Frame read_frame(const std::filesystem::path& path, double exposure_s) {
  Frame frame{.path = path.string(), .exposure_s = exposure_s, .image = read_image(path)};
  if (frame.image.channels.size() != 1)
    throw InputError(frame.path, 0, "a raw frame of one channel",
                     std::to_string(frame.image.channels.size()) + " channels");
  return frame;
}

std::vector<Frame> read_frame_channels(const std::filesystem::path& path, double exposure_s) {
  Image image = read_image(path);
  std::vector<Frame> frames;
  for (Channel& channel : image.channels) {
    if (channel.name == "A") continue;
    Frame frame{.path = path.string(), .exposure_s = exposure_s, .image = {}};
    frame.image.width = image.width;
    frame.image.height = image.height;
    frame.image.attributes = image.attributes;
    frame.image.channels.push_back(std::move(channel));
    frames.push_back(std::move(frame));
  }
  if (frames.empty()) throw InputError(path.string(), 0, "a photograph", "an alpha channel alone");
  return frames;
}

Image to_image(const Photograph& photograph) {
  Image image(photograph.width, photograph.height);
  image.add_channel("value").samples = photograph.value;
  image.add_channel("variance").samples = photograph.variance;
  auto& exposures = image.add_channel("exposures").samples;
  exposures.assign(photograph.exposures_used.begin(), photograph.exposures_used.end());
  image.attributes = {{"unit:value", "DN s^-1"}, {"unit:variance", "DN^2 s^-2"},
                      {"unit:exposures", "1"},   {"bayer", photograph.bayer.name()},
                      {"band", photograph.band}, {"source", photograph.provenance.source}};
  return image;
}

}  // namespace truebox
