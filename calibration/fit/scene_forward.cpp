// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_forward.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

namespace truebox {

using Eigen::Index;

Eigen::VectorXd SceneForward::start() const {
  Eigen::VectorXd x(static_cast<Index>(parameters_.size()));
  for (Index k = 0; k < x.size(); ++k) x[k] = parameters_[static_cast<std::size_t>(k)].start;
  return x;
}

// By reflectances, exitances and gloss; `slopes`: d reading / d B of the reading, one a band.
void SceneForward::differentiate(const BlockRadiosity& b, Eigen::Index i,
                                 const Eigen::RowVectorXd& slopes,
                                 Eigen::Ref<Eigen::RowVectorXd> row) const {
  for (std::size_t m = 0; m < spectra_.size(); ++m)
    if (spectra_[m].basis.cols() > 0)
      row.segment(static_cast<Index>(spectra_[m].first), spectra_[m].basis.cols()) +=
          b.by_reflectance[m].row(i).cwiseProduct(slopes) * spectra_[m].basis;
  for (std::size_t l = 0; l < emission_.size(); ++l)
    for (std::size_t band = 0; band < emission_[l].size(); ++band) {
      const auto c = static_cast<Index>(band);
      row[static_cast<Index>(emission_[l][band])] +=
          slopes[c] * fixed_.exitance(static_cast<Index>(l), c) * b.by_exitance[l](i, c);
    }
  for (std::size_t m = 0; m < gloss_.size(); ++m)
    if (gloss_[m]) row[static_cast<Index>(*gloss_[m])] += b.by_gloss[m].row(i).dot(slopes);
}

bool SceneForward::predict(const Eigen::VectorXd& x, Eigen::VectorXd& readings,
                           Eigen::MatrixXd* derivatives) const {
  WantedDerivatives wanted;
  for (const SpectrumMap& map : spectra_) wanted.reflectance.push_back(map.basis.cols() > 0);
  for (const auto& factors : emission_) wanted.exitance = wanted.exitance || !factors.empty();
  for (const auto& gloss : gloss_) wanted.gloss = wanted.gloss || gloss.has_value();
  const BlockRadiosity b = problem_.model->radiosity(state_of(x), derivatives ? &wanted : nullptr);
  const auto rows = static_cast<Index>(problem_.readings());
  readings.resize(rows);
  if (derivatives) derivatives->setZero(rows, x.size());
  std::vector<double> gammas;
  for (const std::size_t k : gamma_) gammas.push_back(x[static_cast<Index>(k)]);
  if (curve_ && gammas.empty()) gammas.assign(static_cast<std::size_t>(curve_->segments()), 1.0);
  Index row = 0;
  for (std::size_t k = 0; k < problem_.planes.size(); ++k) {
    const PlaneReadings& plane = problem_.planes[k];
    const double gain = gain_[k] ? x[static_cast<Index>(*gain_[k])] : plane.gain_value;
    const Eigen::RowVectorXd weights = plane.band_weights.transpose() / std::numbers::pi;
    for (const BlockReading& reading : plane.readings) {
      const auto block = static_cast<Index>(reading.block);
      const Eigen::RowVectorXd radiosity = b.value.row(block);
      Eigen::RowVectorXd factor = Eigen::RowVectorXd::Ones(radiosity.size());
      for (std::size_t j = 0; j < shape_.size(); ++j)
        if (shape_[j])
          factor += (x[static_cast<Index>(*shape_[j])] - problem_.shape[j].at) *
                    problem_.shape[j].relative.row(block);
      const double light = radiosity.cwiseProduct(factor).dot(weights);
      double slope = 1.0;
      readings[row] = gain * light;
      if (curve_) {
        const auto curved = curve_->at(gain * light, gammas);
        readings[row] = curved.reading;
        slope = curved.by_exposure;
        if (derivatives)
          for (std::size_t j = 0; j < gamma_.size(); ++j)
            (*derivatives)(row, static_cast<Index>(gamma_[j])) = curved.by_gamma[j];
      }
      if (derivatives) {
        auto d = derivatives->row(row);
        Eigen::RowVectorXd parts = d;
        differentiate(b, block, slope * gain * weights.cwiseProduct(factor), parts);
        d = parts;
        for (std::size_t j = 0; j < shape_.size(); ++j)
          if (shape_[j])
            d[static_cast<Index>(*shape_[j])] =
                slope * gain *
                radiosity.cwiseProduct(weights).dot(problem_.shape[j].relative.row(block));
        if (gain_[k]) d[static_cast<Index>(*gain_[k])] = slope * light;
      }
      ++row;
    }
  }
  return b.outcome == SolveOutcome::converged;
}

}  // namespace truebox
