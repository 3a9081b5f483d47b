// SPDX-License-Identifier: BSD-3-Clause
#include "fit/chart_measurement.h"

#include <algorithm>
#include <cmath>

#include "fit/chart_blocks.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

// Half way up the range of the exposures that carry most of the weight.
constexpr double kTypicalReading_dn = 120.0;

struct BandContext {
  const MeasurementFile& file;
  const Chart& chart;
  const InstrumentEstimate& instrument;
  std::vector<std::uint8_t> labels;  ///< eroded
  ChartFrame frame;
};

bool is_standard(const MeasurementFile& file, const std::string& patch) {
  const auto& names = file.known.patches;
  return std::find(names.begin(), names.end(), patch) != names.end();
}

double spectrometer_u(const KnownStandards& known, double value) {
  return std::hypot(known.relative_uncertainty * value, known.absolute_uncertainty);
}

std::vector<BandReflectance> references(const Chart& chart, const BandPass& band) {
  std::vector<BandReflectance> values;
  for (const auto& spectrum : chart.reflectance) values.push_back(band_reflectance(spectrum, band));
  return values;
}

ChartProblem make_problem(const BandContext& context, const Photograph& photograph, char site,
                          const std::vector<BandReflectance>& reference) {
  ChartProblem problem;
  problem.patches = context.chart.patches;
  problem.blocks = chart_blocks(photograph, site, context.labels, context.file.fit.block_px,
                                context.file.fit.block_uncertainty, context.frame);
  for (std::size_t p = 0; p < problem.patches.size(); ++p) {
    problem.standards.emplace_back();
    if (!is_standard(context.file, problem.patches[p])) continue;
    const double value = reference[p].value;
    problem.standards[p] = Estimate{value, spectrometer_u(context.file.known, value)};
  }
  return problem;
}

std::vector<ChartFit> fit_orders(const ChartProblem& problem, const std::vector<int>& orders,
                                 bool veil) {
  std::vector<ChartFit> fits;
  for (int order : orders)
    fits.push_back(fit_chart(problem, {.field_order = order, .fit_veil = veil}));
  return fits;
}

bool all_usable(const std::vector<ChartFit>& fits) {
  return std::all_of(fits.begin(), fits.end(),
                     [](const ChartFit& fit) { return fit.summary.usable(); });
}

double mean_reflectance(const std::vector<ChartFit>& fits, std::size_t p) {
  double sum = 0.0;
  for (const ChartFit& fit : fits) sum += fit.reflectance[p].value;
  return sum / static_cast<double>(fits.size());
}

/// Half the range over the field orders: the data do not decide between them.
double order_spread(const std::vector<ChartFit>& fits, std::size_t p) {
  const auto [low, high] =
      std::minmax_element(fits.begin(), fits.end(), [p](const ChartFit& a, const ChartFit& b) {
        return a.reflectance[p].value < b.reflectance[p].value;
      });
  return 0.5 * (high->reflectance[p].value - low->reflectance[p].value);
}

double largest_fit_u(const std::vector<ChartFit>& fits, std::size_t p) {
  double u = 0.0;
  for (const ChartFit& fit : fits) u = std::max(u, fit.reflectance[p].standard_uncertainty);
  return u;
}

PatchReading read_patch(const BandContext& context, const BandMeasurement& band,
                        const std::vector<ChartFit>& other, const BandReflectance& reference,
                        std::size_t p) {
  PatchReading reading;
  reading.patch = context.chart.patches[p];
  reading.standard = is_standard(context.file, reading.patch);
  for (const ChartFit& fit : band.fits) reading.at_bound = reading.at_bound || fit.at_bound[p];
  const double measured = mean_reflectance(band.fits, p);
  auto& budget = reading.measured_budget;
  budget.add("fit: noise, texture, standards", largest_fit_u(band.fits, p));
  budget.add("illumination model", order_spread(band.fits, p));
  // What is left out of the model is not free of uncertainty: half of what it would have changed.
  budget.add("veil left out", band.veil_kept || !all_usable(other)
                                  ? 0.0
                                  : 0.5 * std::abs(mean_reflectance(other, p) - measured));
  budget.add("camera response",
             context.instrument.curvature_scatter_per_dn * kTypicalReading_dn * measured);
  reading.measured = {measured, reading.at_bound ? 0.0 : budget.combined()};
  auto& known = reading.reference_budget;
  known.add("spectrometer", spectrometer_u(context.file.known, reference.value));
  known.add("band centre",
            std::abs(reference.slope_per_nm) * band.band.centre_nm.standard_uncertainty);
  reading.reference = {reference.value, known.combined()};
  reading.en = en_score(reading.measured, reading.reference);
  return reading;
}

void score(BandMeasurement& band, const std::vector<BandReflectance>& unshifted) {
  double squares = 0.0, squares_unshifted = 0.0;
  for (std::size_t p = 0; p < band.readings.size(); ++p) {
    const PatchReading& r = band.readings[p];
    if (r.standard) continue;
    squares += std::pow(r.measured.value - r.reference.value, 2);
    squares_unshifted += std::pow(r.measured.value - unshifted[p].value, 2);
    band.largest_en = std::max(band.largest_en, std::abs(r.en.value));
    band.agreeing += r.en.agrees() && !r.at_bound;
    ++band.held_out;
  }
  const double n = std::max<double>(1.0, static_cast<double>(band.held_out));
  band.rms = std::sqrt(squares / n);
  band.rms_measured_centre = std::sqrt(squares_unshifted / n);
  for (const ChartFit& fit : band.fits)
    band.chi2_per_dof = std::max(band.chi2_per_dof, fit.summary.chi2_per_dof);
}

SiteEvidence site_evidence(const BandContext& context, const BandMeasurement& band, char site,
                           const std::vector<BandReflectance>& reference) {
  SiteEvidence evidence{.site = site, .used = site == band.site};
  const auto problem = make_problem(context, band.merge.photograph, site, reference);
  const ChartFit fit = fit_chart(
      problem, {.field_order = context.file.fit.field_orders[0], .fit_veil = band.veil_kept});
  for (const PatchBlock& b : problem.blocks)
    if (problem.standards[b.patch])
      evidence.white_dn = std::max(evidence.white_dn, b.value * band.merge.photograph.longest_s);
  if (!fit.summary.usable()) return evidence;
  double squares[2] = {0.0, 0.0}, n[2] = {0.0, 0.0};  // held out, standards
  for (std::size_t p = 0; p < problem.patches.size(); ++p) {
    const int known = problem.standards[p] ? 1 : 0;
    squares[known] += std::pow(fit.reflectance[p].value - reference[p].value, 2);
    n[known] += 1.0;
  }
  evidence.held_out_rms = n[0] > 0.0 ? std::sqrt(squares[0] / n[0]) : 0.0;
  evidence.standards_rms = n[1] > 0.0 ? std::sqrt(squares[1] / n[1]) : 0.0;
  return evidence;
}

ChartPlanes make_planes(const BandContext& context, const BandMeasurement& band) {
  const Photograph& photograph = band.merge.photograph;
  const CellPlane cells = cell_plane(photograph, band.site);
  ChartPlanes planes;
  planes.width = cells.width;
  planes.height = cells.height;
  planes.patch = cell_labels(context.labels, photograph.width, photograph.height);
  const std::size_t n = cells.value.size();
  planes.prediction.assign(n, 0.0f);
  planes.prediction_variance.assign(n, 0.0f);
  double gain = 0.0;
  for (const ChartFit& fit : band.fits) gain += fit.gain / static_cast<double>(band.fits.size());
  for (std::size_t i = 0; i < n; ++i) {
    planes.photograph.push_back(static_cast<float>(cells.value[i] / gain));
    planes.photograph_variance.push_back(static_cast<float>(cells.variance[i] / (gain * gain)));
    if (planes.patch[i] == 0) continue;
    const double x =
        context.frame.x(2.0 * static_cast<double>(i % static_cast<std::size_t>(cells.width)) + 1.0);
    const double y =
        context.frame.y(2.0 * static_cast<double>(i / static_cast<std::size_t>(cells.width)) + 1.0);
    double light = 0.0;
    for (const ChartFit& fit : band.fits)
      light += fit.gain / gain * fit.illumination(x, y) / static_cast<double>(band.fits.size());
    const PatchReading& r = band.readings[planes.patch[i] - std::size_t{1}];
    const double veil = band.veil_kept ? band.veil.value : 0.0;
    planes.prediction[i] = static_cast<float>((r.reference.value + veil) * light);
    const double u = std::hypot(r.reference.standard_uncertainty, r.measured_budget.combined());
    planes.prediction_variance[i] = static_cast<float>(u * u * light * light);
  }
  return planes;
}

void fit_band(const BandContext& context, const BandFiles& files, BandMeasurement& band) {
  band.name = files.name;
  band.note = files.note;
  band.site = files.site;
  band.band = band_pass(files, context.file.known.centre_uncertainty_nm);
  const auto reference = references(context.chart, band.band);
  const auto problem = make_problem(context, band.merge.photograph, band.site, reference);
  const auto& orders = context.file.fit.field_orders;
  std::vector<ChartFit> plain = fit_orders(problem, orders, false);
  std::vector<ChartFit> veiled = fit_orders(problem, orders, true);
  if (all_usable(veiled)) {
    band.veil_kept = true;
    for (const ChartFit& fit : veiled) {
      band.veil.value += fit.veil.value / static_cast<double>(veiled.size());
      band.veil.standard_uncertainty =
          std::max(band.veil.standard_uncertainty, fit.veil.standard_uncertainty);
      band.veil_kept =
          band.veil_kept && std::abs(fit.veil.value) >
                                context.file.fit.veil_threshold * fit.veil.standard_uncertainty;
    }
  }
  band.fits = band.veil_kept ? veiled : plain;
  band.outcome = Outcome::converged;
  for (const ChartFit& fit : band.fits) band.outcome = std::min(band.outcome, fit.summary.outcome);
  for (char site : {'R', 'G', 'B'})
    band.sites.push_back(site_evidence(context, band, site, reference));
  if (band.outcome != Outcome::converged) return;
  for (std::size_t p = 0; p < context.chart.patches.size(); ++p)
    band.readings.push_back(
        read_patch(context, band, band.veil_kept ? plain : veiled, reference[p], p));
  BandPass unshifted = band.band;
  std::vector<double> nm = unshifted.transmission.wavelengths_nm();
  for (double& x : nm) x -= band.band.centre_nm.value - band.band.measured_centre_nm;
  unshifted.transmission = {nm, band.band.transmission.values()};
  score(band, references(context.chart, unshifted));
  band.planes = make_planes(context, band);
}

}  // namespace

ChartMeasurement measure_chart(const MeasurementFile& file, const Progress& progress) {
  if (!file.has_chart())
    throw InputError(file.path, 0, "[chart] and [known], which a fit of reflectances needs",
                     "none");
  ChartMeasurement measurement;
  measurement.file = file;
  measurement.chart =
      read_chart(file.chart.labels_path, file.chart.reflectance_path, file.chart.patches);
  const Chart& chart = measurement.chart;
  LinearPhotographs linear = merge_photographs(file, chart, progress);
  measurement.instrument = std::move(linear.instrument);
  BandContext context{.file = file,
                      .chart = chart,
                      .instrument = measurement.instrument,
                      .labels = eroded_labels(chart, file.chart.margin_px),
                      .frame = chart_frame(chart.labels, chart.width, chart.height)};
  for (std::size_t b = 0; b < file.bands.size(); ++b) {
    if (progress)
      progress("fit " + file.bands[b].name,
               0.6 + 0.4 * static_cast<double>(b) / static_cast<double>(file.bands.size()));
    BandMeasurement& band = measurement.bands.emplace_back();
    band.merge = std::move(linear.bands[b]);
    fit_band(context, file.bands[b], band);
  }
  if (progress) progress("done", 1.0);
  return measurement;
}

Outcome ChartMeasurement::outcome() const {
  Outcome worst = bands.empty() ? Outcome::not_run : Outcome::converged;
  for (const auto& band : bands) worst = std::min(worst, band.outcome);
  return worst;
}

std::size_t ChartMeasurement::agreeing() const {
  std::size_t n = 0;
  for (const auto& band : bands) n += band.agreeing;
  return n;
}

std::size_t ChartMeasurement::held_out() const {
  std::size_t n = 0;
  for (const auto& band : bands) n += band.held_out;
  return n;
}

MissingContribution ChartMeasurement::missing() const {
  std::vector<ComparedPair> pairs;
  for (const auto& band : bands)
    for (const PatchReading& r : band.readings)
      if (!r.standard) pairs.push_back({r.measured, r.reference});
  return missing_contribution(pairs);
}

}  // namespace truebox
