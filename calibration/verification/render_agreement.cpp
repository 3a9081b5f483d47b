// SPDX-License-Identifier: BSD-3-Clause
#include "verification/render_agreement.h"

#include <cmath>

#include "image/spectral_image.h"
#include "radiometry/input_error.h"

namespace truebox {

Image matching_bands(const Image& image, const Image& reference) {
  if (image.width != reference.width || image.height != reference.height)
    throw MismatchError("the images are " + std::to_string(image.width) + " x " +
                        std::to_string(image.height) + " and " + std::to_string(reference.width) +
                        " x " + std::to_string(reference.height) + " pixels");
  const SpectralChannels have = spectral_channels(image), want = spectral_channels(reference);
  Image result(image.width, image.height);
  result.attributes = image.attributes;
  for (double nm : want.wavelengths_nm) {
    std::size_t found = have.indices.size();
    for (std::size_t k = 0; k < have.indices.size(); ++k)
      if (std::abs(have.wavelengths_nm[k] - nm) < 0.01) found = k;
    if (found == have.indices.size())
      throw MismatchError("no band at " + std::to_string(nm) + " nm");
    result.channels.push_back(
        {spectral_channel_name(nm), image.channels[have.indices[found]].samples});
  }
  return result;
}

RenderAgreement render_agreement(const Image& radiance, const Image& error_bound,
                                 const Image& reference, const Image& standard_error) {
  const Image values = matching_bands(radiance, reference);
  const Image bounds = matching_bands(error_bound, reference);
  const Image errors = matching_bands(standard_error, reference);
  const Image truth = matching_bands(reference, reference);
  RenderAgreement result;
  double z = 0.0, z2 = 0.0, sum = 0.0, sum_reference = 0.0, sum_bound = 0.0;
  for (std::size_t c = 0; c < truth.channels.size(); ++c)
    for (std::size_t i = 0; i < truth.pixel_count(); ++i) {
      const double u = errors.channels[c].samples[i];
      if (!(u > 0.0)) continue;
      const double value = values.channels[c].samples[i], bound = bounds.channels[c].samples[i];
      const double difference = value - truth.channels[c].samples[i];
      ++result.samples;
      // Written so that a NaN counts as outside.
      if (!(std::abs(difference) <= bound + 3.0 * u)) ++result.outside;
      z += difference / u;
      z2 += difference * difference / (u * u);
      sum += value;
      sum_reference += truth.channels[c].samples[i];
      sum_bound += bound;
    }
  const auto n = static_cast<double>(result.samples);
  result.mean_z = z / n;
  result.rms_z = std::sqrt(z2 / n);
  result.mean_bound = sum_bound / sum;
  result.bias = sum / sum_reference - 1.0;
  return result;
}

}  // namespace truebox
