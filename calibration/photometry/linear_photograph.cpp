// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "photometry/calibration_frames.h"
#include "radiometry/input_error.h"
#include "readings/chart.h"

namespace truebox::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHalfStepRectangular = 0.2887;  // 0.5 / sqrt(3), in steps

/// What one photosite's common uncertainty is made of, DN s^-1 (after the flat field).
struct CommonParts {
  double offset = 0.0, response = 0.0, exposures = 0.0, times = 0.0, flat = 0.0, glare = 0.0;
  double combined() const {
    return std::sqrt(offset * offset + response * response + exposures * exposures + times * times +
                     flat * flat + glare * glare);
  }
};

/// The systematic side of the instrument, ready for each photosite.
struct CommonModel {
  double offset_u_dn = 0.0, curvature_u_per_dn = 0.0, exposures_u = 0.0, times_u = 0.0;
  const CameraResponse* response = nullptr;

  CommonParts parts(double rate, double effective_s) const {
    CommonParts p;
    const double signal = rate * effective_s;
    if (response->table_dn.empty()) {
      p.response = curvature_u_per_dn * signal * signal / effective_s;
    } else {
      const auto k = std::min(static_cast<std::size_t>(std::lround(response->reading_dn(signal))),
                              response->table_dn.size() - 1);
      p.response = response->table_dn[k].standard_uncertainty / effective_s;
    }
    p.offset = offset_u_dn / effective_s;
    p.exposures = exposures_u * std::abs(rate);
    p.times = times_u * std::abs(rate);
    return p;
  }
};

/// Scatter of the exposures about their merged rate: times, lamp, what the response leaves.
double exposure_scatter(const std::vector<double>& mean_ratio) {
  double n = 0.0, squares = 0.0;
  for (double ratio : mean_ratio) {
    if (!(ratio > 0.0)) continue;
    n += 1.0;
    squares += (ratio - 1.0) * (ratio - 1.0);
  }
  return n > 1.0 ? std::sqrt(squares / (n - 1.0)) : 0.0;
}

CommonModel common_model(const MeasurementFile& file, const InstrumentCalibration& instrument,
                         const MergeResult& merge) {
  CommonModel model;
  model.response = &instrument.response;
  model.times_u = file.instrument.exposure_uncertainty;
  model.exposures_u = exposure_scatter(merge.mean_ratio);
  if (!instrument.response.table_dn.empty()) return model;
  const CameraResponse& seen = instrument.linearity.response;
  if (file.instrument.response == "fitted") {
    model.offset_u_dn = instrument.response.offset_dn.standard_uncertainty;
    model.curvature_u_per_dn = instrument.response.curvature_per_dn.standard_uncertainty;
  } else {  // what the series show and the file does not correct for
    model.offset_u_dn = std::hypot(seen.offset_dn.value, seen.offset_dn.standard_uncertainty);
    model.curvature_u_per_dn =
        std::hypot(seen.curvature_per_dn.value, seen.curvature_per_dn.standard_uncertainty);
  }
  // Without exposure series the black level is known to the darks' rounding at best.
  if (instrument.linearity.readings == 0)
    model.offset_u_dn = kHalfStepRectangular * file.instrument.step_dn;
  return model;
}

void require_inside(const Region& r, const LinearPhotograph& p, const MeasurementFile& file,
                    const std::string& what) {
  if (r.x + r.width > p.width || r.y + r.height > p.height)
    throw InputError(file.path, 0,
                     what + " inside of the photographs of " + std::to_string(p.width) + " x " +
                         std::to_string(p.height) + " px",
                     "[" + std::to_string(r.x) + ", " + std::to_string(r.y) + ", " +
                         std::to_string(r.width) + ", " + std::to_string(r.height) + "]");
}

bool counts(const LinearPhotograph& p, std::size_t i) {
  return p.flags[i] == 0 && std::isfinite(p.u_noise[i]) && std::isfinite(p.value[i]);
}

/// Mean and its noise over the photosites of one colour that lie in a set of pixels.
struct RegionMean {
  double mean = 0.0, u_noise = 0.0, u_common = 0.0;
  std::size_t n = 0;
};

template <class Inside>
RegionMean region_mean(const LinearPhotograph& p, const Instrument& instrument, char site,
                       const Inside& inside) {
  RegionMean m;
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) +
                            static_cast<std::size_t>(x);
      if (!inside(x, y, i) || !counts(p, i)) continue;
      if (instrument.mosaic && instrument.bayer.site(x, y) != site) continue;
      m.mean += p.value[i];
      m.u_noise += double{p.u_noise[i]} * p.u_noise[i];
      m.u_common += p.u_common[i];
      ++m.n;
    }
  if (m.n == 0) return m;
  const double n = static_cast<double>(m.n);
  m.mean /= n;
  m.u_noise = std::sqrt(m.u_noise) / n;
  m.u_common /= n;
  return m;
}

auto inside_of(const Region& r) {
  return [r](int x, int y, std::size_t) {
    return x >= r.x && y >= r.y && x < r.x + r.width && y < r.y + r.height;
  };
}

/// Veiling glare of each colour, and what is not known of it.
std::map<char, Estimate> glare_of(const LinearPhotograph& p, const MeasurementFile& file) {
  std::map<char, Estimate> glare;
  if (file.glare.region.width == 0) return glare;
  require_inside(file.glare.region, p, file, "[glare] region");
  for (char site : file.instrument.mosaic ? std::string("RGB") : std::string("Y")) {
    const RegionMean m = region_mean(p, file.instrument, site, inside_of(file.glare.region));
    if (m.n == 0)
      throw InputError(file.path, 0, "[glare] region with photosites that measure",
                       "none of site " + std::string(1, site) + " in " + p.band);
    glare[site] = {m.mean, std::hypot(m.mean * file.glare.uncertainty, m.u_noise)};
  }
  return glare;
}

const AbsoluteScale* scale_of(const MeasurementFile& file, const std::string& band) {
  for (const AbsoluteScale& scale : file.scales)
    if (scale.band.empty() || scale.band == band) return &scale;
  return nullptr;
}

void apply_scale(LinearPhotograph& p, const MeasurementFile& file, const BandFrames& band) {
  const AbsoluteScale* scale = scale_of(file, band.files->name);
  if (!scale) scale = scale_of(file, band.name);
  if (!scale) return;
  const char site = band.files->site;
  RegionMean m;
  if (scale->patch.empty()) {
    require_inside(scale->region, p, file, "[[scale]] region");
    m = region_mean(p, file.instrument, site, inside_of(scale->region));
  } else {
    const Chart chart =
        read_chart(file.chart.labels_path, file.chart.reflectance_path, file.chart.patches);
    if (chart.width != p.width || chart.height != p.height)
      throw MismatchError("the chart's label image has another size than the photographs");
    const auto labels = eroded_labels(chart, file.chart.margin_px);
    const auto label = static_cast<std::uint8_t>(chart.index_of(scale->patch) + 1);
    m = region_mean(p, file.instrument, site,
                    [&](int, int, std::size_t i) { return labels[i] == label; });
  }
  if (m.n == 0 || !(m.mean > 0.0))
    throw InputError(file.path, 0, "[[scale]] region with light in it", "none in " + p.band);
  const double factor = scale->value.value / m.mean;
  const double relative =
      std::hypot(scale->value.standard_uncertainty / scale->value.value, m.u_noise / m.mean);
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    p.value[i] = static_cast<float>(p.value[i] * factor);
    p.u_noise[i] = static_cast<float>(p.u_noise[i] * factor);
    p.u_common[i] = static_cast<float>(std::hypot(p.u_common[i] * factor, p.value[i] * relative));
  }
  p.unit = scale->unit;
  p.reference_value *= factor;
  p.glare = {p.glare.value * factor, p.glare.standard_uncertainty * factor};
  UncertaintyBudget noise, common;
  for (const auto& c : p.noise_budget.contributions())
    noise.add(c.name, c.standard_uncertainty * factor);
  for (const auto& c : p.common_budget.contributions())
    common.add(c.name, c.standard_uncertainty * factor);
  common.add("absolute scale", std::abs(p.reference_value) * relative);
  p.noise_budget = noise;
  p.common_budget = common;
}

/// The photosite whose value is the median of those of the band's colour that count.
std::optional<std::size_t> reference_photosite(const LinearPhotograph& p,
                                               const Instrument& instrument, char site) {
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    const int x = static_cast<int>(i) % p.width, y = static_cast<int>(i) / p.width;
    if (counts(p, i) && (!instrument.mosaic || instrument.bayer.site(x, y) == site))
      of.push_back(i);
  }
  if (of.empty()) return std::nullopt;
  const auto middle = of.begin() + static_cast<long>(of.size() / 2);
  std::nth_element(of.begin(), middle, of.end(),
                   [&](std::size_t a, std::size_t b) { return p.value[a] < p.value[b]; });
  return *middle;
}

MergeOptions merge_options(const MeasurementFile& file, const InstrumentCalibration& instrument) {
  MergeOptions options{.saturation_dn = file.instrument.saturation_dn,
                       .floor_dn = file.instrument.floor_dn,
                       .noise = instrument.noise.front().model,
                       .noise_of_site = {},
                       .response = instrument.response,
                       .linearity_mask = {}};
  if (file.instrument.mosaic)
    for (const SiteNoise& noise : instrument.noise) options.noise_of_site[noise.site] = noise.model;
  if (instrument.curve.found) {  // beyond the readings that were seen the curve is a guess
    options.saturation_dn =
        std::min(options.saturation_dn, static_cast<double>(instrument.curve.highest));
    options.floor_dn = std::max(options.floor_dn, static_cast<double>(instrument.curve.lowest));
  }
  for (std::size_t i = 0; i < instrument.defects.flags.size(); ++i)
    options.linearity_mask.push_back(instrument.defects.flags[i] == 0 &&
                                     (instrument.labels.empty() || instrument.labels[i] != 0));
  return options;
}

}  // namespace

LinearPhotograph linear_photograph(const MeasurementFile& file,
                                   const InstrumentCalibration& instrument,
                                   const BandFrames& band) {
  const MergeResult merge = merge_exposures(band.frames, instrument.darks, file.instrument.bayer,
                                            merge_options(file, instrument));
  LinearPhotograph p;
  p.band = band.name;
  p.width = merge.photograph.width;
  p.height = merge.photograph.height;
  p.exposures_used = merge.photograph.exposures_used;
  p.exposures_s = merge.exposures_s;
  p.mean_ratio = merge.mean_ratio;
  p.chi2_per_dof = merge.chi2_per_dof;
  p.dof = merge.dof;
  const std::size_t n = merge.photograph.value.size();
  p.value.resize(n);
  p.u_noise.resize(n);
  p.u_common.resize(n);
  p.flags = instrument.defects.flags;
  p.flags.resize(n, 0);
  const CommonModel common = common_model(file, instrument, merge);
  const FlatField& flat = instrument.flat;
  std::vector<CommonParts> parts(n);
  std::vector<float> merge_u(n), flat_u(n, 0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    const double relative = flat.relative.empty() ? 1.0 : double{flat.relative[i]};
    const double rate = merge.photograph.value[i];
    if (p.exposures_used[i] == 0 && !std::isfinite(merge.photograph.variance[i])) {
      p.flags[i] |= kSaturatedPhotosite;
      ++p.saturated;
    } else if (p.exposures_used[i] == 0) {
      p.flags[i] |= kBelowFloorPhotosite;
      ++p.below_floor;
    }
    parts[i] = common.parts(rate, merge.effective_s[i]);
    p.value[i] = static_cast<float>(rate / relative);
    merge_u[i] = static_cast<float>(std::sqrt(merge.photograph.variance[i]) / relative);
    if (!flat.relative.empty()) {
      for (double* u : {&parts[i].offset, &parts[i].response, &parts[i].exposures, &parts[i].times})
        *u /= relative;
      flat_u[i] = std::abs(p.value[i]) * flat.u_noise[i];
      parts[i].flat = std::abs(p.value[i]) * flat.u_common[i];
    }
    const bool unusable = (p.flags[i] & ~std::uint8_t{kBelowFloorPhotosite}) != 0;
    p.u_noise[i] =
        static_cast<float>(unusable ? kInfinity : std::hypot(double{merge_u[i]}, flat_u[i]));
  }
  const auto glare = glare_of(p, file);
  for (std::size_t i = 0; i < n; ++i) {
    const int x = static_cast<int>(i) % p.width, y = static_cast<int>(i) / p.width;
    const auto own = glare.find(file.instrument.mosaic ? file.instrument.bayer.site(x, y) : 'Y');
    if (own != glare.end()) {
      p.value[i] = static_cast<float>(p.value[i] - own->second.value);
      parts[i].glare = own->second.standard_uncertainty;
    }
    p.u_common[i] = static_cast<float>(parts[i].combined());
  }
  const char site = file.instrument.mosaic ? band.files->site : 'Y';
  if (glare.contains(site)) p.glare = glare.at(site);
  if (const auto at = reference_photosite(p, file.instrument, site)) {
    p.reference_value = p.value[*at];
    p.noise_budget.add("photons, read-out, rounding and dark", merge_u[*at]);
    p.noise_budget.add("noise of the flat field", flat_u[*at]);
    const CommonParts& c = parts[*at];
    p.common_budget.add("black level", c.offset);
    p.common_budget.add("response curve", c.response);
    p.common_budget.add("agreement of the exposures", c.exposures);
    p.common_budget.add("exposure times", c.times);
    p.common_budget.add("flat field", c.flat);
    p.common_budget.add("glare", c.glare);
  }
  apply_scale(p, file, band);
  return p;
}

}  // namespace truebox::detail
