// SPDX-License-Identifier: BSD-3-Clause
// From files to linear photographs: simulated cameras whose truth is known, and extremes.
#include "photometry/photometric_calibration.h"

#include <gmock/gmock.h>

#include <fstream>

#include "calibration/simulated_frames.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "readings/chart.h"
#include "support/dng.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 96, kHeight = 64;
constexpr double kGain_dn = 0.25, kReadNoise_dn = 1.2, kBlack_dn = 40.0;

std::string save(const std::string& name, const Frame& frame) {
  const std::string path = scratch_path(name);
  write_counts(path, frame.image, "simulated");
  return name;
}

std::string measurement(const std::string& name, const std::string& instrument,
                        const std::string& rest) {
  const std::string path = scratch_path(name);
  std::ofstream(path) << "title = \"simulated\"\nsource = \"this test\"\n[instrument]\n"
                      << instrument << rest;
  return path;
}

const std::string kInstrument = "bits = 12\nbayer = \"rggb\"\nsaturation_dn = 4000\nfloor_dn = 0\n";

std::string files_text(const std::vector<std::string>& names) {
  std::string text = "[";
  for (const auto& name : names) text += "\"" + name + "\", ";
  return text + "]\n";
}

double vignetting(int x, int y) {
  const double dx = x + 0.5 - 0.5 * kWidth, dy = y + 0.5 - 0.5 * kHeight;
  const double r2 = 4.0 * (dx * dx + dy * dy) / (kWidth * kWidth + kHeight * kHeight);
  return 1.0 / ((1.0 + 0.15 * r2) * (1.0 + 0.15 * r2));
}

double central_vignetting() {
  double sum = 0.0, n = 0.0;
  for (int y = kHeight / 4; y < 3 * kHeight / 4; ++y)
    for (int x = kWidth / 4; x < 3 * kWidth / 4; ++x, n += 1.0) sum += vignetting(x, y);
  return sum / n;
}

/// A camera with a black level, a vignetting lens, veiling glare and three bad photosites.
struct SimulatedCamera {
  std::vector<double> scene, seen, flat;  // electrons a second: truth, with glare and lens; flat
  std::vector<std::string> photographs, darks, flats;
  static constexpr std::size_t kHot = 1000, kDead = 2000, kStuck = 3001;
  static constexpr double kGlare = 30.0;  // electrons a second
  static constexpr int kTrap = 12;        // px: the dark corner

  explicit SimulatedCamera(unsigned seed) {
    std::mt19937_64 random(seed);
    scene = textured_scene(kWidth, kHeight, 4000.0, seed);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto i = static_cast<std::size_t>(y * kWidth + x);
        if (x < kTrap && y < kTrap) scene[i] = 0.0;
        seen.push_back((scene[i] + kGlare) * vignetting(x, y));
        flat.push_back(20000.0 * vignetting(x, y));
      }
    const SimulatedSensor sensor{.gain_dn = kGain_dn,
                                 .read_noise_dn = kReadNoise_dn,
                                 .black_dn = kBlack_dn,
                                 .top_dn = 4095.0};
    const std::vector<double> nothing(seen.size(), 0.0);
    const std::string tag = std::to_string(seed) + "_";
    for (const auto& [t, name] :
         std::vector<std::pair<double, std::string>>{{0.2, "a"}, {1.0, "b"}, {3.0, "c"}}) {
      photographs.push_back(save(tag + "photo_" + name + ".tif",
                                 spoilt(simulated_frame(seen, kWidth, t, sensor, random))));
    }
    for (int k = 0; k < 8; ++k)
      darks.push_back(save(tag + "dark_" + std::to_string(k) + ".tif",
                           spoilt(simulated_frame(nothing, kWidth, 1.0, sensor, random))));
    for (int k = 0; k < 4; ++k)
      flats.push_back(save(tag + "flat_" + std::to_string(k) + ".tif",
                           spoilt(simulated_frame(flat, kWidth, 0.5, sensor, random))));
  }

  static Frame spoilt(Frame frame) {
    auto& y = frame.image.channels[0].samples;
    y[kHot] = std::min(y[kHot] + 300.0f, 4095.0f);
    y[kDead] = std::round(static_cast<float>(kBlack_dn));
    y[kStuck] = 777.0f;
    return frame;
  }

  std::string text(const std::string& flat_model, const std::string& rest = "") const {
    std::string t;
    for (const char* exposure : {"0.2", "0.5", "1.0", "3.0"})
      t += std::string("[[dark]]\nexposure_s = ") + exposure + "\nfiles = " + files_text(darks);
    t += "[flat]\nexposure_s = 0.5\nuncertainty = 0.001\nmodel = \"" + flat_model +
         "\"\nfiles = " + files_text(flats);
    t += rest + "[[bands]]\nname = \"white\"\nphotographs = [\n";
    const char* exposures[] = {"0.2", "1.0", "3.0"};
    for (int k = 0; k < 3; ++k)
      t += "{ file = \"" + photographs[static_cast<std::size_t>(k)] +
           "\", exposure_s = " + exposures[k] + " },\n";
    return t + "]\n";
  }
};

// Truth is known in every photosite: the normalised error's mean square must be that of chi^2 over
// 6000 photosites, 1 +- 0.018, if both parts of the uncertainty are right; the common parts (flat,
// glare, black level) move many photosites together and are no sample of themselves, hence 0.15.
class WholePath : public testing::TestWithParam<std::string> {};

TEST_P(WholePath, ValuesDifferFromTheTruthByTheirUncertainty) {
  const SimulatedCamera camera(17);
  const std::string path = measurement(
      "whole_" + GetParam() + ".toml", kInstrument + "response = \"linear\"\n",
      camera.text(GetParam(), "[glare]\nregion = [0, 0, 12, 12]\nuncertainty = 0.02\n"));
  const PhotometricCalibration calibration = calibrate_photographs(read_measurement(path));
  ASSERT_EQ(calibration.photographs.size(), 1u);
  const LinearPhotograph& p = calibration.photographs[0];
  // Frames are relative to the central quarter's mean, laws to the axis.
  const double unit = GetParam() == "frames" ? central_vignetting() : 1.0;
  double z2 = 0.0, n = 0.0;
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    if (p.flags[i] != 0) continue;
    const double truth = camera.scene[i] * kGain_dn * unit;
    z2 += std::pow((p.value[i] - truth) / std::hypot(p.u_noise[i], p.u_common[i]), 2);
    n += 1.0;
  }
  EXPECT_EQ(n, kWidth * kHeight - 3.0);
  RecordProperty("chi2_per_dof", std::to_string(z2 / n));
  EXPECT_LT(z2 / n, 1.15);
  EXPECT_GT(z2 / n, 0.7);
  EXPECT_EQ(p.flags[SimulatedCamera::kHot], kHotPhotosite);
  EXPECT_TRUE(p.flags[SimulatedCamera::kDead] & kDeadPhotosite);
  EXPECT_TRUE(p.flags[SimulatedCamera::kStuck] & kStuckPhotosite);
  EXPECT_TRUE(std::isinf(p.u_noise[SimulatedCamera::kStuck]));
  EXPECT_NEAR(p.glare.value, SimulatedCamera::kGlare * kGain_dn,
              4.0 * p.glare.standard_uncertainty);
  for (const SiteNoise& noise : calibration.instruments[0].noise) {
    EXPECT_NEAR(noise.model.gain_dn, kGain_dn, 4.0 * noise.transfer.gain_u_dn) << noise.site;
    EXPECT_NEAR(noise.pooled.chi2_per_dof, 1.0, 4.0 * noise.pooled.u + 0.02) << noise.site;
  }
}

INSTANTIATE_TEST_SUITE_P(Flats, WholePath, testing::Values("frames", "polynomial", "cos4"),
                         [](const auto& flat) { return flat.param; });

TEST(PhotometricCalibration, ScalesToALuminanceReading) {
  const SimulatedCamera camera(18);
  const std::string scale =
      "[[scale]]\nregion = [40, 20, 16, 16]\nvalue = 250.0\nuncertainty = 5.0\nunit = \"cd "
      "m^-2\"\n";
  const std::string path =
      measurement("scaled.toml", kInstrument, camera.text("polynomial", scale));
  const PhotometricCalibration calibration = calibrate_photographs(read_measurement(path));
  const LinearPhotograph& p = calibration.photographs[0];
  EXPECT_EQ(p.unit, "cd m^-2");
  double mean = 0.0, n = 0.0;
  for (int y = 20; y < 36; ++y)
    for (int x = 40; x < 56; ++x)
      if (calibration.file.instrument.bayer.site(x, y) == 'G') {
        mean += p.value[static_cast<std::size_t>(y * kWidth + x)];
        n += 1.0;
      }
  EXPECT_NEAR(mean / n, 250.0, 1e-3);  // floats in the file
  EXPECT_NEAR(p.common_budget.of("absolute scale"), 0.02 * p.reference_value,
              0.002 * p.reference_value);  // 5 of 250, and the region's noise
  EXPECT_THAT(budget_text(p), HasSubstr("absolute scale"));
}

/// Mean over the green photosites of a patch, its rim left out.
double patch_mean(const LinearPhotograph& p, const MeasurementFile& file,
                  const std::vector<std::uint8_t>& labels, const std::string& patch) {
  const auto found = std::find(file.chart.patches.begin(), file.chart.patches.end(), patch);
  const auto label = static_cast<std::uint8_t>(found - file.chart.patches.begin() + 1);
  double sum = 0.0, n = 0.0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const int x = static_cast<int>(i) % p.width, y = static_cast<int>(i) / p.width;
    if (labels[i] != label || p.flags[i] != 0 || file.instrument.bayer.site(x, y) != 'G') continue;
    sum += p.value[i];
    n += 1.0;
  }
  return sum / n;
}

// The real chart: someone read one of its greys with a luminance meter.
TEST(PhotometricCalibration, ScalesToAReadingOfOnePatch) {
  MeasurementFile file =
      read_measurement(std::string(TRUEBOX_REFERENCE_DIR) + "/llanos_narrowband/measurement.toml");
  std::erase_if(file.bands, [](const BandFiles& b) { return b.name != "550 nm"; });
  ASSERT_EQ(file.bands.size(), 1u);
  file.instrument.gain_dn = 0.002;  // stated: one band alone does not show it
  file.instrument.read_noise_dn = 0.35;
  const LinearPhotograph plain = calibrate_photographs(file).photographs.at(0);
  file.scales = {{"", {}, "neutral_5", {80.0, 2.0}, "cd m^-2"}};
  const LinearPhotograph scaled = calibrate_photographs(file).photographs.at(0);
  const auto labels = eroded_labels(
      read_chart(file.chart.labels_path, file.chart.reflectance_path, file.chart.patches),
      file.chart.margin_px);
  EXPECT_EQ(scaled.unit, "cd m^-2");
  EXPECT_NEAR(patch_mean(scaled, file, labels, "neutral_5"), 80.0, 1e-3);  // floats in the file
  // Nothing but the unit changes: ratios stay.
  EXPECT_NEAR(
      patch_mean(scaled, file, labels, "white_9.5") / 80.0,
      patch_mean(plain, file, labels, "white_9.5") / patch_mean(plain, file, labels, "neutral_5"),
      1e-5);
  // 2.5 %, common to all photosites, and the noise of the patch's mean.
  const double relative = scaled.common_budget.of("absolute scale") / scaled.reference_value;
  EXPECT_GE(relative, 0.025);
  EXPECT_LT(relative, 0.026);
  for (std::size_t i = 0; i < scaled.value.size(); i += 97)
    if (scaled.flags[i] == 0) {
      EXPECT_GE(scaled.u_common[i], 0.0249 * scaled.value[i]);
    }
}

/// Each photosite its own dark current, electrons a second; one in a hundred is warm.
std::vector<double> dark_currents(std::size_t count) {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<double> currents;
  for (std::size_t i = 0; i < count; ++i)
    currents.push_back(uniform(random) < 0.01 ? 40.0 : 4.0 * uniform(random));
  return currents;
}

// Darks were taken at 1 s and 4 s, the photograph at 2.5 s: between them, photosite by photosite.
TEST(PhotometricCalibration, TakesTheDarkOfAnExposureBetweenTwo) {
  constexpr int kSide = 64;
  const std::vector<double> current = dark_currents(kSide * kSide);
  std::vector<double> scene = textured_scene(kSide, kSide, 500.0, 32), seen;
  for (std::size_t i = 0; i < scene.size(); ++i) seen.push_back(scene[i] + current[i]);
  const SimulatedSensor sensor{
      .gain_dn = kGain_dn, .read_noise_dn = kReadNoise_dn, .black_dn = kBlack_dn, .top_dn = 4095.0};
  std::mt19937_64 random(33);
  std::string darks;
  for (const auto& [t, label] :
       std::vector<std::pair<double, std::string>>{{1.0, "1"}, {4.0, "4"}}) {
    std::vector<std::string> names;
    for (int k = 0; k < 6; ++k)
      names.push_back(save("between_" + label + "_" + std::to_string(k) + ".tif",
                           simulated_frame(current, kSide, t, sensor, random)));
    darks += "[[dark]]\nexposure_s = " + label + "\nfiles = " + files_text(names);
  }
  save("between.tif", simulated_frame(seen, kSide, 2.5, sensor, random));
  const std::string instrument =
      "bits = 12\nbayer = \"none\"\nsaturation_dn = 4000\nresponse = \"linear\"\ngain = 0.25\n"
      "read_noise = 1.2\n";
  const auto photographed_for = [&](const std::string& exposure) {
    return "[[bands]]\nname = \"b\"\nphotographs = [{ file = \"between.tif\", exposure_s = " +
           exposure + " }]\n";
  };
  const auto calibration = calibrate_photographs(
      read_measurement(measurement("between.toml", instrument, darks + photographed_for("2.5"))));
  const LinearPhotograph& p = calibration.photographs[0];
  double z2 = 0.0, bias = 0.0, n = 0.0;
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    if (p.flags[i] != 0) continue;
    const double off = p.value[i] - kGain_dn * scene[i];
    z2 += std::pow(off / std::hypot(p.u_noise[i], p.u_common[i]), 2);
    bias += off;
    n += 1.0;
  }
  // chi^2 over 4000 photosites: 1 +- 0.022; the mean of the errors is known to 0.04 DN s^-1.
  EXPECT_NEAR(z2 / n, 1.0, 0.09);
  EXPECT_NEAR(bias / n, 0.0, 0.15);
  EXPECT_THROW(calibrate_photographs(read_measurement(
                   measurement("beyond.toml", instrument, darks + photographed_for("5")))),
               MismatchError);
}

std::string one_frame(const std::string& name, const std::vector<float>& samples, int width,
                      const std::string& instrument) {
  Image image(width, static_cast<int>(samples.size()) / width);
  image.add_channel("Y").samples = samples;
  write_exr(scratch_path(name + ".exr"), image);
  return measurement(name + ".toml", instrument,
                     "[[bands]]\nname = \"b\"\nphotographs = [{ file = \"" + name +
                         ".exr\", exposure_s = 0.5 }]\n");
}

const std::string kStated =
    "bits = 8\nbayer = \"none\"\nsaturation_dn = 250\ngain = 0.1\nread_noise = 1\n";

LinearPhotograph of_one(const std::string& name, const std::vector<float>& samples, int width,
                        const std::string& instrument = kStated) {
  return calibrate_photographs(read_measurement(one_frame(name, samples, width, instrument)))
      .photographs.at(0);
}

TEST(PhotometricCalibration, TakesOnePixelOfOneExposure) {
  const LinearPhotograph p = of_one("single", {100.0f}, 1);
  EXPECT_FLOAT_EQ(p.value[0], 200.0f);
  // sqrt(1 + 1/12 + 0.1 x 100) / 0.5 s
  EXPECT_NEAR(p.u_noise[0], 2.0 * std::sqrt(11.0 + 1.0 / 12.0), 1e-4);
  EXPECT_EQ(p.flags[0], 0);
}

TEST(PhotometricCalibration, ClaimsNothingOfSaturatedOrUnreadablePixels) {
  const LinearPhotograph p =
      of_one("bad", {250.0f, std::nanf(""), -INFINITY, 10.0f, 0.0f, INFINITY}, 3);
  EXPECT_EQ(p.flags[0], kSaturatedPhotosite);
  for (std::size_t i : {std::size_t{1}, std::size_t{2}, std::size_t{5}}) {
    EXPECT_TRUE(p.flags[i] & kNotFinitePhotosite) << i;
    EXPECT_TRUE(std::isinf(p.u_noise[i])) << i;
  }
  EXPECT_EQ(p.flags[3], 0);
  EXPECT_TRUE(std::isfinite(p.u_noise[4]));
}

TEST(PhotometricCalibration, AllSaturatedAndAllBlackAreResults) {
  const LinearPhotograph white = of_one("white", std::vector<float>(64, 255.0f), 8);
  EXPECT_EQ(white.saturated, 64u);
  EXPECT_EQ(white.noise_budget.contributions().size(), 0u);
  const LinearPhotograph black = of_one("black", std::vector<float>(64, 0.0f), 8);
  EXPECT_EQ(black.saturated, 0u);
  for (float v : black.value) EXPECT_EQ(v, 0.0f);
}

TEST(PhotometricCalibration, GainZeroIsACameraWithoutPhotonNoise) {
  const LinearPhotograph p = of_one("gain0", {100.0f, 200.0f}, 2,
                                    "bits = 8\nbayer = \"none\"\nsaturation_dn = 250\ngain = 0\n"
                                    "read_noise = 1\n");
  EXPECT_FLOAT_EQ(p.u_noise[0], p.u_noise[1]);
}

// A RAW file brings its mosaic and its black level along; a measurement that says otherwise is
// refused.
TEST(PhotometricCalibration, TakesTheBlackLevelOfARawFile) {
  const auto bytes = dng_bytes(32, 24, std::vector<std::uint16_t>(32 * 24, 564), "grbg", 64, 16000);
  std::ofstream(scratch_path("one.dng"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<long>(bytes.size()));
  const std::string band =
      "[[bands]]\nname = \"b\"\nphotographs = [{ file = \"one.dng\", exposure_s = 0.5 }]\n";
  const std::string stated =
      "bits = 14\nsaturation_dn = 15900\ngain = 0.5\nread_noise = 3\nbayer = ";
  const auto calibration =
      calibrate_photographs(read_measurement(measurement("raw.toml", stated + "\"grbg\"\n", band)));
  EXPECT_FLOAT_EQ(calibration.photographs[0].value[100], 1000.0f);
  EXPECT_NEAR(calibration.photographs[0].u_noise[100], 2.0 * std::sqrt(9.0 + 1.0 / 12 + 250.0),
              1e-3);
  EXPECT_THROW(calibrate_photographs(
                   read_measurement(measurement("raw2.toml", stated + "\"rggb\"\n", band))),
               InputError);
}

TEST(PhotometricCalibration, RefusesToInventNoise) {
  const std::string path = one_frame("unknown", std::vector<float>(64, 100.0f), 8,
                                     "bits = 8\nbayer = \"none\"\nsaturation_dn = 250\n");
  try {
    calibrate_photographs(read_measurement(path));
    FAIL() << "noise out of nothing";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("gain and read_noise"));
  }
}

TEST(PhotometricCalibration, RefusesFramesOfOtherSizesAndDarksOfOtherExposures) {
  one_frame("small", std::vector<float>(16, 100.0f), 4, kStated);
  one_frame("large", std::vector<float>(64, 100.0f), 8, kStated);
  const std::string two = measurement(
      "two.toml", kStated,
      "[[bands]]\nname = \"b\"\nphotographs = [{ file = \"small.exr\", exposure_s = 1 }, "
      "{ file = \"large.exr\", exposure_s = 2 }]\n");
  EXPECT_THROW(calibrate_photographs(read_measurement(two)), MismatchError);
  const std::string dark = measurement(
      "dark.toml", kStated,
      "[[dark]]\nexposure_s = 4\nfiles = [\"small.exr\"]\n[[bands]]\nname = \"b\"\nphotographs = "
      "[{ file = \"small.exr\", exposure_s = 1 }]\n");
  EXPECT_THROW(calibrate_photographs(read_measurement(dark)), MismatchError);
  const std::string glare = measurement(
      "glare.toml", kStated,
      "[glare]\nregion = [2, 2, 9, 9]\n[[bands]]\nname = \"b\"\nphotographs = [{ file = "
      "\"small.exr\", exposure_s = 1 }]\n");
  EXPECT_THROW(calibrate_photographs(read_measurement(glare)), InputError);
}

}  // namespace
}  // namespace truebox
