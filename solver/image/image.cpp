// SPDX-License-Identifier: BSD-3-Clause
#include "image/image.h"

#include <utility>

namespace truebox {

Channel& Image::add_channel(std::string name, float value) {
  channels.push_back({std::move(name), std::vector<float>(pixel_count(), value)});
  return channels.back();
}

const Channel* Image::find(const std::string& name) const {
  for (const auto& channel : channels)
    if (channel.name == name) return &channel;
  return nullptr;
}

}  // namespace truebox
