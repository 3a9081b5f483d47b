// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_fit_problem.h"

#include <cmath>

namespace truebox {

using Eigen::Index;

SpectralPrior prior_of_spectra(const Eigen::MatrixXd& spectra, double floor_u) {
  SpectralPrior prior;
  prior.mean = spectra.colwise().mean().transpose();
  const Eigen::MatrixXd centred = spectra.rowwise() - prior.mean.transpose();
  const double n = static_cast<double>(std::max<Index>(2, spectra.rows()));
  prior.covariance = centred.transpose() * centred / (n - 1.0);
  prior.covariance.diagonal().array() += floor_u * floor_u;
  return prior;
}

namespace {

/// B-spline `i` of degree `k` over clamped knots (Cox, de Boor).
double bspline(int i, int k, double x, const std::vector<double>& knots) {
  const auto t = [&](int j) { return knots[static_cast<std::size_t>(j)]; };
  if (k == 0) return x >= t(i) && (x < t(i + 1) || (x >= 1.0 && t(i + 1) >= 1.0 && t(i) < 1.0));
  const double left = t(i + k) - t(i), right = t(i + k + 1) - t(i + 1);
  double value = 0.0;
  if (left > 0.0) value += (x - t(i)) / left * bspline(i, k - 1, x, knots);
  if (right > 0.0) value += (t(i + k + 1) - x) / right * bspline(i + 1, k - 1, x, knots);
  return value;
}

}  // namespace

Eigen::MatrixXd spectral_basis(SpectralBasis basis, int count, const WavelengthGrid& bands) {
  const auto n = static_cast<Index>(bands.size());
  if (basis == SpectralBasis::bands) return Eigen::MatrixXd::Identity(n, n);
  if (basis == SpectralBasis::constant) return Eigen::MatrixXd::Ones(n, 1);
  const int degree = basis == SpectralBasis::linear ? 1 : 3;
  std::vector<double> knots(static_cast<std::size_t>(degree), 0.0);
  for (int k = 0; k <= count - degree; ++k)
    knots.push_back(static_cast<double>(k) / (count - degree));
  knots.insert(knots.end(), static_cast<std::size_t>(degree), 1.0);
  const double first = bands.centre_nm(0), span = bands.centre_nm(bands.size() - 1) - first;
  Eigen::MatrixXd matrix(n, count);
  for (Index b = 0; b < n; ++b) {
    const double x =
        span > 0.0 ? (bands.centre_nm(static_cast<std::size_t>(b)) - first) / span : 0.0;
    for (int j = 0; j < count; ++j) matrix(b, j) = bspline(j, degree, x, knots);
  }
  return matrix;
}

std::size_t SceneFitProblem::readings() const {
  std::size_t n = 0;
  for (const PlaneReadings& plane : planes) n += plane.readings.size();
  return n;
}

std::string SceneFitProblem::invalid() const {
  if (!model) return "no scene";
  if (model->lamps().empty()) return "nothing in the scene emits: there is no light to fit";
  if (reflectances.size() != model->scene().materials.size())
    return "one choice a material is needed";
  if (emissions.size() != model->lamps().size()) return "one choice a luminaire is needed";
  if (readings() == 0)
    return "no pixel can be used: all are masked, saturated, not finite, or at an edge";
  for (const PlaneReadings& plane : planes)
    for (const BlockReading& r : plane.readings)
      if (!std::isfinite(r.value) || !(r.standard_uncertainty > 0.0))
        return "plane " + plane.name + ": a reading without a finite value and an uncertainty";
  for (std::size_t m = 0; m < reflectances.size(); ++m) {
    const auto& target = reflectances[m].same_as;
    if (target && (*target >= reflectances.size() || reflectances[*target].same_as))
      return "material " + model->scene().materials[m].name +
             ": the same as a material that is the same as another";
  }
  return {};
}

}  // namespace truebox
