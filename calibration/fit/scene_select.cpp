// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_select.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace truebox {
namespace {

constexpr double kBicMargin = 10.0;  // "very strong" evidence: Kass & Raftery (1995)
constexpr double kRmsMargin = 1.05;

struct Candidate {
  ModelCandidate summary;
  double effective_readings = 0.0, birge = 1.0;
};

Candidate try_model(const SceneFitProblem& problem, std::string name,
                    const std::vector<std::vector<BlockReading>>& held_out,
                    const SceneFitOptions& options) {
  const SceneFit fit = fit_scene(problem, options);
  Candidate candidate;
  ModelCandidate& c = candidate.summary;
  c.name = std::move(name);
  c.outcome = fit.summary.outcome;
  c.parameters = fit.summary.parameters;
  c.chi2 = fit.log_likelihood_chi2;
  candidate.effective_readings = fit.effective_readings;
  candidate.birge = fit.birge;
  if (fit.readings.empty()) return candidate;
  double n = 0.0, difference = 0.0, value = 0.0;
  for (const FittedReading& r : predict_held_out(problem, held_out, fit)) {
    n += 1.0;
    difference += std::pow(r.value - r.predicted, 2);
    value += r.value * r.value;
    c.held_out_chi2 += r.z() * r.z();
  }
  if (n > 0.0) {
    c.held_out_chi2 /= n;
    c.held_out_rms = std::sqrt(difference / value);
  }
  return candidate;
}

SceneFitProblem with_one_reflectance(SceneFitProblem problem) {
  for (ReflectanceChoice& choice : problem.reflectances) {
    choice.basis = SpectralBasis::constant;
    choice.curvature_u = 0.0;
    choice.spectra.reset();
  }
  return problem;
}

/// As the problem has it, else free wherever the model knows a lobe.
std::vector<GlossChoice> free_gloss(const SceneFitProblem& problem) {
  std::vector<GlossChoice> gloss = problem.gloss;
  gloss.resize(problem.model->scene().materials.size());
  const auto& roughness = problem.model->options().roughness;
  for (std::size_t m = 0; m < roughness.size(); ++m)
    if (roughness[m] > 0.0 && gloss[m].hold == Hold::fixed) gloss[m].hold = Hold::free;
  return gloss;
}

}  // namespace

std::vector<ModelCandidate> select_model(const SceneFitProblem& problem,
                                         const std::vector<std::vector<BlockReading>>& held_out,
                                         const SceneFitOptions& options) {
  std::vector<Candidate> all;
  const bool has_bands = problem.model->scene().bands.size() > 1;
  const auto& roughness = problem.model->options().roughness;
  const bool has_gloss =
      std::any_of(roughness.begin(), roughness.end(), [](double r) { return r > 0.0; });
  for (const bool each_band : {false, true}) {
    if (each_band && !has_bands) continue;
    for (const bool interreflection : {false, true})
      for (const bool gloss : {false, true}) {
        if (gloss && !has_gloss) continue;
        SceneFitProblem model = each_band || !has_bands ? problem : with_one_reflectance(problem);
        model.interreflection = interreflection;
        model.gloss = gloss ? free_gloss(problem) : std::vector<GlossChoice>();
        std::string name = interreflection ? "interreflection" : "direct light only";
        if (gloss) name += " and gloss";
        if (has_bands)
          name += each_band ? ", reflectances of each band" : ", one reflectance for all bands";
        all.push_back(try_model(model, name, held_out, options));
      }
  }
  const double scale = std::pow(all.back().birge, 2), n = all.back().effective_readings;
  double best_bic = std::numeric_limits<double>::infinity(), best_rms = best_bic;
  for (Candidate& each : all) {
    ModelCandidate& c = each.summary;
    const double k = static_cast<double>(c.parameters);
    c.bic = c.chi2 / scale + k * std::log(std::max(1.0, n));
    c.aicc = c.chi2 / scale + 2.0 * k +
             (n > k + 1.0 ? 2.0 * k * (k + 1.0) / (n - k - 1.0)
                          : std::numeric_limits<double>::infinity());
    if (c.outcome != Outcome::converged) continue;
    best_bic = std::min(best_bic, c.bic);
    best_rms = std::min(best_rms, c.held_out_rms);
  }
  std::vector<ModelCandidate> candidates;
  bool is_chosen = false;
  for (Candidate& each : all) {
    ModelCandidate& c = each.summary;
    if (c.outcome != Outcome::converged)
      c.why = to_string(c.outcome);
    else if (c.bic > best_bic + kBicMargin)
      c.why = "BIC is higher";
    else if (c.held_out_rms > kRmsMargin * best_rms)
      c.why = "predicts held-out readings worse";
    else if (is_chosen)
      c.why = "a simpler one suffices";
    else
      is_chosen = c.chosen = true;
    candidates.push_back(std::move(c));
  }
  return candidates;
}

std::string describe(const std::vector<ModelCandidate>& candidates) {
  std::string text;
  char line[256];
  std::snprintf(line, sizeof line, "%-48s %5s %12s %12s %9s %9s\n", "model", "k", "AICc", "BIC",
                "rms / %", "chi2/n");
  text += line;
  for (const ModelCandidate& c : candidates) {
    std::snprintf(line, sizeof line, "%-48s %5zu %12.1f %12.1f %9.3f %9.2f  %s\n", c.name.c_str(),
                  c.parameters, c.aicc, c.bic, 100.0 * c.held_out_rms, c.held_out_chi2,
                  c.chosen ? "<- simplest that suffices" : c.why.c_str());
    text += line;
  }
  return text;
}

}  // namespace truebox
