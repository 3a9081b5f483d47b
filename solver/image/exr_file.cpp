// SPDX-License-Identifier: BSD-3-Clause
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <set>
#include <stdexcept>

#include "image/codecs.h"
#include "image/deep_exr.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

// How the file is laid out, not what it shows; a file written from the image has its own.
const std::set<std::string> kStructural = {"name", "type", "view"};

std::string number(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
  return text;
}

Imf::Slice float_slice(const float* samples, const Imath::Box2i& window, int width) {
  const std::ptrdiff_t offset = window.min.x + static_cast<std::ptrdiff_t>(window.min.y) * width;
  char* base = reinterpret_cast<char*>(const_cast<float*>(samples) - offset);
  return Imf::Slice(Imf::FLOAT, base, sizeof(float),
                    sizeof(float) * static_cast<std::size_t>(width));
}

}  // namespace

namespace {

bool is_deep(const Imf::Header& header) {
  return header.hasType() && Imf::isDeepData(header.type());
}

void require_one_picture(const std::filesystem::path& path, const Imf::MultiPartInputFile& file) {
  for (int p = 0; p < file.parts(); ++p) {
    const Imf::Header& header = file.header(p);
    const std::string name = header.hasName() ? "part \"" + header.name() + "\"" : "the image";
    if (header.dataWindow() != file.header(0).dataWindow())
      throw InputError(path.string(), 0, "parts of one size and place", name + " has another");
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
      if (it.channel().xSampling != 1 || it.channel().ySampling != 1)
        throw InputError(path.string(), 0, "channels at full resolution",
                         std::string("subsampled channel ") + it.name());
  }
}

// Text, and the two attributes of other types that say what numbers mean.
void read_attributes(const Imf::Header& header, Image& image) {
  for (auto it = header.begin(); it != header.end(); ++it)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
      if (!kStructural.contains(it.name())) image.attributes[it.name()] = text->value();
  if (Imf::hasWhiteLuminance(header))
    image.attributes["whiteLuminance"] = number(Imf::whiteLuminance(header));
}

}  // namespace

Image codecs::read_exr(const std::filesystem::path& path) try {
  Imf::MultiPartInputFile file(path.c_str(), 1);
  require_one_picture(path, file);
  const Imath::Box2i window = file.header(0).dataWindow();
  std::size_t count = 0;
  for (int p = 0; p < file.parts(); ++p)
    for (auto it = file.header(p).channels().begin(); it != file.header(p).channels().end(); ++it)
      ++count;
  require_believable_size(path, std::int64_t{window.max.x} - window.min.x + 1,
                          std::int64_t{window.max.y} - window.min.y + 1,
                          static_cast<std::int64_t>(count));
  Image image(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1);
  image.channels.reserve(count);
  for (int p = 0; p < file.parts(); ++p) {
    const Imf::Header& header = file.header(p);
    const auto add_channel = [&](const char* name) -> Channel& {
      return image.add_channel(p == 0 ? name : header.name() + "." + name);
    };
    if (is_deep(header)) {
      auto planes = read_flattened(path, p);
      auto plane = planes.begin();
      for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
        add_channel(it.name()).samples = std::move(*plane++);
      continue;
    }
    Imf::InputPart part(file, p);
    Imf::FrameBuffer buffer;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
      Channel& channel = add_channel(it.name());
      buffer.insert(it.name(), float_slice(channel.samples.data(), window, image.width));
    }
    part.setFrameBuffer(buffer);
    part.readPixels(window.min.y, window.max.y);
  }
  read_attributes(file.header(0), image);
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
      if (name == "whiteLuminance")
        Imf::addWhiteLuminance(header, std::strtof(value.c_str(), nullptr));
      else
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
