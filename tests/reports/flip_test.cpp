// SPDX-License-Identifier: BSD-3-Clause
#include "difference/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

#include "colour/scene_linear.h"
#include "image/image_file.h"

namespace truebox {
namespace {

constexpr double kPi = std::numbers::pi;

RgbPlanes uniform(std::size_t pixels, float r, float g, float b) {
  return {std::vector<float>(pixels, r), std::vector<float>(pixels, g),
          std::vector<float>(pixels, b)};
}

RgbPlanes random_blocks(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0.0f, 1.0f);
  RgbPlanes planes = uniform(static_cast<std::size_t>(width * height), 0, 0, 0);
  for (auto& plane : planes)
    for (int y = 0; y < height; y += 4)
      for (int x = 0; x < width; x += 5) {
        const float v = value(random);
        for (int j = y; j < std::min(height, y + 4); ++j)
          for (int i = x; i < std::min(width, x + 5); ++i)
            plane[static_cast<std::size_t>(j * width + i)] = v;
      }
  return planes;
}

TEST(Flip, EqualPicturesDoNotDiffer) {
  const RgbPlanes picture = random_blocks(40, 30, 1);
  for (float v : flip(40, 30, picture, picture)) EXPECT_EQ(v, 0.0f);
  for (float v : hdr_flip(40, 30, picture, picture)) EXPECT_EQ(v, 0.0f);
}

TEST(Flip, GreenAgainstBlueIsTheLargestDifference) {
  // The paper scales by the distance of these two primaries, so it is 1 by definition.
  const auto map = flip(24, 24, uniform(576, 0, 1, 0), uniform(576, 0, 0, 1));
  for (float v : map) EXPECT_NEAR(v, 1.0f, 1e-5f);
}

// The equations of the paper once more, written down without separable filters: dense kernels, one
// pixel at a time, in double.
struct Dense {
  int width, height;
  double ppd;

  using Colour = std::array<double, 3>;
  static Colour xyz(const Colour& c) {
    return {0.412390799 * c[0] + 0.357584339 * c[1] + 0.180480788 * c[2],
            0.212639006 * c[0] + 0.715168679 * c[1] + 0.072192315 * c[2],
            0.019330819 * c[0] + 0.119194780 * c[1] + 0.950532152 * c[2]};
  }
  static Colour white() { return xyz({1, 1, 1}); }
  static Colour ycxcz(const Colour& rgb) {
    const Colour c = xyz(rgb), w = white();
    return {116 * c[1] / w[1] - 16, 500 * (c[0] / w[0] - c[1] / w[1]),
            200 * (c[1] / w[1] - c[2] / w[2])};
  }
  static Colour hunt_lab(const Colour& rgb) {
    const Colour c = xyz(rgb), w = white();
    const auto f = [](double t) {
      const double d = 6.0 / 29.0;
      return t > d * d * d ? std::cbrt(t) : t / (3 * d * d) + 4.0 / 29.0;
    };
    const double x = f(c[0] / w[0]), y = f(c[1] / w[1]), z = f(c[2] / w[2]), L = 116 * y - 16;
    return {L, 0.01 * L * 500 * (x - y), 0.01 * L * 200 * (y - z)};
  }
  static Colour rgb_of(const Colour& o) {
    const Colour w = white();
    const double y = (o[0] + 16) / 116, X = (y + o[1] / 500) * w[0], Z = (y - o[2] / 200) * w[2];
    const Colour c = {3.24096994 * X - 1.53738318 * y - 0.49861076 * Z,
                      -0.96924364 * X + 1.8759675 * y + 0.04155506 * Z,
                      0.05563008 * X - 0.20397696 * y + 1.05697151 * Z};
    return {std::clamp(c[0], 0.0, 1.0), std::clamp(c[1], 0.0, 1.0), std::clamp(c[2], 0.0, 1.0)};
  }
  Colour at(const RgbPlanes& p, int x, int y) const {
    const auto i = static_cast<std::size_t>(std::clamp(y, 0, height - 1) * width +
                                            std::clamp(x, 0, width - 1));
    return {p[0][i], p[1][i], p[2][i]};
  }
  Colour seen(const RgbPlanes& p, int x, int y) const {
    const double a[3][4] = {{1, 0.0047, 0, 1e-5}, {1, 0.0053, 0, 1e-5}, {34.1, 0.04, 13.5, 0.025}};
    const int r = static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * ppd));
    Colour sum{};
    for (int c = 0; c < 3; ++c) {
      double weights = 0;
      for (int j = -r; j <= r; ++j)
        for (int i = -r; i <= r; ++i) {
          const double d2 = (i * i + j * j) / (ppd * ppd);
          const double w =
              a[c][0] * std::sqrt(kPi / a[c][1]) * std::exp(-kPi * kPi * d2 / a[c][1]) +
              a[c][2] * std::sqrt(kPi / a[c][3]) * std::exp(-kPi * kPi * d2 / a[c][3]);
          weights += w;
          sum[static_cast<std::size_t>(c)] +=
              w * ycxcz(at(p, x + i, y + j))[static_cast<std::size_t>(c)];
        }
      sum[static_cast<std::size_t>(c)] /= weights;
    }
    return hunt_lab(rgb_of(sum));
  }
  /// Length of the gradient of the edge (order 1) or point (order 2) detector.
  double feature(const RgbPlanes& p, int x, int y, int order) const {
    const double s = 0.5 * 0.082 * ppd;
    const int r = static_cast<int>(std::ceil(3 * s));
    const auto kernel = [&](int i, int j) {
      const double g = std::exp(-(i * i + j * j) / (2 * s * s));
      return order == 1 ? -i * g : (i * i / (s * s) - 1) * g;
    };
    double positive = 0, negative = 0;
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i) (kernel(i, j) > 0 ? positive : negative) += kernel(i, j);
    double gx = 0, gy = 0;
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i) {
        const double k = kernel(i, j) / (kernel(i, j) > 0 ? positive : -negative);
        gx += k * (ycxcz(at(p, x + i, y + j))[0] + 16) / 116;
        gy += k * (ycxcz(at(p, x + j, y + i))[0] + 16) / 116;
      }
    return std::hypot(gx, gy);
  }
  static double hyab(const Colour& a, const Colour& b) {
    return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
  }
  double flip(const RgbPlanes& t, const RgbPlanes& r, int x, int y) const {
    const double largest = std::pow(hyab(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), 0.7);
    const double d = std::pow(hyab(seen(t, x, y), seen(r, x, y)), 0.7);
    const double colour = d < 0.4 * largest ? 0.95 * d / (0.4 * largest)
                                            : 0.95 + 0.05 * (d - 0.4 * largest) / (0.6 * largest);
    const double f = std::max(std::abs(feature(t, x, y, 1) - feature(r, x, y, 1)),
                              std::abs(feature(t, x, y, 2) - feature(r, x, y, 2)));
    return std::pow(colour, 1 - std::sqrt(f / std::numbers::sqrt2));
  }
};

TEST(Flip, FollowsTheEquationsOfThePaper) {
  const int w = 33, h = 27;
  const RgbPlanes test = random_blocks(w, h, 7), reference = random_blocks(w, h, 8);
  for (double ppd : {kDefaultPixelsPerDegree, 30.0}) {
    const auto map = flip(w, h, test, reference, ppd);
    const Dense dense{w, h, ppd};
    for (const auto& [x, y] : {std::pair{0, 0}, {16, 13}, {32, 5}, {7, 26}, {20, 20}})
      EXPECT_NEAR(map[static_cast<std::size_t>(y * w + x)], dense.flip(test, reference, x, y), 2e-4)
          << x << ", " << y << ": floats in the filters, against doubles";
  }
}

TEST(Flip, ExposuresFollowBrightestAndMedian) {
  // Solved by hand: the ACES fit shows 0.85 at x with (0.9036 - 0.85 * 0.8748) x^2
  // + (0.018 - 0.85 * 0.354) x - 0.85 * 0.14 = 0.
  const double a = 0.9036 - 0.85 * 0.8748, b = 0.018 - 0.85 * 0.354, c = -0.85 * 0.14;
  const double x = (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
  RgbPlanes reference = uniform(101, 0.5f, 0.5f, 0.5f);
  for (auto& plane : reference) plane[3] = 64.0f;
  const FlipExposures e = flip_exposures(reference);
  EXPECT_NEAR(e.start, std::log2(x / 64.0), 1e-6);
  EXPECT_NEAR(e.stop, std::log2(x / 0.5), 1e-6);
  EXPECT_EQ(e.count, 7);  // 7 stops between
  EXPECT_EQ(flip_exposures(uniform(9, 0, 0, 0)).count, 1);
}

TEST(Flip, HdrDoesNotDependOnTheUnit) {
  RgbPlanes test = random_blocks(24, 24, 3), reference = random_blocks(24, 24, 4);
  const auto one = hdr_flip(24, 24, test, reference);
  for (RgbPlanes* planes : {&test, &reference})
    for (auto& plane : *planes)
      for (float& v : plane) v *= 1024.0f;  // exact
  const auto other = hdr_flip(24, 24, test, reference);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_NEAR(one[i], other[i], 1e-4f);
}

TEST(Flip, HdrSeesWhatTheDisplayClips) {
  const RgbPlanes bright = uniform(400, 20, 20, 20), brighter = uniform(400, 40, 40, 40);
  EXPECT_EQ(flip(20, 20, bright, brighter)[0], 0.0f);
  EXPECT_GT(hdr_flip(20, 20, bright, brighter)[0], 0.05f);
}

TEST(Flip, RefusesPlanesOfAnotherSize) {
  EXPECT_THROW(flip(4, 4, uniform(15, 0, 0, 0), uniform(16, 0, 0, 0)), std::invalid_argument);
  EXPECT_THROW(flip(4, 4, uniform(16, 0, 0, 0), uniform(16, 0, 0, 0), 0.0), std::invalid_argument);
}

// The authors publish the means of their own pair of images (NVlabs/flip, tests/test.py) to six
// digits. The images are not shipped here: put them into a folder and name it to run this.
TEST(Flip, ReproducesThePublishedMeans) {
  const char* folder = std::getenv("TRUEBOX_FLIP_IMAGES");
  if (folder == nullptr) GTEST_SKIP() << "TRUEBOX_FLIP_IMAGES names no folder";
  for (const auto& [extension, published] : {std::pair{".png", 0.159691}, {".exr", 0.283478}}) {
    const Image t = read_image(std::string(folder) + "/test" + extension);
    const Image r = read_image(std::string(folder) + "/reference" + extension);
    const auto planes = [](const Image& image) {
      const Image rgb = scene_linear(image, nullptr)->rgb;
      return RgbPlanes{rgb.channels[0].samples, rgb.channels[1].samples, rgb.channels[2].samples};
    };
    const auto map = std::string(extension) == ".png"
                         ? flip(t.width, t.height, planes(t), planes(r))
                         : hdr_flip(t.width, t.height, planes(t), planes(r));
    const double mean =
        std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
    // Their note on precision: filters in another order move the fourth digit.
    EXPECT_NEAR(mean, published, 2e-4) << extension;
  }
}

}  // namespace
}  // namespace truebox
