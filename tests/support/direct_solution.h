// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/LU>

#include "transport/form_factors.h"

namespace truebox {

/// B = M + diag(rho) F B by elimination, band by band: shares nothing with the solvers.
inline BandMatrix direct_solution(const FormFactors& f, const BandMatrix& rho,
                                  const BandMatrix& source) {
  BandMatrix b(rho.rows(), rho.cols());
  for (Eigen::Index k = 0; k < rho.cols(); ++k) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(f.size(), f.size());
    for (Eigen::Index i = 0; i < f.size(); ++i)
      a.row(i) -= rho(i, k) / f.area_m2[i] * f.exchange_area_m2.row(i);
    b.col(k) = a.partialPivLu().solve(source.col(k));
  }
  return b;
}

}  // namespace truebox
