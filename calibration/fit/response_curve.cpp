// SPDX-License-Identifier: BSD-3-Clause
#include "fit/response_curve.h"

#include <algorithm>
#include <cmath>

namespace truebox {

ResponseCurve::ResponseCurve(int segments, double decades, double white)
    : segments_(segments), step_(decades * std::log(10.0) / segments), white_(white) {}

double ResponseCurve::low(int j) const { return std::exp(-step_ * (j + 1)); }
double ResponseCurve::high(int j) const { return std::exp(-step_ * j); }

ResponseCurve::Value ResponseCurve::at(double exposure, const std::vector<double>& gammas) const {
  Value value;
  value.by_gamma.assign(gammas.size(), 0.0);
  if (!(exposure > 0.0)) return value;
  // Walking down from white, segment 0 first; what lies above white belongs to it as well.
  double rest = std::log(exposure / white_), y = 0.0, slope = gammas[0];
  for (int j = 0; j < segments_; ++j) {
    const bool is_last = j + 1 == segments_;
    const double part = is_last ? rest : std::max(rest, -step_);
    const auto k = static_cast<std::size_t>(j);
    value.by_gamma[k] = part;
    y += gammas[k] * part;
    slope = gammas[k];
    rest -= part;
    if (is_last || rest >= 0.0) break;
  }
  value.reading = white_ * std::exp(y);
  value.by_exposure = slope * value.reading / exposure;
  for (double& d : value.by_gamma) d *= value.reading;
  return value;
}

}  // namespace truebox
