// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_fit_summary.h"

#include <Eigen/Dense>
#include <cmath>
#include <sstream>

namespace truebox {

using Eigen::Index;

std::string weakest_direction(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& size_of,
                              const std::vector<ParameterName>& names) {
  const auto inverse = size_of.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(inverse * covariance * inverse);
  const Index last = covariance.rows() - 1;
  std::ostringstream text;
  text.precision(2);
  text << describe_direction(eigen.eigenvectors().col(last).cwiseProduct(size_of), size_of, names)
       << " (u " << 100.0 * std::sqrt(std::max(0.0, eigen.eigenvalues()[last])) << " %)";
  return text.str();
}

namespace {

void append(std::string& note, const std::string& text) {
  note += (note.empty() ? "" : "; ") + text;
}

/// Whether any reading shows a surface of the material.
std::vector<char> seen_materials(const SceneFitProblem& problem) {
  const Scene& scene = problem.model->scene();
  std::vector<char> seen(scene.materials.size(), 0);
  for (const PlaneReadings& plane : problem.planes)
    for (const BlockReading& r : plane.readings)
      seen[scene.surfaces[problem.model->blocks()[r.block].surface].material] = 1;
  for (std::size_t m = 0; m < seen.size(); ++m)
    if (const auto other = problem.reflectances[m].same_as; other && seen[m]) seen[*other] = 1;
  return seen;
}

void note_unseen(const SceneFitProblem& problem, SceneFit& fit) {
  const auto seen = seen_materials(problem);
  const auto& materials = problem.model->scene().materials;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    if (seen[m]) continue;
    for (FittedParameter& p : fit.parameters)
      if (p.name == "reflectance " + materials[m].name ||
          p.name.starts_with("reflectance " + materials[m].name + ", "))
        append(p.note, p.determined ? "seen by no pixel: known through interreflection only"
                                    : "seen by no pixel, nor through interreflection");
  }
}

}  // namespace

void add_notes(const SceneFitProblem& problem, SceneFit& fit) {
  constexpr double kUniform = 0.2887;  // standard deviation of "somewhere in [0, 1)"
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    FittedParameter& p = fit.parameters[i];
    if (p.at_bound) append(p.note, "at its bound: no uncertainty is claimed");
    if (!p.determined) append(p.note, "not determined");
    if (p.at_initial_value && !p.at_bound) append(p.note, "at its initial value");
    if (p.kind == "glosses" && p.at_bound) append(p.note, "no gloss is seen");
    if (p.kind == "glosses" && !p.at_bound && fit.gloss_left_out > 0.0) {
      std::ostringstream text;
      text.precision(2);
      text << "first order: walls mirrored in it are left out, up to " << 100.0 * fit.gloss_left_out
           << " % of a reading";
      append(p.note, text.str());
    }
    if (p.kind == "reflectances" && p.estimate.standard_uncertainty > kUniform)
      append(p.note, "the data say no more than that it lies between 0 and 1");
    std::size_t partner = i;
    for (std::size_t j = 0; j < fit.parameters.size(); ++j) {
      const double r = std::abs(fit.correlation(static_cast<Index>(i), static_cast<Index>(j)));
      if (j != i && r >= kNearlyOne &&
          (partner == i ||
           r > std::abs(fit.correlation(static_cast<Index>(i), static_cast<Index>(partner)))))
        partner = j;
    }
    if (partner == i) continue;
    std::ostringstream text;
    text.precision(4);
    text << "hardly told apart from " << fit.parameters[partner].name
         << " (r = " << fit.correlation(static_cast<Index>(i), static_cast<Index>(partner)) << ")";
    append(p.note, text.str());
  }
  if (fit.summary.outcome != Outcome::invalid_problem) note_unseen(problem, fit);
}

std::string SceneFit::full() const {
  std::ostringstream text;
  text << summary.full();
  for (std::size_t k = 1; k < null_directions.size(); ++k)
    text << "null direction   " << null_directions[k] << "\n";
  if (!weakest_direction.empty()) text << "least determined " << weakest_direction << "\n";
  if (birge > 1.0)
    text << "enlarged by      " << birge << " (chi2/nu above what chance explains)\n";
  text << "effective n      " << effective_readings << "\n";
  if (outliers > 0)
    text << "outliers         " << outliers << " readings with half weight or less\n";
  text << "\n";
  for (const FittedParameter& p : parameters) {
    text << p.name << " = " << p.estimate.value;
    if (!p.unit.empty() && p.unit != "1") text << " " << p.unit;
    if (p.determined && !p.at_bound) text << " +- " << p.estimate.standard_uncertainty;
    if (!p.note.empty()) text << "  (" << p.note << ")";
    text << "\n";
  }
  return text.str();
}

}  // namespace truebox
