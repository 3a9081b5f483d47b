// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace truebox {

/// A monotone camera response, one for all planes of a photograph:
///   ln v = y(ln x),   y(0) = 0,   y' = gamma_j > 0 between knots of ln x,
/// x the linear exposure relative to `white`, v the reading relative to it. Local gammas of 1 are a
/// linear camera, all equal a power law; a tone curve's shoulder is a small gamma at the top.
/// Knots are evenly spaced over `decades` below white; the outer gammas hold beyond them.
class ResponseCurve {
 public:
  /// segments >= 1, decades > 0, white > 0.
  ResponseCurve(int segments, double decades, double white);

  struct Value {
    double reading = 0.0;
    double by_exposure = 0.0;      ///< d reading / d exposure
    std::vector<double> by_gamma;  ///< d reading / d gamma_j
  };
  /// exposure > 0; at or below 0 the reading is 0.
  Value at(double exposure, const std::vector<double>& gammas) const;

  int segments() const { return segments_; }
  /// Range of exposure / white that segment j covers.
  double low(int j) const;
  double high(int j) const;

 private:
  int segments_;
  double step_, white_;  // of ln x
};

}  // namespace truebox
