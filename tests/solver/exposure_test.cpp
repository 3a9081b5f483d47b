// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/exposure.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "image/image_file.h"
#include "image/spectral_image.h"
#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

constexpr double kPlanck = 6.62607015e-34, kLight = 299792458.0;

TabulatedSpectrum flat(double value) { return TabulatedSpectrum({550.0}, {value}); }

// A uniform current of light on w x h photosites, one channel.
PhotoCurrent uniform_current(int width, int height, double electrons_per_s) {
  return {{"Y"},
          {{width, height,
            std::vector<double>(static_cast<std::size_t>(width * height), electrons_per_s)}}};
}

SensorDescription sensor_of(double exposure_s, double gain_dn, double read_noise_dn, int bits) {
  SensorDescription sensor;
  sensor.channels = {{"Y", flat(0.5)}};
  sensor.exposure_s = exposure_s;
  sensor.gain_dn = gain_dn;
  sensor.read_noise_dn = read_noise_dn;
  sensor.bits = bits;
  return sensor;
}

struct Moments {
  double mean = 0.0, variance = 0.0;
};

Moments moments(const std::vector<float>& samples) {
  const auto n = static_cast<double>(samples.size());
  Moments m;
  for (float v : samples) m.mean += v / n;
  for (float v : samples) m.variance += (v - m.mean) * (v - m.mean) / (n - 1.0);
  return m;
}

// Upper quantile of chi-squared / nu (Wilson, Hilferty 1931), good to a per mille here.
double chi2_per_dof_quantile(double nu, double z) {
  const double a = 2.0 / (9.0 * nu);
  return std::pow(1.0 - a + z * std::sqrt(a), 3.0);
}

// --- noise ---------------------------------------------------------------------------------------

TEST(ReadOut, GivesBackGainAndReadNoiseByPhotonTransfer) {
  // Pairs of frames at 12 levels; half the variance of their difference against their mean, as EMVA
  // 1288 does it. The line's slope is the gain and its intercept read noise^2 + 1/12.
  const double gain = 0.37, read_noise = 2.1, offset = 100.0;
  const int size = 128, levels = 12;
  const double n = size * size;
  double s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  std::vector<double> mean(levels), variance(levels), u(levels);
  for (int k = 0; k < levels; ++k) {
    SensorDescription sensor = sensor_of(1.0, gain, read_noise, 16);
    sensor.offset_dn = offset;
    const PhotoCurrent light = uniform_current(size, size, 40.0 * k * k);
    const SensorImage a = read_out(light, sensor, 2u * static_cast<unsigned>(k) + 1u);
    const SensorImage b = read_out(light, sensor, 2u * static_cast<unsigned>(k) + 2u);
    std::vector<float> difference(static_cast<std::size_t>(n));
    for (std::size_t i = 0; i < difference.size(); ++i) {
      const float p = a.reading.channels[0].samples[i], q = b.reading.channels[0].samples[i];
      difference[i] = p - q;
      mean[k] += (0.5 * (p + q) - offset) / n;
    }
    variance[k] = 0.5 * moments(difference).variance;
    u[k] = variance[k] * std::sqrt(2.0 / (n - 1.0));
    const double w = 1.0 / (u[k] * u[k]);
    s += w, sx += w * mean[k], sy += w * variance[k];
    sxx += w * mean[k] * mean[k], sxy += w * mean[k] * variance[k];
  }
  const double slope = (s * sxy - sx * sy) / (s * sxx - sx * sx);
  const double floor = (sy - slope * sx) / s;
  const double u_slope = std::sqrt(s / (s * sxx - sx * sx));
  const double u_floor = std::sqrt(sxx / (s * sxx - sx * sx));
  double chi2 = 0.0;
  for (int k = 0; k < levels; ++k)
    chi2 += std::pow((variance[k] - floor - slope * mean[k]) / u[k], 2.0);
  // Three tests at a family-wise level of 0.1 %: two-sided z and an upper chi^2 quantile of
  // 0.033 % each (Bonferroni).
  EXPECT_LT(std::abs(slope - gain) / u_slope, 3.59) << slope << " +- " << u_slope;
  EXPECT_LT(std::abs(floor - read_noise * read_noise - 1.0 / 12.0) / u_floor, 3.59)
      << floor << " +- " << u_floor;
  EXPECT_LT(chi2 / (levels - 2.0), chi2_per_dof_quantile(levels - 2.0, 3.40));
}

TEST(ReadOut, SpreadsAsItsVariancePlaneSays) {
  // (reading - expected)^2 / variance over all photosites is chi^2 with one degree each; the few
  // electrons of the darkest are Poisson, whose kurtosis widens chi^2's spread: 2 + 1 / mean.
  const struct {
    double electrons, gain, noise;
    int bits;
  } cases[] = {{3.0, 1.0, 1.0, 16},
               {50.0, 4.0, 0.7, 16},
               {1e4, 0.2, 3.0, 12},
               {1e11, 1e-7, 0.6, 16},
               {200.0, 1.0, 0.0, 0}};
  for (const auto& c : cases) {
    SensorDescription sensor = sensor_of(1.0, c.gain, c.noise, c.bits);
    sensor.offset_dn = 40.0;
    const SensorImage image = read_out(uniform_current(150, 150, c.electrons), sensor, 9);
    const double n = 150.0 * 150.0;
    double chi2 = 0.0, mean = 0.0;
    for (std::size_t i = 0; i < image.reading.pixel_count(); ++i) {
      const double error =
          image.reading.channels[0].samples[i] - image.expected.channels[0].samples[i];
      chi2 += error * error / image.variance.channels[0].samples[i] / n;
      mean += error / n;
    }
    const double spread = std::sqrt((2.0 + 1.0 / c.electrons) / n);
    // Ten tests at a family-wise level of 0.1 %.
    EXPECT_LT(std::abs(chi2 - 1.0) / spread, 3.89) << c.electrons << " electrons";
    const double u_mean = std::sqrt(image.variance.channels[0].samples[0] / n);
    EXPECT_LT(std::abs(mean) / u_mean, 3.89) << c.electrons << " electrons";
    EXPECT_EQ(image.saturated, 0u);
  }
}

TEST(ReadOut, CountsSingleElectronsAsPoissonDid) {
  // 1 DN an electron, nothing else: the readings' frequencies are exp(-m) m^k / k!.
  const double mean = 1.7;
  const SensorImage image =
      read_out(uniform_current(400, 400, mean), sensor_of(1.0, 1.0, 0.0, 8), 3);
  std::vector<double> counts(8);
  for (float v : image.reading.channels[0].samples)
    ++counts[static_cast<std::size_t>(std::min(v, 7.0f))];
  double chi2 = 0.0, tail = 1.0, p = std::exp(-mean);
  const double n = 160000.0;
  for (int k = 0; k < 8; ++k) {
    const double share = k < 7 ? p : tail;
    chi2 += std::pow(counts[static_cast<std::size_t>(k)] - n * share, 2.0) / (n * share);
    tail -= p;
    p *= mean / (k + 1);
  }
  EXPECT_LT(chi2 / 7.0, chi2_per_dof_quantile(7.0, 3.09)) << "level 0.1 %";
}

TEST(ReadOut, RoundsWithAVarianceOfATwelfth) {
  // A noise-free ramp over many codes: the error is uniform on one step.
  PhotoCurrent ramp = uniform_current(1000, 1000, 0.0);
  for (std::size_t i = 0; i < ramp.electrons_per_s[0].values.size(); ++i)
    ramp.electrons_per_s[0].values[i] = 50.0 + 1000.0 * static_cast<double>(i) / 999999.0;
  SensorDescription sensor = sensor_of(1.0, 1.0, 0.0, 16);
  sensor.shot_noise = false;
  const SensorImage image = read_out(ramp, sensor, 1);
  double sum = 0.0;
  for (std::size_t i = 0; i < image.reading.pixel_count(); ++i) {
    const double error =
        image.reading.channels[0].samples[i] - image.expected.channels[0].samples[i];
    EXPECT_LE(std::abs(error), 0.5 + 1e-4) << "float's steps at 1000 are 6e-5";
    sum += error * error;
  }
  EXPECT_NEAR(sum / 1e6, 1.0 / 12.0, 1e-4) << "1000 codes, the ends cut at random places";
}

// The exact variance of round(x) for x ~ N(mean, sigma): a sum over codes.
Moments rounded_normal(double mean, double sigma) {
  Moments m;
  double second = 0.0;
  const auto below = [&](double x) {
    return 0.5 * std::erfc((mean - x) / (sigma * std::sqrt(2.0)));
  };
  for (int k = -20; k <= 20; ++k) {
    const double code = std::round(mean) + k, p = below(code + 0.5) - below(code - 0.5);
    m.mean += p * code;
    second += p * code * code;
  }
  m.variance = second - m.mean * m.mean;
  return m;
}

TEST(ReadOut, QuantisationFormulaFailsWithoutDither) {
  // Half a DN of noise makes sigma^2 + 1/12 true to 3 %; a tenth of a DN does not: at the middle
  // of a code nothing varies, at a code's edge 0.25 DN^2. The readings follow the exact law.
  for (double sigma : {0.1, 0.3, 0.5, 1.0})
    for (double mean : {50.0, 50.3, 50.5}) {
      SensorDescription sensor = sensor_of(1.0, 1.0, sigma, 8);
      sensor.shot_noise = false;
      sensor.offset_dn = mean;
      const SensorImage image = read_out(uniform_current(300, 300, 0.0), sensor, 4);
      const Moments seen = moments(image.reading.channels[0].samples);
      const Moments exact = rounded_normal(mean, sigma);
      const double n = 90000.0, formula = sigma * sigma + 1.0 / 12.0;
      // 24 tests at a family-wise level of 0.1 %; a fourth moment of at most 3 sigma^4 + 1/4.
      EXPECT_LT(std::abs(seen.mean - exact.mean), 4.1 * std::sqrt(exact.variance / n) + 1e-5);
      EXPECT_LT(std::abs(seen.variance - exact.variance),
                4.1 * std::sqrt((3.0 * std::pow(sigma, 4) + 0.25 * exact.variance) / n) + 1e-5);
      if (sigma >= 0.5) {
        EXPECT_NEAR(exact.variance / formula, 1.0, 0.03);
      } else if (sigma < 0.2 && mean != 50.3) {
        EXPECT_GT(std::abs(exact.variance / formula - 1.0), 0.9) << "the formula's failure";
      }
    }
}

TEST(ReadOut, DependsOnTheSeedAndOnNothingElse) {
  const PhotoCurrent light = uniform_current(67, 41, 900.0);
  const SensorDescription sensor = sensor_of(1.0, 0.5, 1.5, 12);
  std::vector<float> first;
  for (std::size_t threads : {1u, 2u, 7u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto image = read_out(light, sensor, 42);
    if (first.empty()) first = image.reading.channels[0].samples;
    EXPECT_EQ(image.reading.channels[0].samples, first) << threads << " threads";
  }
  EXPECT_NE(read_out(light, sensor, 43).reading.channels[0].samples, first);
  // Neighbours and seeds are independent: correlation of n pairs has a spread of n^-1/2.
  const auto other = read_out(light, sensor, 43).reading.channels[0].samples;
  const Moments a = moments(first), b = moments(other);
  double seeds = 0.0, neighbours = 0.0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    seeds += (first[i] - a.mean) * (other[i] - b.mean);
    if (i > 0) neighbours += (first[i] - a.mean) * (first[i - 1] - a.mean);
  }
  const double n = static_cast<double>(first.size());
  EXPECT_LT(std::abs(seeds) / std::sqrt(n * a.variance * b.variance), 3.5) << "level 0.05 %";
  EXPECT_LT(std::abs(neighbours) / (std::sqrt(n) * a.variance), 3.5);
}

// --- clipping ------------------------------------------------------------------------------------

TEST(ReadOut, FlagsSaturationAndNeverClipsSilently) {
  PhotoCurrent light = uniform_current(6, 1, 0.0);
  light.electrons_per_s[0].values = {0.0, 100.0, 254.4, 254.6, 400.0, 1e12};
  SensorDescription sensor = sensor_of(1.0, 1.0, 0.0, 8);
  sensor.shot_noise = false;
  SensorImage image = read_out(light, sensor, 1);
  EXPECT_EQ(image.reading.channels[0].samples,
            (std::vector<float>{0.0f, 100.0f, 254.0f, 255.0f, 255.0f, 255.0f}));
  EXPECT_EQ(image.clipped.channels[0].samples,
            (std::vector<float>{0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f}))
      << "the top code may hide anything above it";
  EXPECT_EQ(image.expected.channels[0].samples[4], 400.0f) << "the truth is not clipped";
  EXPECT_EQ(image.saturated, 3u);

  sensor.full_well_electrons = 200.0;
  image = read_out(light, sensor, 1);
  EXPECT_EQ(image.reading.channels[0].samples[2], 200.0f) << "the well is full below the top code";
  EXPECT_EQ(image.saturated, 4u);
}

TEST(ReadOut, FlagsReadingsBelowDigitalZero) {
  SensorDescription sensor = sensor_of(0.0, 1.0, 4.0, 8);
  const SensorImage image = read_out(uniform_current(100, 100, 5.0), sensor, 1);
  // Half the noise is below zero, what rounds to zero aside: P(x < -0.5) = Phi(-0.125) = 0.450.
  EXPECT_NEAR(static_cast<double>(image.below_zero) / 1e4, 0.450, 4.0 * 0.005);
  for (std::size_t i = 0; i < image.reading.pixel_count(); ++i) {
    ASSERT_GE(image.reading.channels[0].samples[i], 0.0f);
    if (image.clipped.channels[0].samples[i] < 0.0f) {
      ASSERT_EQ(image.reading.channels[0].samples[i], 0.0f);
    }
  }
}

TEST(ReadOut, SurvivesExtremes) {
  const SensorImage dark = read_out(uniform_current(1, 1, 1e6), sensor_of(0.0, 1.0, 0.0, 8), 1);
  EXPECT_EQ(dark.reading.channels[0].samples, std::vector<float>{0.0f}) << "no exposure, no noise";
  EXPECT_EQ(dark.saturated + dark.below_zero, 0u);
  const SensorImage burnt = read_out(uniform_current(1, 1, 1e6), sensor_of(1e12, 1.0, 1.0, 24), 1);
  EXPECT_EQ(burnt.reading.channels[0].samples, std::vector<float>{16777215.0f});
  EXPECT_EQ(burnt.saturated, 1u);
  EXPECT_THROW(read_out(uniform_current(1, 1, 1e6), sensor_of(1e200, 1.0, 1.0, 8), 1), InputError)
      << "an expected reading of 1e206 DN fits no float";
  SensorDescription off = sensor_of(1.0, 1.0, 0.0, 0);
  off.shot_noise = false;
  const SensorImage linear = read_out(uniform_current(2, 2, 0.123), off, 1);
  EXPECT_EQ(linear.reading.channels[0].samples, linear.expected.channels[0].samples)
      << "every stage off: the expected reading, unrounded";
  EXPECT_EQ(linear.variance.channels[0].samples[0], 0.0f);
}

TEST(ReadOut, ShowsEachPhotositeExactlyOneChannel) {
  PhotoCurrent light = uniform_current(6, 4, 10.0);
  light.channels = {"R", "G", "B"};
  light.electrons_per_s.resize(3, light.electrons_per_s[0]);
  std::fill(light.electrons_per_s[1].values.begin(), light.electrons_per_s[1].values.end(), 20.0);
  std::fill(light.electrons_per_s[2].values.begin(), light.electrons_per_s[2].values.end(), 30.0);
  for (const char* pattern : {"rggb", "bggr", "grbg", "gbrg"}) {
    SensorDescription sensor = sensor_of(1.0, 1.0, 0.0, 8);
    sensor.shot_noise = false;
    sensor.bayer = BayerPattern(pattern);
    const SensorImage image = read_out(light, sensor, 1);
    ASSERT_EQ(image.reading.channels.size(), 1u);
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 6; ++x) {
        const char site = std::string(pattern)[static_cast<std::size_t>(2 * (y % 2) + x % 2)];
        EXPECT_EQ(image.reading.channels[0].samples[image.reading.index(x, y)], site == 'r' ? 10.0f
                                                                                : site == 'g'
                                                                                    ? 20.0f
                                                                                    : 30.0f)
            << pattern << " at " << x << ", " << y;
      }
  }
  light.channels = {"B", "G", "R"};
  SensorDescription sensor = sensor_of(1.0, 1.0, 0.0, 8);
  sensor.bayer = BayerPattern("rggb");
  EXPECT_THROW(read_out(light, sensor, 1), InputError) << "colours that the mosaic would swap";
}

TEST(ExposureReaching, PutsTheBrightestPhotositeThere) {
  PhotoCurrent light = uniform_current(3, 1, 10.0);
  light.electrons_per_s[0].values[1] = 480.0;
  SensorDescription sensor = sensor_of(7.0, 0.5, 0.0, 8);
  sensor.offset_dn = 15.0;
  sensor.dark_current_electrons_per_s = 20.0;
  EXPECT_NEAR(exposure_reaching(0.5, light, sensor), 0.5 * 240.0 / 250.0, 1e-15);
  sensor.full_well_electrons = 100.0;  // 50 DN: before the converter's 240
  EXPECT_NEAR(exposure_reaching(1.0, light, sensor), 50.0 / 250.0, 1e-15);
  EXPECT_THROW(exposure_reaching(0.5, light, sensor_of(1.0, 1.0, 0.0, 0)), InputError);
  EXPECT_THROW(exposure_reaching(0.5, uniform_current(2, 2, 0.0), sensor_of(1.0, 1.0, 0.0, 8)),
               InputError);
}

// --- optics --------------------------------------------------------------------------------------

CameraDescription camera_of(int width, int height) {
  CameraDescription camera;
  camera.focal_length_m = 0.02;
  camera.film_m = {0.00001 * width, 0.00001 * height};  // 10 um pixels
  camera.pixels = {width, height};
  camera.lens.f_number = 8.0;
  camera.sensor = sensor_of(1.0, 1.0, 0.0, 0);
  return camera;
}

Image uniform_radiance(const CameraDescription& camera, const WavelengthGrid& bands, float value) {
  Image image(camera.pixels[0], camera.pixels[1]);
  for (double nm : bands.centres_nm()) image.add_channel(spectral_channel_name(nm), value);
  return image;
}

const WavelengthGrid kBands = WavelengthGrid::uniform(500.0, 600.0, 50.0);

// Irradiance from a disc of uniform radiance L, radius R, at distance h and offset a, on a parallel
// surface element: pi L / 2 (1 - (Z - 2 rho^2) / sqrt(Z^2 - 4 rho^2)), H = h / a, rho = R / a,
// Z = 1 + H^2 + rho^2. Source: Foote (1915), Bull. NBS 12; Howell, view factor B-13.
double disc_irradiance(double radius, double distance, double offset) {
  if (offset == 0.0)
    return std::numbers::pi * radius * radius / (radius * radius + distance * distance);
  const double rho2 = std::pow(radius / offset, 2.0);
  const double z = 1.0 + std::pow(distance / offset, 2.0) + rho2;
  const double root = std::sqrt(z * z - 4.0 * rho2);
  // (root - (z - 2 rho2)) without its cancellation.
  const double numerator = 4.0 * rho2 * (z - 1.0 - rho2) / (root + z - 2.0 * rho2);
  return 0.5 * std::numbers::pi * numerator / root;
}

TEST(PhotoCurrent, FallsAsCos4OnALambertianPlane) {
  // A Lambertian plane fills the exit pupil, a disc of diameter f / N at distance f, with its
  // radiance. Foote's closed form for that disc is the oracle, exact for every aperture; the small
  // disc's cos^4 law differs by its share of (R / f)^2 = 1 / (4 N^2).
  CameraDescription camera = camera_of(301, 3);
  camera.film_m = {0.0301, 0.0003};  // 100 um pixels: up to 37 degrees
  camera.lens.f_number = 100.0;
  camera.lens.cos4 = true;
  const auto current =
      photo_current(uniform_radiance(camera, kBands, 2.0f), kBands, flat(1.0), camera);
  const double f = camera.focal_length_m, radius = 0.5 * f / 100.0;
  const double photons = 0.5 * 150.0 * 550e-9 / (kPlanck * kLight);  // eta, band width, mean
  for (int x : {0, 40, 150, 222, 300}) {
    const double offset = 1e-4 * (x - 150);
    const double expected = 2.0 * disc_irradiance(radius, f, std::abs(offset)) * 1e-8 * photons;
    const double seen = current.electrons_per_s[0].values[static_cast<std::size_t>(301 + x)];
    EXPECT_NEAR(seen / expected, 1.0, 1e-4) << "at " << offset << " m; 4 / (4 N^2) = 1e-4";
  }
}

TEST(PhotoCurrent, FollowsTheVignettingPolynomialOnTheFilm) {
  CameraDescription camera = camera_of(5, 1);
  camera.film_m = {0.02, 0.004};
  const auto plain =
      photo_current(uniform_radiance(camera, kBands, 1.0f), kBands, flat(1.0), camera);
  camera.lens.vignetting_polynomial = {-0.3, 0.5};
  camera.lens.distortion.k1 = -0.2;  // image height is where the light lands: unchanged by this
  const auto seen =
      photo_current(uniform_radiance(camera, kBands, 1.0f), kBands, flat(1.0), camera);
  for (std::size_t x = 0; x < 5; ++x) {
    const double r = (static_cast<double>(x) - 2.0) * 0.004 / 0.02;
    EXPECT_NEAR(seen.electrons_per_s[0].values[x] / plain.electrons_per_s[0].values[x],
                1.0 - 0.3 * r * r + 0.5 * r * r * r * r, 1e-14);
  }
}

TEST(PhotoCurrent, LeavesEveryStageOffByDefault) {
  const CameraDescription camera = camera_of(4, 3);
  const auto current =
      photo_current(uniform_radiance(camera, kBands, 1.0f), kBands, flat(1.0), camera);
  const double expected =
      std::numbers::pi / (4.0 * 64.0) * 1e-10 * 0.5 * (150.0 * 550e-9 / (kPlanck * kLight));
  for (double v : current.electrons_per_s[0].values) EXPECT_NEAR(v / expected, 1.0, 1e-13);
}

TEST(PhotoCurrent, RefusesRadianceThatIsNoRadiance) {
  const CameraDescription camera = camera_of(4, 3);
  for (float bad : {std::nanf(""), INFINITY, -1e-3f}) {
    Image image = uniform_radiance(camera, kBands, 1.0f);
    image.channels[1].samples[image.index(2, 1)] = bad;
    try {
      photo_current(image, kBands, flat(1.0), camera);
      FAIL() << bad;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("(2, 1)"));
      EXPECT_THAT(error.what(), HasSubstr("550"));
    }
  }
  EXPECT_THROW(
      photo_current(uniform_radiance(camera_of(4, 4), kBands, 1.0f), kBands, flat(1.0), camera),
      InputError)
      << "other pixels";
  CameraDescription blind = camera;
  blind.sensor.reset();
  EXPECT_THROW(photo_current(uniform_radiance(blind, kBands, 1.0f), kBands, flat(1.0), blind),
               InputError);
}

TEST(PointSpread, IsTheGaussianOfItsVariance) {
  for (double sigma : {0.05, 0.4, 1.0, 3.7, 40.0}) {
    const auto w = discrete_gaussian(sigma);
    double sum = w[0], variance = 0.0;
    for (std::size_t n = 1; n < w.size(); ++n) {
      sum += 2.0 * w[n];
      variance += 2.0 * w[n] * static_cast<double>(n * n);
    }
    EXPECT_NEAR(sum, 1.0, 1e-14);
    EXPECT_NEAR(variance / (sigma * sigma), 1.0, 1e-11) << "rounding, times n^2";
  }
  // I_0(1) = 1.266065877752, I_1(1) = 0.565159103992: Abramowitz, Stegun (1964), table 9.8.
  EXPECT_NEAR(discrete_gaussian(1.0)[0], std::exp(-1.0) * 1.266065877752, 1e-12);
  EXPECT_NEAR(discrete_gaussian(1.0)[1], std::exp(-1.0) * 0.565159103992, 1e-12);
  EXPECT_EQ(discrete_gaussian(0.0), std::vector<double>{1.0});
  EXPECT_THROW(discrete_gaussian(-1.0), std::invalid_argument);
}

TEST(PointSpread, ConservesLightAndLeavesAUniformFieldAlone) {
  LightPlane plane{37, 23, std::vector<double>(37 * 23, 0.0)};
  plane.values[0] = 3.0;  // in the corner
  plane.values[11 * 37 + 20] = 5.0;
  LightPlane even{37, 23, std::vector<double>(37 * 23, 2.5)};
  const auto sum = [](const LightPlane& p) {
    return std::accumulate(p.values.begin(), p.values.end(), 0.0);
  };
  for (double sigma : {0.3, 2.0, 30.0}) {
    LightPlane spread_out = plane, uniform = even;
    spread(spread_out, {sigma, 0.5 * sigma});
    EXPECT_NEAR(sum(spread_out), 8.0, 1e-13);
    spread(uniform, {sigma, sigma});
    for (double v : uniform.values) ASSERT_NEAR(v, 2.5, 1e-14);
  }
  LightPlane one{1, 1, {7.0}};
  spread(one, {5.0, 5.0});
  EXPECT_NEAR(one.values[0], 7.0, 1e-14) << "a single pixel keeps its light";
}

TEST(VeilingGlare, LightensABlackSpotByItsShare) {
  LightPlane plane{10, 10, std::vector<double>(100, 8.0)};
  plane.values[44] = 0.0;
  const double mean = 8.0 * 0.99;
  add_veiling_glare(plane, 0.03);
  EXPECT_NEAR(plane.values[44], 0.03 * mean, 1e-14) << "ISO 9358: the spot's share of the field";
  EXPECT_NEAR(plane.values[0], 0.97 * 8.0 + 0.03 * mean, 1e-14);
  EXPECT_NEAR(std::accumulate(plane.values.begin(), plane.values.end(), 0.0), 792.0, 1e-11);
}

// --- files ---------------------------------------------------------------------------------------

TEST(WriteCounts, ComeBackFromPngAndTiff) {
  Image grey(3, 2), rgb(3, 2);
  grey.add_channel("Y").samples = {0.0f, 1.0f, 255.0f, 256.0f, 4095.0f, 65535.0f};
  for (const char* name : {"R", "G", "B"}) rgb.add_channel(name, static_cast<float>(name[0]) * 700);
  for (const char* ending : {".png", ".tif", ".tiff"})
    for (const Image* image : {&grey, &rgb}) {
      const std::string path = scratch_path(std::string("exposure_test_counts") + ending);
      write_counts(path, *image, "simulated photograph");
      const Image back = read_image(path);
      ASSERT_EQ(back.channels.size(), image->channels.size());
      for (std::size_t c = 0; c < back.channels.size(); ++c) {
        EXPECT_EQ(back.channels[c].name, image->channels[c].name);
        EXPECT_EQ(back.channels[c].samples, image->channels[c].samples) << path;
      }
    }
  for (float bad : {0.5f, -1.0f, 65536.0f, std::nanf("")}) {
    grey.channels[0].samples[2] = bad;
    EXPECT_THROW(write_counts(scratch_path("exposure_test_bad.png"), grey, ""), InputError) << bad;
  }
  EXPECT_THROW(write_counts(scratch_path("exposure_test_bad.jpg"), rgb, ""), InputError);
}

}  // namespace
}  // namespace truebox
