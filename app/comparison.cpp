// SPDX-License-Identifier: BSD-3-Clause
#include "comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commands.h"
#include "difference/spectral_angle.h"
#include "image/channel_map.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox::app {
namespace {

/// The images of uncertainty, kept as long as the map is made from them.
struct Uncertainties {
  std::optional<Image> test, reference, bound, mask;
};

Image read_mapped(const std::string& path, const std::string& channels) {
  Image image = read_image(path);
  return channels.empty() ? image : map_channels(image, channels);
}

std::optional<Image> read_if(const std::string& path) {
  if (path.empty()) return std::nullopt;
  return read_image(path);
}

/// Standard error of a mean from the variance of its samples.
std::optional<Image> standard_error(const std::string& path, double samples) {
  auto image = read_if(path);
  if (image)
    for (auto& channel : image->channels)
      for (float& v : channel.samples)  // a negative variance is none: NaN, which never passes
        v = static_cast<float>(std::sqrt(v / samples));
  return image;
}

Uncertainties read_uncertainties(const ComparisonArguments& a) {
  Uncertainties u{read_if(a.test_uncertainty), read_if(a.reference_uncertainty),
                  read_if(a.error_bound), read_if(a.mask)};
  if (!a.test_variance.empty()) u.test = standard_error(a.test_variance, a.test_samples);
  if (!a.reference_variance.empty())
    u.reference = standard_error(a.reference_variance, a.reference_samples);
  return u;
}

const Image* pointer(const std::optional<Image>& image) { return image ? &*image : nullptr; }

DifferenceMap make_map(const ComparisonArguments& a, const Uncertainties& u, const Image& test,
                       const Image& reference) {
  DifferenceOptions options;
  options.band_nm = a.band_nm;
  options.test_uncertainty = pointer(u.test);
  options.reference_uncertainty = pointer(u.reference);
  options.test_error_bound = pointer(u.bound);
  options.mask = pointer(u.mask);
  options.calibration_relative = a.calibration;
  options.test_samples = a.test_samples;
  options.reference_samples = a.reference_samples;
  return difference_map(test, reference, options);
}

/// The numbers behind the pictures, for the page; one band of several has none.
std::optional<ImageSet> numbers_of(const ComparisonArguments& a, const Uncertainties& u,
                                   const Image& test, const Image& reference,
                                   const std::vector<Region>& regions, const Observer* observer,
                                   double exposure) {
  if (a.band_nm) return std::nullopt;
  ImageSetOptions options;
  options.quantity = "value";
  options.exposure = exposure;
  options.observer = observer;
  std::vector<int> surface(reference.pixel_count(), -1);
  for (std::size_t r = 0; r < regions.size(); ++r) {
    options.surfaces.push_back(regions[r].name);
    for (std::size_t i : regions[r].pixels) surface[i] = static_cast<int>(r);
  }
  if (!regions.empty()) options.surface_of_pixel = surface;
  const Image* test_u = u.test ? &*u.test : pointer(u.bound);
  return make_image_set(
      {"Test", &test, test_u, u.test ? UncertaintyKind::standard : UncertaintyKind::bound},
      {"Reference", &reference, pointer(u.reference)}, options);
}

std::map<int, std::string> region_names(const std::string& path) {
  std::map<int, std::string> names;
  if (path.empty()) return names;
  const TableFile table = read_table(path);
  const std::size_t id = table.column_index("id"), name = table.column_index("name");
  for (std::size_t row = 0; row < table.rows.size(); ++row)
    names[static_cast<int>(table.number(row, id))] = table.rows[row][name];
  return names;
}

std::vector<Region> read_regions(const ComparisonArguments& a, const DifferenceMap& map) {
  std::vector<Region> regions;
  if (!a.regions.empty())
    regions = regions_from_ids(read_image(a.regions), region_names(a.region_names), map.width,
                               map.height);
  for (const std::string& text : a.region_masks) {
    const std::size_t equals = text.find('=');
    regions.push_back(region_from_mask(text.substr(0, equals), read_image(text.substr(equals + 1)),
                                       map.width, map.height));
  }
  return regions;
}

std::optional<Observer> chosen_observer(const std::string& name, const Image& a, const Image& b) {
  if (spectral_channels(a).indices.size() < 2 && spectral_channels(b).indices.size() < 2)
    return std::nullopt;
  const std::filesystem::path folder = std::filesystem::path(reference_directory()) / "colour";
  if (name == "1964") return read_observer(folder / "cie1964_10deg_xyz.csv", "CIE 1964 10 deg");
  if (name == "2015-2") return read_observer(folder / "cie2015_2deg_xyz.csv", "CIE 2015 2 deg");
  if (name == "2015-10") return read_observer(folder / "cie2015_10deg_xyz.csv", "CIE 2015 10 deg");
  return read_observer(folder / "cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
}

void add_colours(const ComparisonArguments& a, const Image& test, const Image& reference,
                 const Observer* observer, Comparison& c) {
  auto t = scene_linear(test, observer);
  auto r = scene_linear(reference, observer);
  if (!t || !r) {
    c.left_out.push_back(
        "No colours and no colour differences: neither R, G, B nor two spectral bands.");
    return;
  }
  // The largest of the three channels, so that a warm light is not shown clipped.
  std::vector<float> brightest = r->rgb.channels[0].samples;
  for (const auto& channel : r->rgb.channels)
    for (std::size_t i = 0; i < brightest.size(); ++i)
      brightest[i] = std::max(brightest[i], channel.samples[i]);
  const double exposure =
      a.exposure_stops ? std::exp2(*a.exposure_stops) : exposure_for_quantile(brightest, 0.95);
  c.colours = ComparedColours{std::move(*t), std::move(*r), exposure};
}

RgbPlanes planes_of(const Image& rgb) {
  return {rgb.channels[0].samples, rgb.channels[1].samples, rgb.channels[2].samples};
}

void add_metrics(const ComparisonArguments& a, Comparison& c) {
  const auto bands = std::count_if(c.map.channels.begin(), c.map.channels.end(),
                                   [](const auto& channel) { return channel.wavelength_nm > 0.0; });
  if (bands > 1) c.metrics.push_back(spectral_angle(c.map));
  if (!c.colours) return;
  if (a.no_perceptual) {
    c.left_out.push_back("Colour differences, FLIP and SSIM: --no-perceptual.");
    return;
  }
  auto maps = perceptual_maps(c.map.width, c.map.height, planes_of(c.colours->test.rgb),
                              planes_of(c.colours->reference.rgb),
                              {c.colours->exposure, a.white_cd_m2, a.pixels_per_degree});
  for (MetricMap& map : maps) c.metrics.push_back(std::move(map));
}

std::vector<Limit> limits_of(const ComparisonArguments& a) {
  std::vector<Limit> limits;
  if (a.warn || a.fail || (a.limits.empty() && !a.statistical)) {
    const char* scale = a.relative  ? "relative"
                        : a.percent ? "percent"
                        : a.sigmas  ? "sigmas"
                                    : "absolute";
    const double fail = a.fail.value_or(a.warn.value_or(0.0));
    limits.push_back({scale, a.warn.value_or(fail), fail, a.outliers});
  }
  for (const std::string& text : a.limits) limits.push_back(parse_limit(text));
  return limits;
}

}  // namespace

Comparison compare(const ComparisonArguments& a) {
  const Image test = read_mapped(a.test, a.test_channels);
  const Image reference = read_mapped(a.reference, a.reference_channels);
  const Uncertainties uncertainties = read_uncertainties(a);
  Comparison c;
  c.map = make_map(a, uncertainties, test, reference);
  c.statistics = difference_statistics(c.map);
  if (c.map.has_uncertainty())
    c.significance = significance(c.map, {a.coverage_factor, a.level, a.outliers});
  c.significance_judges = a.statistical;
  const auto observer = chosen_observer(a.observer, test, reference);
  add_colours(a, test, reference, observer ? &*observer : nullptr, c);
  add_metrics(a, c);
  for (const Limit& limit : limits_of(a)) {
    try {
      c.limits.push_back(apply_limit(limit, c.map, c.statistics, c.metrics));
    } catch (const std::invalid_argument& error) {  // the limit does not fit these images
      throw MismatchError(error.what());
    }
  }
  const auto regions = read_regions(a, c.map);
  c.region_count = regions.size();
  c.regions = region_differences(c.map, regions);
  c.image_set = numbers_of(a, uncertainties, test, reference, regions,
                           observer ? &*observer : nullptr, c.colours ? c.colours->exposure : 1.0);
  return c;
}

}  // namespace truebox::app
