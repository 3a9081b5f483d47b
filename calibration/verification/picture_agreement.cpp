// SPDX-License-Identifier: BSD-3-Clause
#include "verification/picture_agreement.h"

#include <algorithm>
#include <cmath>

#include "radiometry/input_error.h"
#include "uncertainty/significance.h"
#include "verification/render_agreement.h"

namespace truebox {
namespace {

constexpr double kFloat = 1e-6;  // of a radiance: what storing it in float can do

// Means over blocks; of squares where `squared`, which gives the variance of a mean.
Image block_means(const Image& image, int block, bool squared) {
  Image result(image.width / block, image.height / block);
  const double count = block * block;
  for (const Channel& channel : image.channels) {
    Channel& mean = result.add_channel(channel.name);
    for (int y = 0; y < result.height; ++y)
      for (int x = 0; x < result.width; ++x) {
        double sum = 0.0;
        for (int k = 0; k < block * block; ++k) {
          const double v =
              channel.samples[image.index(x * block + k % block, y * block + k / block)];
          sum += squared ? v * v : v;
        }
        mean.samples[result.index(x, y)] =
            static_cast<float>(squared ? std::sqrt(sum) / count : sum / count);
      }
  }
  return result;
}

struct Planes {
  Image radiance, standard_error, bound;
  double degrees = 0.0;

  Planes(const UncertainPicture& picture, const Image& bands, int block)
      : radiance(matching_bands(*picture.radiance, bands)), degrees(picture.degrees) {
    if (picture.standard_error) standard_error = matching_bands(*picture.standard_error, bands);
    if (picture.error_bound) bound = matching_bands(*picture.error_bound, bands);
    if (block == 1) return;
    radiance = block_means(radiance, block, false);
    standard_error = block_means(standard_error, block, true);
    bound = block_means(bound, block, false);
    degrees *= block * block;
  }
  static double at(const Image& image, std::size_t channel, std::size_t pixel) {
    return image.channels.empty() ? 0.0 : image.channels[channel].samples[pixel];
  }
};

// Welch (1947), Satterthwaite (1946); 0 stands for very many.
int joint_degrees(double u2, double degrees, double other_u2, double other_degrees) {
  const double sum = (degrees > 0.0 ? u2 * u2 / degrees : 0.0) +
                     (other_degrees > 0.0 ? other_u2 * other_u2 / other_degrees : 0.0);
  const double joint = sum > 0.0 ? (u2 + other_u2) * (u2 + other_u2) / sum : 1e9;
  return joint > 500.0 ? 0 : std::max(1, static_cast<int>(joint));
}

}  // namespace

PictureAgreement picture_agreement(const UncertainPicture& test, const UncertainPicture& reference,
                                   int block_px) {
  const Image& bands = *reference.radiance;
  if (block_px < 1 || bands.width % block_px != 0 || bands.height % block_px != 0)
    throw MismatchError("blocks of " + std::to_string(block_px) + " px do not fill " +
                        std::to_string(bands.width) + " x " + std::to_string(bands.height));
  const Planes a(test, bands, block_px), b(reference, bands, block_px);
  PictureAgreement result;
  result.p_values = b.radiance;
  result.p_values.attributes = {{"unit", "1"}};
  double sum = 0.0, squares = 0.0, bounds = 0.0;
  std::size_t beyond = 0;
  for (std::size_t c = 0; c < b.radiance.channels.size(); ++c) {
    double differences = 0.0, variance = 0.0, light = 0.0;
    for (std::size_t i = 0; i < b.radiance.pixel_count(); ++i) {
      const double value = Planes::at(b.radiance, c, i);
      const double difference = Planes::at(a.radiance, c, i) - value;
      const double bound = Planes::at(a.bound, c, i) + Planes::at(b.bound, c, i);
      const double u2 = std::pow(Planes::at(a.standard_error, c, i), 2);
      const double other_u2 = std::pow(Planes::at(b.standard_error, c, i), 2);
      const double u = std::sqrt(u2 + other_u2);
      float& p = result.p_values.channels[c].samples[i];
      p = 1.0f;
      if (u == 0.0 && std::abs(difference) <= bound + kFloat * std::abs(value)) continue;
      const int degrees = joint_degrees(u2, a.degrees, other_u2, b.degrees);
      // Written so that what is not a number counts as far off.
      const double excess = std::abs(difference) <= bound ? 0.0 : std::abs(difference) - bound;
      const double chance = u > 0.0 ? two_sided_p(excess / u, degrees) : 0.0;
      const double score = std::copysign(
          u > 0.0 ? normal_score(two_sided_p(difference / u, degrees)) : 8.3, difference);
      p = static_cast<float>(chance);
      result.smallest_p = std::min(result.smallest_p, chance);
      ++result.tests;
      sum += score;
      squares += score * score;
      if (u > 0.0) bounds += bound * bound / (u * u);
      beyond += std::abs(score) > 3.0;
      differences += difference;
      variance += u * u;
      light += value;
    }
    if (variance == 0.0 ||
        !(std::abs(differences) / std::sqrt(variance) >= std::abs(result.bias_score)))
      continue;
    result.bias_score = differences / std::sqrt(variance);
    result.bias = differences / light;
  }
  if (result.tests == 0) return result;
  const auto n = static_cast<double>(result.tests);
  result.family_wise_p = family_wise_p(result.smallest_p, result.tests);
  result.mean_score = sum / n;
  result.rms_score = std::sqrt(squares / n);
  result.rms_bound = std::sqrt(bounds / n);
  result.share_beyond_3 = static_cast<double>(beyond) / n;
  return result;
}

}  // namespace truebox
