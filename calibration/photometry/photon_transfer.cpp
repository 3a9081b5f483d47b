// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/photon_transfer.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

constexpr std::size_t kFewestPhotosites = 12, kFewestSamples = 20;
constexpr double kOutlier_sigma = 3.3;  // one in 2000 by chance

double prediction(const NoiseModel& model, const PairSample& s) {
  return std::max(model.floor_dn2 * s.floor_weight + model.gain_dn * s.gain_weight, 1e-12);
}

/// A score that is normal where noise is all there is (Wilson, Hilferty 1931: the cube root of
/// chi^2 / nu).
double score(const NoiseModel& model, const PairSample& s) {
  const double spread = 2.0 / (9.0 * static_cast<double>(s.dof));
  return (std::cbrt(s.variance_dn2 / prediction(model, s)) - (1.0 - spread)) / std::sqrt(spread);
}

/// The score beyond which a sample is an outlier: 3.3 of what the bulk of them scatters, which is
/// more than noise where rounding is coarser than noise and repeats from photosite to photosite.
double outlier_limit(const NoiseModel& model, const std::vector<PairSample>& samples) {
  std::vector<double> scores;
  for (const PairSample& s : samples) scores.push_back(std::abs(score(model, s)));
  const auto middle = scores.begin() + static_cast<long>(scores.size() / 2);
  std::nth_element(scores.begin(), middle, scores.end());
  return kOutlier_sigma * std::max(1.0, 1.4826 * *middle);
}

struct Block {
  int x = 0, y = 0;
};

class Pairs {
 public:
  Pairs(const Frame& a, const Frame& b, const BlockOptions& o)
      : a_(a), b_(b), o_(o), dark_a_(o.dark_of(a)), dark_b_(o.dark_of(b)) {}

  /// The sample of one colour; dof 0 if there is none. `odd` picks the photosites of the mosaic.
  PairSample sample(const Block& block, int odd_x, int odd_y, int stride) const {
    PairSample s;
    double sum_a = 0.0, sum_b = 0.0;
    std::vector<std::pair<double, double>> signals;
    for (int y = block.y + odd_y; y < block.y + o_.block_px; y += stride)
      for (int x = block.x + odd_x; x < block.x + o_.block_px; x += stride) {
        const std::size_t i = a_.image.index(x, y);
        if (o_.is_excluded(i)) continue;
        if (!(reading(a_, i) >= o_.floor_dn && reading(b_, i) >= o_.floor_dn)) return s;
        signals.emplace_back(signal(a_, dark_a_, i), signal(b_, dark_b_, i));
        sum_a += signals.back().first;
        sum_b += signals.back().second;
      }
    const double n = static_cast<double>(signals.size());
    if (signals.size() < kFewestPhotosites || !(sum_a > 0.0) || !(sum_b > 0.0)) return s;
    const double r = sum_b / sum_a;
    double squares = 0.0;
    for (const auto& [a, b] : signals) squares += (b - r * a) * (b - r * a);
    s.site = o_.site(block.x + odd_x, block.y + odd_y);
    s.mean_dn = sum_b / n;
    s.dof = signals.size() - 1;
    s.variance_dn2 = squares / (n - 1.0);
    const double slope_a = o_.response.slope(sum_a / n), slope_b = o_.response.slope(sum_b / n);
    s.floor_weight = 1.0 / (slope_b * slope_b) + r * r / (slope_a * slope_a);
    s.gain_weight = sum_b / n / (slope_b * slope_b) + r * r * sum_a / n / (slope_a * slope_a);
    return s;
  }

 private:
  static double reading(const Frame& f, std::size_t i) { return f.image.channels[0].samples[i]; }

  double signal(const Frame& f, const MasterDark* dark, std::size_t i) const {
    return o_.response.linear_dn(reading(f, i) - (dark ? double{dark->mean_dn[i]} : 0.0));
  }

  const Frame& a_;
  const Frame& b_;
  const BlockOptions& o_;
  const MasterDark* dark_a_;
  const MasterDark* dark_b_;
};

struct Line {
  double ff = 0.0, fg = 0.0, gg = 0.0, fy = 0.0, gy = 0.0;
  double determinant() const { return ff * gg - fg * fg; }
};

Line normal_equations(const std::vector<PairSample>& samples, const std::vector<char>& use,
                      const NoiseModel& model) {
  Line line;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!use[i]) continue;
    const PairSample& s = samples[i];
    const double v = prediction(model, s), w = 0.5 * static_cast<double>(s.dof) / (v * v);
    line.ff += w * s.floor_weight * s.floor_weight;
    line.fg += w * s.floor_weight * s.gain_weight;
    line.gg += w * s.gain_weight * s.gain_weight;
    line.fy += w * s.floor_weight * s.variance_dn2;
    line.gy += w * s.gain_weight * s.variance_dn2;
  }
  return line;
}

NoiseModel solve(const Line& line) {
  NoiseModel model;
  const double d = line.determinant();
  model.floor_dn2 = (line.gg * line.fy - line.fg * line.gy) / d;
  model.gain_dn = (line.ff * line.gy - line.fg * line.fy) / d;
  if (model.gain_dn < 0.0) model = {line.fy / line.ff, 0.0};
  if (model.floor_dn2 < 0.0) model = {0.0, line.gy / line.gg};
  return model;
}

}  // namespace

std::vector<PairSample> pair_samples(const std::vector<Frame>& frames, std::size_t band,
                                     const BlockOptions& options) {
  std::vector<PairSample> samples;
  if (frames.size() < 2) return samples;
  const auto sorted = sorted_by_exposure(frames);
  const Image& image = sorted[0]->image;
  const int stride = options.stride();
  for (int y = 0; y + options.block_px <= image.height; y += options.block_px)
    for (int x = 0; x + options.block_px <= image.width; x += options.block_px) {
      std::vector<char> before(4, 0);
      for (std::size_t f = 0; f + 1 < sorted.size(); ++f) {
        const Pairs pairs(*sorted[f], *sorted[f + 1], options);
        if (!block_usable(*sorted[f + 1], x, y, options) ||
            !block_usable(*sorted[f], x, y, options))
          break;  // longer exposures are saturated too
        for (int k = 0; k < stride * stride; ++k) {
          PairSample s = pairs.sample({x, y}, k % stride, k / stride, stride);
          if (s.dof == 0) continue;
          s.band = band;
          s.shares_frame = before[static_cast<std::size_t>(k)] != 0;
          before[static_cast<std::size_t>(k)] = 1;
          samples.push_back(s);
        }
      }
    }
  return samples;
}

PhotonTransfer fit_photon_transfer(const std::vector<PairSample>& samples) {
  PhotonTransfer fit;
  fit.samples = samples.size();
  if (samples.size() < kFewestSamples) {
    fit.why_not = "only " + std::to_string(samples.size()) + " blocks serve in two exposures";
    return fit;
  }
  // Starts from the lower part of the samples: edges that moved only ever add variance.
  std::vector<double> level(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    level[i] = samples[i].variance_dn2 / (samples[i].floor_weight + 0.02 * samples[i].gain_weight);
  std::vector<double> ordered = level;
  std::nth_element(ordered.begin(), ordered.begin() + static_cast<long>(ordered.size() / 2),
                   ordered.end());
  const double middle = std::max(ordered[ordered.size() / 2], 1e-9);
  fit.model = {middle, 0.02 * middle};
  std::vector<char> use(samples.size());
  Line line;
  for (int pass = 0; pass < 20; ++pass) {
    fit.outliers = 0;
    const double limit = pass == 0 ? 0.0 : outlier_limit(fit.model, samples);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      use[i] = pass == 0 ? level[i] < 8.0 * middle + 1e-9 : score(fit.model, samples[i]) <= limit;
      fit.outliers += use[i] ? 0 : 1;
    }
    line = normal_equations(samples, use, fit.model);
    if (!(line.determinant() > 1e-6 * line.ff * line.gg)) {
      fit.why_not = "the signals are too alike to tell gain from read noise";
      return fit;
    }
    fit.model = solve(line);
  }
  double sum = 0.0, squares = 0.0, n = 0.0, shared = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!use[i]) continue;
    const double q = samples[i].variance_dn2 / prediction(fit.model, samples[i]);
    sum += q;
    squares += (q - 1.0) * (q - 1.0) * 0.5 * static_cast<double>(samples[i].dof);
    shared += samples[i].shares_frame ? 1.0 : 0.0;
    n += 1.0;
  }
  fit.chi2_per_dof = sum / n;
  fit.dispersion = squares / (n - 2.0);
  // In a chain of k pairs the first shares nothing: all but one of k share at most.
  const double enlarge = std::max(1.0, fit.dispersion) * (1.0 + 0.5 * shared / n);
  line = normal_equations(samples, use, fit.model);
  const double d = line.determinant();
  fit.floor_u_dn2 = std::sqrt(enlarge * line.gg / d);
  fit.gain_u_dn = std::sqrt(enlarge * line.ff / d);
  fit.correlation = -line.fg / std::sqrt(line.ff * line.gg);
  fit.found = true;
  return fit;
}

Estimate PhotonTransfer::read_noise_dn(double step_dn) const {
  const double variance = model.floor_dn2 - step_dn * step_dn * kQuantisationVariance_dn2;
  if (variance <= floor_u_dn2) return {std::sqrt(std::max(variance, 0.0)), std::sqrt(floor_u_dn2)};
  return {std::sqrt(variance), 0.5 * floor_u_dn2 / std::sqrt(variance)};
}

NoiseCheck check_noise(const NoiseModel& model, const std::vector<PairSample>& samples) {
  NoiseCheck check;
  if (samples.empty()) return check;
  const double limit = outlier_limit(model, samples);
  double sum = 0.0, squares = 0.0;
  for (const PairSample& s : samples) {
    const double q = s.variance_dn2 / prediction(model, s);
    if (score(model, s) > limit) {
      ++check.outliers;
      continue;
    }
    ++check.samples;
    sum += q;
    squares += q * q;
  }
  const double n = static_cast<double>(check.samples);
  if (check.samples == 0) return check;
  check.chi2_per_dof = sum / n;
  if (check.samples > 1)
    check.u =
        std::sqrt(std::max(squares / n - check.chi2_per_dof * check.chi2_per_dof, 0.0) / (n - 1.0));
  return check;
}

}  // namespace truebox
