// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/camera_response.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace truebox {
namespace {

double sigma_dn(double reading) { return 0.3 + 0.004 * std::abs(reading); }

struct Normal {
  std::array<double, 2> gradient{};
  std::array<double, 3> matrix{};  // oo, ok, kk
  double chi2 = 0.0;
};

/// The rate that fits one series best, by Newton's method from the linear estimate.
double best_rate(const ExposureSeries& s, double offset, double curvature) {
  double rate = 0.0, top = 0.0, bottom = 0.0;
  for (std::size_t i = 0; i < s.exposures_s.size(); ++i) {
    const double w = 1.0 / std::pow(sigma_dn(s.readings_dn[i]), 2);
    top += w * s.exposures_s[i] * (s.readings_dn[i] - offset);
    bottom += w * s.exposures_s[i] * s.exposures_s[i];
  }
  rate = top / bottom;
  for (int step = 0; step < 8; ++step) {
    top = bottom = 0.0;
    for (std::size_t i = 0; i < s.exposures_s.size(); ++i) {
      const double t = s.exposures_s[i], x = rate * t;
      const double w = 1.0 / std::pow(sigma_dn(s.readings_dn[i]), 2);
      const double j = t * (1.0 - 2.0 * curvature * x);
      top += w * j * (s.readings_dn[i] - (offset + x - curvature * x * x));
      bottom += w * j * j;
    }
    rate += top / bottom;
  }
  return rate;
}

void add_series(const ExposureSeries& s, double offset, double curvature, Normal& normal) {
  const double rate = best_rate(s, offset, curvature);
  double rr = 0.0, ro = 0.0, rk = 0.0;
  for (std::size_t i = 0; i < s.exposures_s.size(); ++i) {
    const double t = s.exposures_s[i], x = rate * t;
    const double w = 1.0 / std::pow(sigma_dn(s.readings_dn[i]), 2);
    const double residual = s.readings_dn[i] - (offset + x - curvature * x * x);
    const double jr = t * (1.0 - 2.0 * curvature * x), jk = -x * x;
    normal.chi2 += w * residual * residual;
    normal.gradient[0] += w * residual;
    normal.gradient[1] += w * jk * residual;
    normal.matrix[0] += w;
    normal.matrix[1] += w * jk;
    normal.matrix[2] += w * jk * jk;
    rr += w * jr * jr;
    ro += w * jr;
    rk += w * jr * jk;
  }
  // Schur complement: the rate of this series is a nuisance.
  normal.matrix[0] -= ro * ro / rr;
  normal.matrix[1] -= ro * rk / rr;
  normal.matrix[2] -= rk * rk / rr;
}

Normal assemble(const std::vector<ExposureSeries>& series, double offset, double curvature) {
  Normal normal;
  for (const auto& s : series) add_series(s, offset, curvature, normal);
  return normal;
}

/// The reading, as a fraction, at which a rising table holds `signal`; clamped to its ends.
double table_position(const std::vector<Estimate>& table, double signal) {
  const auto above = std::upper_bound(table.begin(), table.end(), signal,
                                      [](double s, const Estimate& e) { return s < e.value; });
  if (above == table.begin()) return 0.0;
  if (above == table.end()) return static_cast<double>(table.size() - 1);
  const double low = (above - 1)->value, high = above->value;
  return static_cast<double>(above - table.begin()) - 1.0 + (signal - low) / (high - low);
}

}  // namespace

double CameraResponse::linear_dn(double reading_dn) const {
  if (!table_dn.empty()) {
    const double last = static_cast<double>(table_dn.size() - 1);
    const double r = std::clamp(reading_dn, 0.0, last);
    const auto k = static_cast<std::size_t>(std::min(r, last - 1.0));
    const double share = r - static_cast<double>(k);
    return (1.0 - share) * table_dn[k].value + share * table_dn[k + 1].value;
  }
  const double v = reading_dn - offset_dn.value, k = curvature_per_dn.value;
  if (std::abs(k * v) < 1e-12) return v;
  return (1.0 - std::sqrt(std::max(1.0 - 4.0 * k * v, 0.0))) / (2.0 * k);
}

double CameraResponse::slope(double signal_dn) const {
  if (!table_dn.empty()) {
    const double last = static_cast<double>(table_dn.size() - 1);
    const double r = table_position(table_dn, signal_dn);
    // Over 16 readings: where the table is nearly level, a step of it is no slope.
    const double a = std::max(r - 8.0, 0.0), b = std::min(r + 8.0, last);
    return (b - a) / (linear_dn(b) - linear_dn(a));
  }
  return std::max(1.0 - 2.0 * curvature_per_dn.value * signal_dn, 1e-3);
}

double CameraResponse::reading_dn(double signal_dn) const {
  if (!table_dn.empty()) return table_position(table_dn, signal_dn);
  return offset_dn.value + signal_dn - curvature_per_dn.value * signal_dn * signal_dn;
}

ResponseEstimate estimate_response(const std::vector<ExposureSeries>& series) {
  std::vector<ExposureSeries> usable;
  ResponseEstimate estimate;
  for (const auto& s : series)
    if (s.exposures_s.size() >= 2) {
      usable.push_back(s);
      estimate.readings += s.exposures_s.size();
    }
  if (usable.size() < 3 || estimate.readings < usable.size() + 3) return estimate;
  const double dof = static_cast<double>(estimate.readings - usable.size());
  estimate.chi2_per_dof_linear = assemble(usable, 0.0, 0.0).chi2 / dof;

  double offset = 0.0, curvature = 0.0;
  Normal normal;
  for (int step = 0; step < 30; ++step) {
    normal = assemble(usable, offset, curvature);
    const auto [oo, ok, kk] = normal.matrix;
    const double determinant = oo * kk - ok * ok;
    if (!(determinant > 1e-12 * oo * kk)) return estimate;  // no curvature to be seen
    offset += (kk * normal.gradient[0] - ok * normal.gradient[1]) / determinant;
    curvature += (oo * normal.gradient[1] - ok * normal.gradient[0]) / determinant;
    curvature = std::clamp(curvature, -1e-3, 1e-3);
  }
  estimate.chi2_per_dof = normal.chi2 / (dof - 2.0);
  const auto [oo, ok, kk] = normal.matrix;
  const double determinant = oo * kk - ok * ok;
  const double inflation = std::max(1.0, estimate.chi2_per_dof);
  estimate.response.offset_dn = {offset, std::sqrt(inflation * kk / determinant)};
  estimate.response.curvature_per_dn = {curvature, std::sqrt(inflation * oo / determinant)};
  return estimate;
}

}  // namespace truebox
