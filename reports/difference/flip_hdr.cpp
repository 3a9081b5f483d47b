// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "difference/flip.h"

namespace truebox {
namespace {

// (k0 x^2 + k1 x) / (k3 x^2 + k4 x + k5), Narkowicz's fit to ACES with its pre-exposure of 0.6.
constexpr double kK0 = 0.6 * 0.6 * 2.51, kK1 = 0.6 * 0.03, kK3 = 0.6 * 0.6 * 2.43, kK4 = 0.6 * 0.59,
                 kK5 = 0.14;

float tone_mapped(double x) {
  x = std::max(x, 0.0);
  const double y = (kK0 * x * x + kK1 * x) / (kK3 * x * x + kK4 * x + kK5);
  return static_cast<float>(std::isfinite(y) ? std::clamp(y, 0.0, 1.0) : 1.0);
}

/// The x that is shown at a share of white.
double inverse_tone_map(double share) {
  const double a = kK0 - share * kK3, b = kK1 - share * kK4, c = -share * kK5;
  return (-b + std::sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
}

double median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

RgbPlanes exposed(const RgbPlanes& image, double stops) {
  RgbPlanes result = image;
  const double scale = std::exp2(stops);
  for (auto& plane : result)
    for (float& v : plane) v = tone_mapped(scale * v);
  return result;
}

}  // namespace

FlipExposures flip_exposures(const RgbPlanes& reference) {
  std::vector<float> luminance(reference[0].size());
  for (std::size_t i = 0; i < luminance.size(); ++i)
    luminance[i] =
        0.2126f * reference[0][i] + 0.7152f * reference[1][i] + 0.0722f * reference[2][i];
  const float brightest =
      luminance.empty() ? 0.0f : *std::max_element(luminance.begin(), luminance.end());
  if (!(brightest > 0.0f)) return {};
  double middle = median(luminance);
  if (!(middle > 0.0)) {
    std::erase_if(luminance, [](float y) { return !(y > 0.0f); });
    middle = median(luminance);
  }
  const double shown = inverse_tone_map(0.85);
  FlipExposures e{std::log2(shown / brightest), std::log2(shown / middle), 2};
  e.count = std::max(2, static_cast<int>(std::ceil(e.stop - e.start)));
  return e;
}

std::vector<float> hdr_flip(int width, int height, const RgbPlanes& test,
                            const RgbPlanes& reference, double pixels_per_degree) {
  const FlipExposures e = flip_exposures(reference);
  std::vector<float> worst;
  for (int k = 0; k < e.count; ++k) {
    const double stops = e.start + (e.stop - e.start) * k / std::max(1, e.count - 1);
    const auto one =
        flip(width, height, exposed(test, stops), exposed(reference, stops), pixels_per_degree);
    if (worst.empty()) worst.assign(one.size(), 0.0f);
    for (std::size_t i = 0; i < one.size(); ++i) worst[i] = std::max(worst[i], one[i]);
  }
  return worst;
}

}  // namespace truebox
