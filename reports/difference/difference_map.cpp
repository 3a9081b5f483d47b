// SPDX-License-Identifier: BSD-3-Clause
#include "difference/difference_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "image/spectral_image.h"
#include "radiometry/input_error.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

struct Pair {
  const Channel* test;
  const Channel* reference;
  double wavelength_nm;
};

std::string size_text(const Image& image) {
  return fmt::format("{} x {}", image.width, image.height);
}

std::string bands_text(const SpectralChannels& bands) {
  if (bands.indices.empty()) return "no spectral band";
  return fmt::format("{} bands {:g} to {:g} nm", bands.indices.size(), bands.wavelengths_nm.front(),
                     bands.wavelengths_nm.back());
}

std::string names_text(const Image& image) {
  std::string text;
  for (const auto& channel : image.channels) text += (text.empty() ? "" : ", ") + channel.name;
  return text.empty() ? "no channel" : text;
}

void require_equal_size(const Image& test, const Image& reference, const char* what) {
  if (test.width != reference.width || test.height != reference.height)
    throw MismatchError(fmt::format("{} is {} px, the reference is {} px", what, size_text(test),
                                    size_text(reference)));
}

void require_equal_unit(const Image& test, const Image& reference) {
  const auto t = test.attributes.find("unit");
  const auto r = reference.attributes.find("unit");
  if (t == test.attributes.end() || r == reference.attributes.end()) return;
  if (t->second != r->second)
    throw MismatchError(
        fmt::format("the test is in '{}', the reference in '{}'", t->second, r->second));
}

/// Index of the band within the tolerance of a wavelength, or none.
std::optional<std::size_t> band_at(const SpectralChannels& bands, double nm, double tolerance_nm) {
  for (std::size_t i = 0; i < bands.indices.size(); ++i)
    if (std::abs(bands.wavelengths_nm[i] - nm) <= tolerance_nm) return bands.indices[i];
  return std::nullopt;
}

std::vector<Pair> match_bands(const Image& test, const Image& reference,
                              const DifferenceOptions& options) {
  const SpectralChannels t = spectral_channels(test);
  SpectralChannels r = spectral_channels(reference);
  if (options.band_nm) {  // the others need not match: the reference may hold a few bands only
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < r.indices.size(); ++i)
      if (std::abs(r.wavelengths_nm[i] - *options.band_nm) <
          std::abs(r.wavelengths_nm[nearest] - *options.band_nm))
        nearest = i;
    r = {{r.indices[nearest]}, {r.wavelengths_nm[nearest]}};
  } else if (t.indices.size() != r.indices.size()) {
    throw MismatchError(
        fmt::format("the test has {}, the reference has {}", bands_text(t), bands_text(r)));
  }
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < r.indices.size(); ++i) {
    const auto found = band_at(t, r.wavelengths_nm[i], options.wavelength_tolerance_nm);
    if (!found)
      throw MismatchError(fmt::format("the reference has a band at {:g} nm, the test has none ({})",
                                      r.wavelengths_nm[i], bands_text(t)));
    pairs.push_back(
        {&test.channels[*found], &reference.channels[r.indices[i]], r.wavelengths_nm[i]});
  }
  return pairs;
}

std::vector<Pair> match_names(const Image& test, const Image& reference) {
  std::vector<Pair> pairs;
  for (const auto& channel : reference.channels)
    if (const Channel* found = test.find(channel.name)) pairs.push_back({found, &channel, -1.0});
  if (pairs.empty() || pairs.size() != reference.channels.size() ||
      pairs.size() != test.channels.size())
    throw MismatchError(fmt::format("the test has the channels {}; the reference has {}",
                                    names_text(test), names_text(reference)));
  return pairs;
}

std::vector<Pair> match(const Image& test, const Image& reference,
                        const DifferenceOptions& options) {
  const bool spectral = !spectral_channels(reference).indices.empty();
  if (!spectral && !spectral_channels(test).indices.empty() && options.band_nm)
    throw MismatchError("the reference has no spectral band, so --band cannot choose one");
  if (!spectral || spectral_channels(test).indices.empty()) return match_names(test, reference);
  return match_bands(test, reference, options);
}

/// The uncertainty that belongs to a channel: same band, else same name.
const Channel& uncertainty_channel(const Image& uncertainty, const Pair& pair,
                                   const DifferenceOptions& options) {
  if (pair.wavelength_nm > 0.0) {
    const auto found = band_at(spectral_channels(uncertainty), pair.wavelength_nm,
                               options.wavelength_tolerance_nm);
    if (found) return uncertainty.channels[*found];
  } else if (const Channel* found = uncertainty.find(pair.reference->name)) {
    return *found;
  }
  throw MismatchError(fmt::format("channel {} has no uncertainty; there is one for {}",
                                  pair.reference->name, names_text(uncertainty)));
}

/// Variance of one side, and how many samples it was estimated from (0: very many).
struct Side {
  const Image* uncertainty;
  double samples;
};

void require_valid(const DifferenceOptions& options) {
  for (double n : {options.test_samples, options.reference_samples})
    if (n != 0.0 && !(n >= 2.0)) throw std::invalid_argument("a variance needs at least 2 samples");
  if (!(options.calibration_relative >= 0.0 && std::isfinite(options.calibration_relative)))
    throw std::invalid_argument("the calibration's uncertainty must not be negative");
}

/// Fills u and its degrees of freedom, nu = u^4 / sum(u_i^4 / nu_i).
void add_uncertainty(DifferenceChannel& channel, const Pair& pair,
                     const DifferenceOptions& options) {
  const Side sides[] = {{options.test_uncertainty, options.test_samples},
                        {options.reference_uncertainty, options.reference_samples}};
  const std::size_t n = channel.difference.size();
  std::vector<double> variance(n, 0.0), fourth(n, 0.0);
  bool stated = false, few = false;
  const auto add = [&](std::size_t i, double u, double samples) {
    // A negative u is no u: NaN, which never passes.
    variance[i] += u >= 0.0 ? u * u : std::numeric_limits<double>::quiet_NaN();
    if (samples > 0.0) fourth[i] += u * u * u * u / (samples - 1.0);
  };
  for (const Side& side : sides) {
    if (side.uncertainty == nullptr) continue;
    stated = true;
    few = few || side.samples > 0.0;
    const Channel& u = uncertainty_channel(*side.uncertainty, pair, options);
    for (std::size_t i = 0; i < n; ++i) add(i, u.samples[i], side.samples);
  }
  if (options.test_error_bound != nullptr) {
    stated = true;
    channel.bound_uncertainty =
        uncertainty_channel(*options.test_error_bound, pair, options).samples;
    for (float& u : channel.bound_uncertainty) u /= std::numbers::sqrt3_v<float>;
    for (std::size_t i = 0; i < n; ++i) add(i, channel.bound_uncertainty[i], 0.0);
  }
  if (options.calibration_relative > 0.0) {
    stated = true;
    for (std::size_t i = 0; i < n; ++i)
      add(i, options.calibration_relative * std::abs(channel.reference[i]), 0.0);
  }
  if (!stated) return;
  channel.standard_uncertainty.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    channel.standard_uncertainty[i] = static_cast<float>(std::sqrt(variance[i]));
  if (!few) return;
  channel.degrees_of_freedom.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    channel.degrees_of_freedom[i] = fourth[i] > 0.0
                                        ? static_cast<float>(variance[i] * variance[i] / fourth[i])
                                        : std::numeric_limits<float>::infinity();
}

std::vector<std::uint8_t> pixel_mask(const Image& mask, const Image& reference) {
  require_equal_size(mask, reference, "the mask");
  if (mask.channels.size() != 1)
    throw MismatchError(fmt::format("a mask has one channel, this one has {}", names_text(mask)));
  std::vector<std::uint8_t> counts(mask.channels[0].samples.size());
  std::transform(mask.channels[0].samples.begin(), mask.channels[0].samples.end(), counts.begin(),
                 [](float v) { return static_cast<std::uint8_t>(v != 0.0f); });
  if (std::find(counts.begin(), counts.end(), 1) == counts.end())
    throw MismatchError("the mask leaves no pixel to compare");
  return counts;
}

}  // namespace

double DifferenceChannel::sigmas(std::size_t pixel) const {
  const double d = difference[pixel], u = standard_uncertainty[pixel];
  if (!(u >= 0.0)) return std::numeric_limits<double>::quiet_NaN();  // a negative u is no u
  if (u == 0.0) return d == 0.0 ? 0.0 : std::copysign(std::numeric_limits<double>::infinity(), d);
  return d / u;
}

double DifferenceChannel::score(std::size_t pixel) const {
  const double t = sigmas(pixel);
  if (degrees_of_freedom.empty() || std::isnan(t)) return t;
  // Satterthwaite's estimate is at least the smaller of the two sides' degrees, which is >= 1.
  return normal_score_of_student_t(t, std::max(1.0, double{degrees_of_freedom[pixel]}));
}

std::size_t DifferenceMap::pixel_count() const {
  if (mask.empty()) return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  return static_cast<std::size_t>(mask.size()) -
         static_cast<std::size_t>(std::count(mask.begin(), mask.end(), 0));
}

bool DifferenceMap::has_uncertainty() const {
  for (const auto& channel : channels)
    if (channel.standard_uncertainty.empty()) return false;
  return !channels.empty();
}

DifferenceMap difference_map(const Image& test, const Image& reference,
                             const DifferenceOptions& options) {
  require_equal_size(test, reference, "the test");
  require_equal_unit(test, reference);
  require_valid(options);
  for (const auto& [image, what] : {std::pair{options.test_uncertainty, "the uncertainty"},
                                    std::pair{options.reference_uncertainty, "the uncertainty"},
                                    std::pair{options.test_error_bound, "the error bound"}})
    if (image != nullptr) require_equal_size(*image, reference, what);
  DifferenceMap map;
  map.width = reference.width;
  map.height = reference.height;
  map.calibration_relative = options.calibration_relative;
  if (options.mask != nullptr) map.mask = pixel_mask(*options.mask, reference);
  if (const auto unit = reference.attributes.find("unit"); unit != reference.attributes.end())
    map.unit = unit->second;
  for (const Pair& pair : match(test, reference, options)) {
    DifferenceChannel channel;
    channel.name = pair.reference->name;
    channel.wavelength_nm = pair.wavelength_nm;
    channel.reference = pair.reference->samples;
    channel.difference.resize(channel.reference.size());
    for (std::size_t i = 0; i < channel.difference.size(); ++i)
      channel.difference[i] = pair.test->samples[i] - channel.reference[i];
    add_uncertainty(channel, pair, options);
    map.channels.push_back(std::move(channel));
  }
  return map;
}

Image to_image(const DifferenceMap& map) {
  Image image(map.width, map.height);
  if (!map.unit.empty()) image.attributes["unit"] = map.unit;
  image.attributes["content"] = "signed difference, test - reference";
  for (const auto& channel : map.channels) {
    image.channels.push_back({channel.name, channel.difference});
    if (channel.standard_uncertainty.empty()) continue;
    Channel z{channel.name + ".z", std::vector<float>(channel.difference.size())};
    for (std::size_t i = 0; i < z.samples.size(); ++i)
      z.samples[i] = static_cast<float>(channel.sigmas(i));
    image.attributes["unit:" + z.name] = "1";
    image.channels.push_back(std::move(z));
  }
  return image;
}

}  // namespace truebox
