// SPDX-License-Identifier: BSD-3-Clause
#include "difference/perceptual.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "difference/ciede2000.h"
#include "difference/delta_e_itp.h"
#include "difference/display_light.h"
#include "difference/structural_similarity.h"

namespace truebox {
namespace {

LinearRgb scaled(const RgbPlanes& planes, std::size_t i, double factor) {
  return {factor * planes[0][i], factor * planes[1][i], factor * planes[2][i]};
}

RgbPlanes shown(const RgbPlanes& planes, double exposure, bool coded) {
  RgbPlanes result = planes;
  for (auto& plane : result)
    for (float& v : plane) {
      const double linear = std::clamp(exposure * v, 0.0, 1.0);
      v = static_cast<float>(!coded                ? linear
                             : linear <= 0.0031308 ? 12.92 * linear
                                                   : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055);
    }
  return result;
}

}  // namespace

std::vector<MetricMap> perceptual_maps(int width, int height, RgbPlanes test, RgbPlanes reference,
                                       const ViewingConditions& viewing) {
  const std::size_t pixels = test[0].size();
  std::vector<std::size_t> bad;
  for (std::size_t i = 0; i < pixels; ++i) {
    bool finite = true;
    for (std::size_t c = 0; c < 3; ++c)
      finite = finite && std::isfinite(test[c][i]) && std::isfinite(reference[c][i]);
    if (finite) continue;
    bad.push_back(i);
    for (std::size_t c = 0; c < 3; ++c) test[c][i] = reference[c][i] = 0.0f;
  }
  MetricMap de{"ciede2000", "CIEDE2000", "1", width, height, std::vector<float>(pixels)};
  MetricMap itp{"itp", "dE ITP", "1", width, height, std::vector<float>(pixels)};
  for (std::size_t i = 0; i < pixels; ++i) {
    const LinearRgb t = scaled(test, i, viewing.exposure),
                    r = scaled(reference, i, viewing.exposure);
    de.values[i] = static_cast<float>(ciede2000(cielab(xyz_from_bt709(t), kDisplayWhite),
                                                cielab(xyz_from_bt709(r), kDisplayWhite)));
    const auto light = [&](const LinearRgb& c) {
      const double w = viewing.white_cd_m2;
      return ictcp(bt2020_from_bt709({w * c[0], w * c[1], w * c[2]}));
    };
    itp.values[i] = static_cast<float>(delta_e_itp(light(t), light(r)));
  }
  MetricMap ldr{"flip", "FLIP", "1", width, height, {}};
  ldr.values = flip(width, height, shown(test, viewing.exposure, false),
                    shown(reference, viewing.exposure, false), viewing.pixels_per_degree);
  MetricMap hdr{"hdr-flip", "HDR-FLIP", "1", width, height, {}};
  hdr.values = hdr_flip(width, height, test, reference, viewing.pixels_per_degree);
  MetricMap ssim{"dssim", "1 - SSIM", "1", width, height, {}};
  ssim.values = structural_similarity(width, height, shown(test, viewing.exposure, true),
                                      shown(reference, viewing.exposure, true));
  for (float& v : ssim.values) v = 1.0f - v;
  std::vector<MetricMap> maps;
  for (MetricMap* map : {&de, &itp, &ldr, &hdr, &ssim}) {
    for (std::size_t i : bad) map->values[i] = std::numeric_limits<float>::quiet_NaN();
    maps.push_back(std::move(*map));
  }
  return maps;
}

}  // namespace truebox
