// SPDX-License-Identifier: BSD-3-Clause
#include "transport/solve_radiosity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "transport/reduced_basis.h"
#include "transport/solve_state.h"

namespace truebox {
namespace {

using Eigen::Index;

struct NamedMethod {
  SolveMethod method;
  const char* name;
};
constexpr std::array kMethods = {NamedMethod{SolveMethod::conjugate_gradient, "krylov"},
                                 NamedMethod{SolveMethod::gmres, "gmres"},
                                 NamedMethod{SolveMethod::bicgstab, "bicgstab"},
                                 NamedMethod{SolveMethod::gauss_seidel, "gauss-seidel"},
                                 NamedMethod{SolveMethod::jacobi, "jacobi"},
                                 NamedMethod{SolveMethod::southwell, "southwell"},
                                 NamedMethod{SolveMethod::southwell_ambient, "southwell-ambient"},
                                 NamedMethod{SolveMethod::direct, "direct"}};

void run(SolveState& state) {
  switch (state.options.method) {
    case SolveMethod::direct: return solve_direct(state);
    case SolveMethod::jacobi: return solve_jacobi(state);
    case SolveMethod::gauss_seidel: return solve_gauss_seidel(state);
    case SolveMethod::southwell: return solve_southwell(state, false);
    case SolveMethod::southwell_ambient: return solve_southwell(state, true);
    case SolveMethod::conjugate_gradient: return solve_conjugate_gradient(state);
    case SolveMethod::gmres: return solve_gmres(state);
    case SolveMethod::bicgstab: return solve_bicgstab(state);
  }
}

void require_reflectance(const BandMatrix& rho) {
  for (Index i = 0; i < rho.rows(); ++i)
    for (Index k = 0; k < rho.cols(); ++k)
      if (!(rho(i, k) >= 0.0 && rho(i, k) < 1.0))
        throw std::invalid_argument("reflectance " + std::to_string(rho(i, k)) + " of element " +
                                    std::to_string(i) + " in band " + std::to_string(k) +
                                    ": 0 <= rho < 1 expected; above, energy would be created");
}

}  // namespace

std::string method_name(SolveMethod method) {
  for (const NamedMethod& m : kMethods)
    if (m.method == method) return m.name;
  return {};
}

SolveMethod method_of_name(const std::string& name) {
  for (const NamedMethod& m : kMethods)
    if (m.name == name) return m.method;
  throw std::invalid_argument("no solution method is called \"" + name + "\"");
}

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const NamedMethod& m : kMethods) names.emplace_back(m.name);
  return names;
}

std::string SolveOptions::invalid() const {
  if (!(relative_bound > 0.0 && relative_bound < 1.0)) return "relative_bound must lie in (0, 1)";
  if (iteration_limit < 1) return "iteration_limit must be positive";
  return {};
}

std::string SolveSummary::brief() const {
  static const char* const kNames[] = {"not run", "converged", "iteration limit", "diverged"};
  char passes[32];
  std::snprintf(passes, sizeof passes, "%.4g", matrix_passes);
  std::string text = std::string(kNames[static_cast<int>(outcome)]) + " after " +
                     std::to_string(iterations) + " iterations, " + passes +
                     " passes over the form factors";
  if (bands_reduced > 0)
    text += "; " + std::to_string(bands_reduced) + " of " + std::to_string(error_bound.size()) +
            " bands from products of the others";
  return text;
}

SolveState::SolveState(const ExchangeOperator& exchange_operator, const BandMatrix& reflectance,
                       const BandMatrix& emission, const SolveOptions& solve_options,
                       BandMatrix& radiosity, const Progress& progress)
    : exchange(exchange_operator),
      rho(reflectance),
      source(emission),
      options(solve_options),
      b(radiosity),
      progress_(progress) {
  summary.error_bound = Eigen::VectorXd::Constant(bands(), std::numeric_limits<double>::infinity());
  contraction_ = rho.colwise().maxCoeff().transpose() * std::max(1.0, exchange.row_sum_max());
}

BandMatrix SolveState::residual() {
  gathered = exchange.product(b);
  summary.matrix_passes += 1.0;
  BandMatrix r(elements(), bands());
  for (Index i = 0; i < r.rows(); ++i)
    r.row(i) = source.row(i).array() +
               rho.row(i).array() * gathered.row(i).array() / exchange.area_m2()[i] -
               b.row(i).array();
  return r;
}

bool SolveState::meets_bound(const BandMatrix& r, double factor) {
  if (!r.allFinite()) {  // maxCoeff may pass over a NaN
    summary.outcome = SolveOutcome::diverged;
    summary.error_bound.setConstant(std::numeric_limits<double>::infinity());
    return false;
  }
  double worst = 0.0, worst_bound = 0.0;
  for (Index band = 0; band < r.cols(); ++band) {
    const double q = contraction_[band];
    const double norm = b.col(band).cwiseAbs().maxCoeff();
    const double size = r.col(band).cwiseAbs().maxCoeff();
    summary.error_bound[band] =
        q < 1.0 ? factor * size / (1.0 - q) : std::numeric_limits<double>::infinity();
    if (norm == 0.0 && size == 0.0) continue;
    worst = std::max(worst, size / norm);
    worst_bound = std::max(worst_bound, summary.error_bound[band] / norm);
  }
  summary.residual_history.push_back(worst);
  if (!std::isfinite(worst)) summary.outcome = SolveOutcome::diverged;
  if (progress_) {
    const double wanted = std::log(options.relative_bound);
    progress_("radiosity", std::clamp(std::log(std::max(worst_bound, 1e-300)) / wanted, 0.0, 1.0));
  }
  return worst_bound <= options.relative_bound;
}

bool SolveState::finish() {
  if (!meets_bound(residual())) return false;
  summary.outcome = SolveOutcome::converged;
  return true;
}

bool SolveState::out_of_iterations() {
  if (summary.iterations < options.iteration_limit) return false;
  if (summary.outcome == SolveOutcome::not_run) summary.outcome = SolveOutcome::iteration_limit;
  return true;
}

void SolveState::tell() const {
  if (options.on_progress) options.on_progress(summary.matrix_passes, b);
}

SolveSummary solve_radiosity(const ExchangeOperator& exchange, const BandMatrix& rho,
                             const BandMatrix& source, const SolveOptions& options,
                             BandMatrix& radiosity, const Progress& progress,
                             BandMatrix* irradiance) {
  if (const std::string why = options.invalid(); !why.empty()) throw std::invalid_argument(why);
  require_reflectance(rho);
  radiosity = source;
  SolveState state(exchange, rho, source, options, radiosity, progress);
  if (!source.allFinite())
    state.summary.outcome = SolveOutcome::diverged;
  else if (options.method != SolveMethod::conjugate_gradient || !options.share_bands ||
           !solve_on_reduced_basis(state))
    run(state);
  if (irradiance) {
    *irradiance = std::move(state.gathered);
    if (irradiance->size() == 0)
      irradiance->setConstant(rho.rows(), rho.cols(), std::numeric_limits<double>::quiet_NaN());
    for (Index i = 0; i < irradiance->rows(); ++i) irradiance->row(i) /= exchange.area_m2()[i];
  }
  return std::move(state.summary);
}

SolveSummary solve_radiosity(const FormFactors& factors, const BandMatrix& rho,
                             const BandMatrix& source, const SolveOptions& options,
                             BandMatrix& radiosity, const Progress& progress,
                             BandMatrix* irradiance) {
  return solve_radiosity(DenseExchange(factors), rho, source, options, radiosity, progress,
                         irradiance);
}

}  // namespace truebox
