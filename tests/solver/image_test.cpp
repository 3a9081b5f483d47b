// SPDX-License-Identifier: BSD-3-Clause
#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>

#include "image/channel_map.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

template <class Error>
std::string message(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was refused";
}

Image ramp(int width, int height, const std::vector<std::string>& names) {
  Image image(width, height);
  float next = 0.25f;
  for (const auto& name : names)
    for (float& v : image.add_channel(name).samples) v = next += 0.5f;
  return image;
}

std::vector<std::string> names_of(const Image& image) {
  std::vector<std::string> names;
  for (const auto& c : image.channels) names.push_back(c.name);
  return names;
}

TEST(ExrFile, KeepsNanInfAndUnits) {
  Image image = ramp(3, 2, {"S0.500,000000nm"});
  auto& samples = image.channels[0].samples;
  samples[1] = std::numeric_limits<float>::quiet_NaN();
  samples[2] = std::numeric_limits<float>::infinity();
  samples[3] = -std::numeric_limits<float>::infinity();
  samples[4] = 3e38f;  // beyond a half
  image.attributes = {{"unit", "W m^-2 sr^-1 nm^-1"}, {"whiteLuminance", "683"}};
  write_exr(scratch_path("nan.exr"), image);
  const Image back = read_image(scratch_path("nan.exr"));
  EXPECT_TRUE(std::isnan(back.channels[0].samples[1]));
  EXPECT_EQ(back.channels[0].samples[2], samples[2]);
  EXPECT_EQ(back.channels[0].samples[3], samples[3]);
  EXPECT_EQ(back.channels[0].samples[4], samples[4]);
  EXPECT_EQ(back.attributes, image.attributes);
}

// The typed attributes that other programs look for, not only our own text.
TEST(ExrFile, WritesChromaticitiesAndWhiteLuminanceAsTheStandardSays) {
  Image image = ramp(2, 2, {"S0.450,000000nm", "S0.550,000000nm", "S0.650,000000nm"});
  add_display_channels(
      image, WavelengthGrid::from_centres({450.0, 550.0, 650.0}),
      read_observer(std::string(TRUEBOX_REFERENCE_DIR) + "/colour/cie1931_2deg_xyz.csv",
                    "CIE 1931 2 deg"));
  write_exr(scratch_path("typed.exr"), image);
  Imf::MultiPartInputFile file(scratch_path("typed.exr").c_str());
  EXPECT_EQ(Imf::whiteLuminance(file.header(0)), 683.0f);
  EXPECT_NEAR(Imf::chromaticities(file.header(0)).white.x, 0.3127f, 1e-4f);
  EXPECT_EQ(file.header(0).channels().findChannel("S0.550,000000nm")->type, Imf::FLOAT);
  EXPECT_EQ(read_image(scratch_path("typed.exr")).attributes.at("spectralLayoutVersion"), "1.0");
}

std::vector<half> halves(std::size_t count, float first) {
  std::vector<half> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = half(first + static_cast<float>(i));
  return values;
}

Imf::FrameBuffer half_buffer(const char* channel, std::vector<half>& values, int width) {
  Imf::FrameBuffer buffer;
  buffer.insert(channel, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(values.data()), sizeof(half),
                                    sizeof(half) * static_cast<std::size_t>(width)));
  return buffer;
}

void write_parts(const std::string& path, int second_width) {
  std::vector<Imf::Header> headers;
  for (int p = 0; p < 2; ++p) {
    Imf::Header header(4, 2);
    if (p == 1) header.dataWindow().max.x = second_width - 1;
    header.setName(p == 0 ? "beauty" : "denoised");
    header.setType(Imf::SCANLINEIMAGE);
    header.channels().insert("G", Imf::Channel(Imf::HALF));
    headers.push_back(header);
  }
  Imf::MultiPartOutputFile file(path.c_str(), headers.data(), 2);
  for (int p = 0; p < 2; ++p) {
    const int width = p == 0 ? 4 : second_width;
    auto values = halves(static_cast<std::size_t>(2 * width), p == 0 ? 1.0f : 101.0f);
    Imf::OutputPart part(file, p);
    part.setFrameBuffer(half_buffer("G", values, width));
    part.writePixels(2);
  }
}

TEST(ExrFile, ReadsHalvesOfEveryPart) {
  write_parts(scratch_path("parts.exr"), 4);
  const Image image = read_image(scratch_path("parts.exr"));
  EXPECT_THAT(names_of(image), ElementsAre("G", "denoised.G"));
  EXPECT_THAT(image.channels[0].samples, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(image.channels[1].samples, ElementsAre(101, 102, 103, 104, 105, 106, 107, 108));
}

TEST(ExrFile, RefusesPartsThatAreNoOneImage) {
  write_parts(scratch_path("sizes.exr"), 6);
  EXPECT_THAT(message<InputError>([] { read_image(scratch_path("sizes.exr")); }),
              HasSubstr("parts of one size and place, found part \"denoised\""));
}

// Two pixels in one row, the second without samples; `planes` are the first one's samples.
void write_deep(const std::string& path, std::map<std::string, std::vector<half>> planes) {
  Imf::Header header(2, 1);
  header.setType(Imf::DEEPSCANLINE);
  header.compression() = Imf::ZIPS_COMPRESSION;
  Imf::DeepFrameBuffer buffer;
  std::vector<unsigned> counts = {static_cast<unsigned>(planes.begin()->second.size()), 0};
  buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()),
                                           sizeof(unsigned), 2 * sizeof(unsigned)));
  std::map<std::string, std::vector<half*>> pointers;
  for (auto& [name, samples] : planes) {
    header.channels().insert(name, Imf::Channel(Imf::HALF));
    std::vector<half*>& at = pointers[name] = {samples.data(), nullptr};
    buffer.insert(name, Imf::DeepSlice(Imf::HALF, reinterpret_cast<char*>(at.data()), sizeof(half*),
                                       2 * sizeof(half*), sizeof(half)));
  }
  Imf::DeepScanLineOutputFile file(path.c_str(), header);
  file.setFrameBuffer(buffer);
  file.writePixels(1);
}

std::vector<half> as_halves(std::initializer_list<float> values) {
  return {values.begin(), values.end()};
}

TEST(ExrFile, SeesDeepSamplesAsNearOnesHideThoseBehind) {
  write_deep(scratch_path("deep.exr"), {{"S0.550,000000nm", as_halves({8, 1, 4})},
                                        {"A", as_halves({1, 0.25, 0.5})},
                                        {"Z", as_halves({3, 1, 2})}});
  const Image image = read_image(scratch_path("deep.exr"));
  ASSERT_THAT(names_of(image), ElementsAre("A", "S0.550,000000nm", "Z"));
  // Nearest first: 1, then 4 through 0.75, then 8 through 0.375.
  EXPECT_THAT(image.channels[1].samples, ElementsAre(7, 0));
  EXPECT_THAT(image.channels[0].samples, ElementsAre(1, 0));
  EXPECT_THAT(image.channels[2].samples, ElementsAre(1, 0));
  // Without opacity the nearest hides all others.
  write_deep(scratch_path("deep.exr"), {{"G", as_halves({8, 1, 4})}, {"Z", as_halves({3, 1, 2})}});
  EXPECT_THAT(read_image(scratch_path("deep.exr")).channels[0].samples, ElementsAre(1, 0));
}

TEST(ExrFile, RefusesDeepSamplesWhoseOrderIsNotKnown) {
  write_deep(scratch_path("deep.exr"), {{"G", as_halves({1})}});
  EXPECT_THAT(message<InputError>([] { read_image(scratch_path("deep.exr")); }),
              HasSubstr("depth, channel Z"));
  write_deep(scratch_path("deep.exr"),
             {{"G", as_halves({1, 2})}, {"Z", as_halves({1, 2})}, {"ZBack", as_halves({3, 2})}});
  EXPECT_THAT(message<InputError>([] { read_image(scratch_path("deep.exr")); }),
              HasSubstr("do not overlap"));
}

TEST(SpectralChannel, IsReadInEveryNamingInUse) {
  for (const auto& [name, nm] : std::vector<std::pair<const char*, double>>{
           {"S0.400,000000nm", 400.0},  // reference implementation
           {"S0.374,688nm", 374.688},   // pbrt-v4
           {"S0.400.5nm", 400.5},
           {"S0.4,0e2nm", 400.0},
           {"S0.0,55um", 550.0},
           {"S0.500THz", 599.584916}})
    EXPECT_NEAR(spectral_channel_wavelength_nm(name), nm, 1e-6) << name;
  for (const char* name : {"S0.R", "T.450,0nm", "S1.450nm", "S0.nm", "S0.4,0,0nm", "S0.450", "R",
                           "S0.-450nm", "S0.450xm", "S0."})
    EXPECT_LT(spectral_channel_wavelength_nm(name), 0.0) << name;
  EXPECT_EQ(spectral_channel_wavelength_nm(spectral_channel_name(374.6875)), 374.6875);
}

TEST(ChannelMap, RenamesScalesAndLeavesOut) {
  const Image image = ramp(2, 1, {"Image.R", "Image.G", "Z"});
  const Image mapped = map_channels(image, "R=Image.R, S0.550nm=Image.G*-2.5e1");
  EXPECT_THAT(names_of(mapped), ElementsAre("R", "S0.550,000000nm"));
  EXPECT_EQ(mapped.channels[0].samples, image.channels[0].samples);
  EXPECT_EQ(mapped.channels[1].samples[1], -25.0f * image.channels[1].samples[1]);
}

TEST(ChannelMap, MapsWavelengthsByPattern) {
  const Image image = ramp(1, 1, {"band_400_000nm", "band_452_500nm", "band_x_nm", "W"});
  const Image mapped = map_channels(image, "S0.{nm}nm=band_{nm}nm*2");
  EXPECT_THAT(names_of(mapped), ElementsAre("S0.400,000000nm", "S0.452,500000nm"));
  EXPECT_EQ(mapped.channels[1].samples[0], 2.0f * image.channels[1].samples[0]);
  const Image commas = ramp(1, 1, {"S0.400,000nm"});  // a decimal comma ends no entry
  EXPECT_THAT(names_of(map_channels(commas, "G=S0.400,000nm, R=S0.400,000nm")),
              ElementsAre("G", "R"));
}

TEST(ChannelMap, SaysWhatIsWrong) {
  const Image image = ramp(1, 1, {"R", "G"});
  for (const char* map :
       {"", "R", "R=", "=R", "R=R*", "R=R*two", "R=R*inf", "S0.{nm}nm=R", "R=R,R=G", "R=R,,G=G"})
    EXPECT_THAT(message<InputError>([&] { map_channels(image, map); }), HasSubstr("channel map"))
        << map;
  EXPECT_THAT(message<MismatchError>([&] { map_channels(image, "B=B"); }),
              HasSubstr("no channel \"B\"; it has R, G"));
}

std::string radiance_picture(const std::string& header, const std::string& pixels) {
  const std::string path = scratch_path("picture.hdr");
  std::ofstream(path, std::ios::binary) << "#?RADIANCE\n" << header << "\n" << pixels;
  return path;
}

// (m + 1/2) 2^(e - 136): the middle of the step that a mantissa stands for.
TEST(RadiancePicture, IsReadInRunsAndPlain) {
  const std::string plain("\x80\x40\x20\x81\x01\x02\x03\x00", 8);
  const Image flat = read_image(radiance_picture(
      "FORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE=0.25\n", "-Y 1 +X 2\n" + plain));
  EXPECT_THAT(names_of(flat), ElementsAre("R", "G", "B"));
  EXPECT_FLOAT_EQ(flat.channels[0].samples[0], 2.0f * 128.5f / 128.0f);
  EXPECT_FLOAT_EQ(flat.channels[1].samples[0], 2.0f * 64.5f / 128.0f);
  EXPECT_EQ(flat.channels[2].samples[1], 0.0f);  // exponent 0 is black
  // 8 px: R a run of 8, G 3 plain and a run of 5, B a run, E a run of 136 (factor 1).
  const std::string runs("\x02\x02\x00\x08\x88\x05\x03\x01\x02\x03\x85\x09\x88\x00\x88\x88", 16);
  const Image run = read_image(radiance_picture("", "-Y 1 +X 8\n" + runs));
  EXPECT_THAT(run.channels[0].samples, testing::Each(5.5f));
  EXPECT_THAT(run.channels[1].samples, ElementsAre(1.5f, 2.5f, 3.5f, 9.5f, 9.5f, 9.5f, 9.5f, 9.5f));
  for (std::size_t kept = 0; kept < runs.size(); ++kept)
    EXPECT_THROW(read_image(radiance_picture("", "-Y 1 +X 8\n" + runs.substr(0, kept))), InputError)
        << kept;
  for (const char* resolution : {"+Y 1 +X 8\n", "-Y 0 +X 8\n", "-Y 99999999 +X 99999999\n", "\n"})
    EXPECT_THROW(read_image(radiance_picture("", resolution + runs)), InputError) << resolution;
  EXPECT_THROW(read_image(radiance_picture("FORMAT=32-bit_rle_xyze\n", "-Y 1 +X 8\n" + runs)),
               InputError);
}

}  // namespace
}  // namespace truebox
