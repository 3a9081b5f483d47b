// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "mesh/smooth_field.h"

namespace truebox {

/// (I - diag(s_k) K diag(s_k)) v_k = f_k in every band k, K symmetric and the same in all of them.
/// Unknowns join without the old ones being factorised again; eight bands at a time, one a lane.
/// Cost: q^3 / 6 multiply-adds a band in all. Source: Golub & Van Loan (2013), sec. 4.2.
class BandSystems {
 public:
  explicit BandSystems(Eigen::Index bands);

  Eigen::Index size() const { return size_; }
  /// `rows`: K of the new unknowns with the old and the new ones, p x (size + p); `scale`: s of the
  /// new ones, p x bands. False, and of no more use, where a system is not positive definite.
  [[nodiscard]] bool append(const BandMatrix& rows, const BandMatrix& scale);
  /// v of f, both size x bands.
  BandMatrix solve(const BandMatrix& f) const;

 private:
  struct alignas(64) Lanes {
    double of_band[8];
  };
  struct EightBands {
    std::vector<std::unique_ptr<Lanes[]>> memory;  // of the rows that joined together
    std::vector<Lanes*> rows;                      // of L, 1 / L_ii on the diagonal
    std::vector<Lanes> scale;                      // s
  };
  bool append(const BandMatrix& rows, const BandMatrix& scale, Eigen::Index first,
              EightBands& eight) const;
  Eigen::Index size_ = 0, bands_;
  std::vector<EightBands> eights_;
};

}  // namespace truebox
