// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mesh/smooth_field.h"

namespace truebox {

/// Elements of one reflectance and functions w on them, orthonormal in the inner product
/// sum_i A_i v_i w_i; a part of a solution B = sum_j y_j w_j in every band.
class ReflectanceGroup {
 public:
  using Index = Eigen::Index;

  /// `elements` ascending; `rho`, `source` M: all elements x bands.
  ReflectanceGroup(std::vector<Index> elements, const Eigen::VectorXd& area_m2,
                   const BandMatrix& rho, const BandMatrix& source);

  Index size() const { return static_cast<Index>(elements_.size()); }
  const std::vector<Index>& elements() const { return elements_; }
  const Eigen::RowVectorXd& rho() const { return rho_; }
  /// Numbers of this group's functions among those of all groups.
  const std::vector<Index>& functions() const { return functions_; }

  /// Of each band: max |M + rho F B - B| and max |M + rho F B| on these elements.
  struct Sizes {
    Eigen::VectorXd residual, radiosity;
    /// The larger of both; NaN where there is one.
    void include(const Sizes& other);
  };
  /// Takes y, functions of all groups x bands.
  Sizes measure(const BandMatrix& coefficients);
  /// M + rho F B and A F B as last measured, into the rows of these elements.
  void put(BandMatrix& radiosity, BandMatrix& power) const;

  /// Makes new functions of as few bands' residuals as all bands' are combinations of, up to
  /// `leave` times what is allowed in each; elements x functions.
  BandMatrix extend(const Eigen::VectorXd& allowed, double leave);
  /// Numbers so many new functions from `first` on.
  void number(Index first, Index count);
  /// F w of the new functions of all groups: all elements x functions.
  void take(const BandMatrix& gathered);

  /// sum_i A_i w_i x_i of each function with columns of x, which has a row for each element of this
  /// group.
  BandMatrix project(const BandMatrix& x) const;
  /// The same of new functions with M.
  BandMatrix project_source(Index first) const;
  BandMatrix rows_of(const BandMatrix& all) const;

 private:
  std::vector<Index> bands_to_follow(const Eigen::VectorXd& allowed, double leave);
  std::vector<Index> chosen_on_sample(const Eigen::VectorXd& allowed, double leave) const;
  Eigen::MatrixXd orthonormal_part(const std::vector<Index>& bands,
                                   const Eigen::VectorXd& allowed) const;

  std::vector<Index> elements_, functions_, sample_;
  Eigen::VectorXd area_m2_;
  Eigen::RowVectorXd rho_;
  BandMatrix source_, residual_, irradiance_;
  BandMatrix vectors_;   // functions x elements
  BandMatrix values_;    // elements x functions, the same; room for more to the right
  BandMatrix gathered_;  // F w on these elements, elements x functions of all groups; room likewise
  Index gathered_count_ = 0;
  bool is_source_;
};

/// Groups of equal rows of `rho`; none where there are more than pay.
std::vector<ReflectanceGroup> reflectance_groups(const Eigen::VectorXd& area_m2,
                                                 const BandMatrix& rho, const BandMatrix& source);

}  // namespace truebox
