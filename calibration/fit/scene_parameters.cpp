// SPDX-License-Identifier: BSD-3-Clause
// Which parameters a scene fit has, where they start and what is known of them.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "fit/scene_forward.h"

namespace truebox {

using Eigen::Index;

namespace {

// The solvers need rho < 1, and beyond this a bounce takes less than rounding leaves.
constexpr double kHighestReflectance = 1.0 - 1e-6;
constexpr double kHighestFactor = 1e6;
constexpr double kFirstGloss = 0.01, kLargeGloss = 0.04;  // a smooth dielectric has 0.04

std::string nm_text(double nm) {
  std::ostringstream text;
  text << nm << " nm";
  return text.str();
}

}  // namespace

SceneForward::SceneForward(const SceneFitProblem& problem)
    : problem_(problem), fixed_(problem.model->state()) {
  fixed_.interreflection = problem.interreflection;
  add_reflectances();
  add_emissions();
  add_gains();
  add_response();
  add_gloss();
  add_shape();
  start_gains();
}

std::size_t SceneForward::add(SceneParameter parameter) {
  parameters_.push_back(std::move(parameter));
  return parameters_.size() - 1;
}

void SceneForward::add_reflectances() {
  const Scene& scene = problem_.model->scene();
  spectra_.resize(scene.materials.size());
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    const ReflectanceChoice& choice = problem_.reflectances[m];
    if (choice.hold == Hold::fixed || choice.same_as) continue;
    const Eigen::MatrixXd basis = spectral_basis(choice.basis, choice.count, scene.bands);
    const Eigen::VectorXd start =
        Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(basis).solve(
            fixed_.reflectance.row(static_cast<Index>(m)).transpose());
    spectra_[m] = {basis, parameters_.size()};
    for (Index k = 0; k < basis.cols(); ++k) {
      const std::string item = "reflectance of " + scene.materials[m].name;
      std::string name = "reflectance " + scene.materials[m].name;
      if (basis.cols() > 1)
        name += choice.basis == SpectralBasis::bands
                    ? ", " + nm_text(scene.bands.centre_nm(static_cast<std::size_t>(k)))
                    : ", coefficient " + std::to_string(k + 1);
      const double at = std::clamp(start[k], 0.0, kHighestReflectance);
      add({{name, item, "reflectances"}, at, 0.0, kHighestReflectance, std::max(at, 0.05)});
    }
    add_reflectance_priors(m);
  }
  for (std::size_t m = 0; m < scene.materials.size(); ++m)
    if (const auto& other = problem_.reflectances[m].same_as) {
      spectra_[m] = spectra_[*other];
      fixed_.reflectance.row(static_cast<Index>(m)) =
          fixed_.reflectance.row(static_cast<Index>(*other));
    }
}

void SceneForward::add_reflectance_priors(std::size_t material) {
  const ReflectanceChoice& choice = problem_.reflectances[material];
  const SpectrumMap& map = spectra_[material];
  const auto count = static_cast<std::size_t>(map.basis.cols());
  if (choice.hold == Hold::prior && choice.standard_uncertainty > 0.0)
    for (std::size_t k = 0; k < count; ++k) {
      const double weight = 1.0 / choice.standard_uncertainty;
      priors_.push_back({"prior of reflectances",
                         {{map.first + k, weight}},
                         weight * parameters_[map.first + k].start});
    }
  if (choice.curvature_u > 0.0)
    for (std::size_t k = 1; k + 1 < count; ++k) {
      const double weight = 1.0 / choice.curvature_u;
      priors_.push_back({"smoothness of spectra",
                         {{map.first + k - 1, weight},
                          {map.first + k, -2.0 * weight},
                          {map.first + k + 1, weight}},
                         0.0});
    }
  if (!choice.spectra) return;
  const Eigen::LLT<Eigen::MatrixXd> root(choice.spectra->covariance);
  const Eigen::MatrixXd rows = root.matrixL().solve(map.basis);
  const Eigen::VectorXd values = root.matrixL().solve(choice.spectra->mean);
  for (Index r = 0; r < rows.rows(); ++r) {
    PriorRow prior{"prior of measured spectra", {}, values[r]};
    for (std::size_t k = 0; k < count; ++k)
      prior.terms.emplace_back(map.first + k, rows(r, static_cast<Index>(k)));
    priors_.push_back(std::move(prior));
  }
}

void SceneForward::add_emissions() {
  const Scene& scene = problem_.model->scene();
  const auto& lamps = problem_.model->lamps();
  emission_.resize(lamps.size());
  for (std::size_t l = 0; l < lamps.size(); ++l) {
    const EmissionChoice& choice = problem_.emissions[l];
    if (choice.hold == Hold::fixed) continue;
    const std::string of = lamps.size() > 1 ? " of " + scene.materials[lamps[l]].name : "";
    const auto factor = [&](const std::string& at) {
      const std::size_t k =
          add({{"emission scale" + of + at,
                (choice.each_band ? "emission spectrum" : "emission scale") + of, "emissions"},
               1.0,
               0.0,
               kHighestFactor});
      if (choice.hold == Hold::prior)
        priors_.push_back(
            {"prior of emission", {{k, 1.0 / choice.relative_u}}, 1.0 / choice.relative_u});
      return k;
    };
    emission_[l].assign(scene.bands.size(), choice.each_band ? 0 : factor(""));
    if (choice.each_band)
      for (std::size_t b = 0; b < scene.bands.size(); ++b)
        emission_[l][b] = factor(", " + nm_text(scene.bands.centre_nm(b)));
  }
}

void SceneForward::add_gains() {
  gain_.resize(problem_.planes.size());
  for (std::size_t k = 0; k < gain_.size(); ++k) {
    const PlaneReadings& plane = problem_.planes[k];
    if (plane.gain == Hold::fixed) continue;
    const std::string name = "gain of " + plane.name;
    gain_[k] = add({{name, name, "gains"},
                    plane.gain_value,
                    0.0,
                    kHighestFactor * plane.gain_value,
                    plane.gain_value});
    const double u = plane.gain_relative_u * plane.gain_value;
    if (plane.gain == Hold::prior)
      priors_.push_back({"exposure", {{*gain_[k], 1.0 / u}}, plane.gain_value / u});
  }
}

void SceneForward::add_response() {
  if (!problem_.response) return;
  const ResponseChoice& choice = *problem_.response;
  curve_.emplace(choice.segments, choice.decades, choice.white);
  if (choice.hold == Hold::fixed) return;
  for (int j = 0; j < choice.segments; ++j) {
    std::ostringstream range;
    range.precision(2);
    range << "response gamma, " << curve_->low(j) << " to " << curve_->high(j) << " of white";
    gamma_.push_back(add({{range.str(), "camera response", "responses"}, 1.0, 0.02, 20.0}));
    if (choice.hold == Hold::prior)
      priors_.push_back(
          {"prior of response", {{gamma_.back(), 1.0 / choice.gamma_u}}, 1.0 / choice.gamma_u});
  }
}

void SceneForward::add_gloss() {
  const auto& materials = problem_.model->scene().materials;
  gloss_.resize(materials.size());
  for (std::size_t m = 0; m < problem_.gloss.size(); ++m) {
    const GlossChoice& choice = problem_.gloss[m];
    fixed_.gloss[static_cast<Index>(m)] = choice.value;
    if (choice.hold == Hold::fixed) continue;
    const std::string name = "gloss of " + materials[m].name;
    // A search that begins at the bound would have to leave it first.
    const double start = std::max(choice.value, kFirstGloss);
    gloss_[m] = add({{name, name, "glosses"}, start, 0.0, kHighestReflectance, kLargeGloss});
    const double weight = 1.0 / choice.standard_uncertainty;
    if (choice.hold == Hold::prior)
      priors_.push_back({"prior of gloss", {{*gloss_[m], weight}}, weight * choice.value});
  }
}

void SceneForward::add_shape() {
  for (const ShapeTerm& term : problem_.shape) {
    shape_.emplace_back();
    if (term.hold == Hold::fixed) continue;
    shape_.back() = add({term.name, term.at, term.low, term.high, term.size, term.unit});
    const double weight = 1.0 / term.standard_uncertainty;
    if (term.hold == Hold::prior)
      priors_.push_back(
          {"prior of " + term.name.kind, {{*shape_.back(), weight}}, weight * term.known});
  }
}

// A gain far from its start would first drive reflectances to their bounds: free gains start where
// their plane fits best.
void SceneForward::start_gains() {
  Eigen::VectorXd predicted;
  if (!predict(start(), predicted, nullptr)) return;
  Index row = 0;
  for (std::size_t k = 0; k < problem_.planes.size(); ++k) {
    double product = 0.0, square = 0.0;
    for (const BlockReading& r : problem_.planes[k].readings) {
      const double p = predicted[row++], weight = 1.0 / (r.value * r.value + 1e-300);
      product += weight * p * r.value;
      square += weight * p * p;
    }
    if (!gain_[k] || problem_.planes[k].gain != Hold::free) continue;
    SceneParameter& gain = parameters_[*gain_[k]];
    if (!(product > 0.0) || !(square > 0.0)) continue;
    gain.start *= product / square;
    gain.size = gain.start;
    gain.high = kHighestFactor * gain.start;
  }
}

SceneState SceneForward::state_of(const Eigen::VectorXd& x) const {
  SceneState state = fixed_;
  for (std::size_t m = 0; m < spectra_.size(); ++m)
    if (spectra_[m].basis.cols() > 0)
      state.reflectance.row(static_cast<Index>(m)) =
          (spectra_[m].basis *
           x.segment(static_cast<Index>(spectra_[m].first), spectra_[m].basis.cols()))
              .transpose()
              .cwiseMax(0.0)
              .cwiseMin(kHighestReflectance);
  for (std::size_t l = 0; l < emission_.size(); ++l)
    for (std::size_t b = 0; b < emission_[l].size(); ++b)
      state.exitance(static_cast<Index>(l), static_cast<Index>(b)) *=
          x[static_cast<Index>(emission_[l][b])];
  for (std::size_t m = 0; m < gloss_.size(); ++m)
    if (gloss_[m]) state.gloss[static_cast<Index>(m)] = x[static_cast<Index>(*gloss_[m])];
  return state;
}

}  // namespace truebox
