// SPDX-License-Identifier: BSD-3-Clause
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <unistd.h>

#include <stdexcept>

#include "image/codecs.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

Imf::Slice float_slice(const float* samples, const Imath::Box2i& window, int width) {
  const std::ptrdiff_t offset = window.min.x + static_cast<std::ptrdiff_t>(window.min.y) * width;
  char* base = reinterpret_cast<char*>(const_cast<float*>(samples) - offset);
  return Imf::Slice(Imf::FLOAT, base, sizeof(float),
                    sizeof(float) * static_cast<std::size_t>(width));
}

}  // namespace

Image codecs::read_exr(const std::filesystem::path& path) try {
  Imf::InputFile file(path.c_str(), 1);
  const Imath::Box2i window = file.header().dataWindow();
  const Imf::ChannelList& list = file.header().channels();
  std::size_t count = 0;
  for (auto it = list.begin(); it != list.end(); ++it, ++count)
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1)
      throw InputError(path.string(), 0, "channels at full resolution",
                       std::string("subsampled channel ") + it.name());
  require_believable_size(path, std::int64_t{window.max.x} - window.min.x + 1,
                          std::int64_t{window.max.y} - window.min.y + 1,
                          static_cast<std::int64_t>(count));
  Image image(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1);
  for (auto it = list.begin(); it != list.end(); ++it) image.add_channel(it.name());
  Imf::FrameBuffer buffer;
  for (auto& channel : image.channels)
    buffer.insert(channel.name, float_slice(channel.samples.data(), window, image.width));
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  for (auto it = file.header().begin(); it != file.header().end(); ++it)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
      image.attributes[it.name()] = text->value();
  return image;
} catch (const InputError&) {
  throw;
} catch (const std::exception& error) {
  throw InputError(path.string(), 0, "a complete OpenEXR image", error.what());
}

void write_exr(const std::filesystem::path& path, const Image& image) {
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
  auto temporary = path;
  temporary += ".part" + std::to_string(::getpid());
  try {
    Imf::Header header(image.width, image.height);
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::addChromaticities(header, Imf::Chromaticities());  // BT.709 primaries, D65
    for (const auto& [name, value] : image.attributes)
      header.insert(name, Imf::StringAttribute(value));
    Imf::FrameBuffer buffer;
    for (const auto& channel : image.channels) {
      header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
      buffer.insert(channel.name,
                    float_slice(channel.samples.data(), header.dataWindow(), image.width));
    }
    {
      Imf::OutputFile file(temporary.c_str(), header, 2);
      file.setFrameBuffer(buffer);
      file.writePixels(image.height);
    }
    std::filesystem::rename(temporary, path);
  } catch (const std::exception& error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw std::runtime_error("cannot write " + path.string() + ": " + error.what());
  }
}

}  // namespace truebox
