// SPDX-License-Identifier: BSD-3-Clause
// The rows of one rank. Internal to this folder.
#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <vector>

#include "transport/form_factors.h"
#include "transport/visibility.h"

namespace truebox::distributed {

/// How n rows are shared out: neighbours, and as many for each.
class Partition {
 public:
  Partition(MPI_Comm comm, std::size_t rows);

  Eigen::Index rows() const { return rows_; }
  Eigen::Index begin() const { return first_[static_cast<std::size_t>(rank_)]; }
  Eigen::Index local() const { return count_[static_cast<std::size_t>(rank_)]; }
  MPI_Comm comm() const { return comm_; }

  /// Puts every rank's part of a vector together, on every rank.
  void gather(const double* part, Eigen::VectorXd& whole) const;
  void gather(const double* part, Eigen::Index columns, BandMatrix& whole) const;
  void gather(const std::vector<char>& part, std::vector<char>& whole) const;
  double sum(double value) const;
  double max(double value) const;

 private:
  MPI_Comm comm_;
  int rank_ = 0;
  Eigen::Index rows_;
  std::vector<int> count_, first_;  // of each rank
};

/// Exchange areas A_i F_ij (m^2) of this rank's rows, closed by symmetric scaling as repair_closure
/// does it, the scale factors alone travelling between ranks.
class DistributedRows {
 public:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  DistributedRows(const Partition& partition, const PatchMesh& mesh, const Scene& scene,
                  const FormFactorOptions& options);

  const Matrix& exchange_area_m2() const { return rows_; }     ///< local x n
  const Eigen::VectorXd& area_m2() const { return area_m2_; }  ///< free, of all n
  const std::vector<char>& usable() const { return usable_; }
  const FormFactorSummary& summary() const { return summary_; }

 private:
  void fill(const PatchMesh& mesh, const Scene& scene, const FormFactorOptions& options);
  void leave_out_buried(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility);
  void leave_out_outside(const Eigen::VectorXd& own_sums);
  void repair();
  Eigen::VectorXd row_sums() const { return rows_.rowwise().sum(); }

  const Partition& partition_;
  Matrix rows_;
  std::vector<std::vector<std::uint32_t>> partial_;  // of each local row
  Eigen::VectorXd area_m2_;
  std::vector<char> usable_, tested_;  // tested: neither buried nor partly covered
  FormFactorSummary summary_;
};

}  // namespace truebox::distributed
