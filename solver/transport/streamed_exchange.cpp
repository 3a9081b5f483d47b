// SPDX-License-Identifier: BSD-3-Clause
#include "transport/streamed_exchange.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "transport/enclosure.h"
#include "transport/exact_form_factors.h"

namespace truebox {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLeastShare = 1e-3;  // of a row that must be open to change, as in repair_closure
constexpr double kClosed = 1e-12;     // of a row's area
constexpr double kForcing = 1e-3;     // of Newton's step: it squares the error, about
constexpr int kNewtonSteps = 6, kInnerSteps = 30;

class StreamedExchange final : public ExchangeOperator {
 public:
  explicit StreamedExchange(const ExchangeRequest& request)
      : mesh_(request.mesh), scene_(request.scene), area_m2_(mesh_.size()) {
    options_.relative_tolerance = request.options.relative_tolerance;
    options_.occlusion = request.options.occlusion;
    options_.outline_points = request.options.outline_points;
    for (std::size_t i = 0; i < mesh_.size(); ++i)
      area_m2_[static_cast<Index>(i)] = mesh_.patches[i].area_m2;
    scale_ = VectorXd::Ones(area_m2_.size());
    usable_.assign(mesh_.size(), 1);
    summary_.method = FormFactorMethod::exact_visibility;
    leave_out_buried(request.visibility);
    tested_ =
        whole_patches(mesh_, scene_, usable_, (first_.fixed + first_.open).cwiseQuotient(area_m2_));
    const ClosureTest closure =
        test_closure(mesh_, scene_, request.visibility, tested_, request.options.seed);
    summary_.closed = closure.closed;
    summary_.closure_rays = closure.rays;
    if (summary_.closed) leave_out_outside();
    if (summary_.closed) repair();
    const RowSums sums = row_sums(scale_);
    for (Index i : covered_) area_m2_[i] = sums.fixed[i] + sums.open[i];
    summary_.covered_patches = covered_.size();
    if (!summary_.closed) take_free_areas_of_open(request.visibility, sums.fixed + sums.open);
    const VectorXd whole = (sums.fixed + sums.open).cwiseQuotient(area_m2_);
    summary_.row_sum_max = whole.maxCoeff();
    for (std::size_t i = 0; summary_.closed && i < usable_.size(); ++i)
      if (is_whole_[i])
        summary_.closure_residual_max =
            std::max(summary_.closure_residual_max, std::abs(whole[static_cast<Index>(i)] - 1.0));
    summary_.streamed_passes = passes_;
  }

  const VectorXd& area_m2() const override { return area_m2_; }
  double row_sum_max() const override { return summary_.row_sum_max; }

  BandMatrix product(const BandMatrix& x) const override {
    BandMatrix y = BandMatrix::Zero(x.rows(), x.cols());
    stream_form_factors(mesh_, scene_, options_, 0, mesh_.size(), [&](const FormFactorRow& row) {
      if (!usable_[row.patch]) return;
      const VectorXd values = scaled(row);
      y.row(static_cast<Index>(row.patch)).noalias() = values.transpose() * x;
    });
    return y;
  }

  void row(Index i, Eigen::Ref<VectorXd> values) const override {
    const auto patch = static_cast<std::size_t>(i);
    values.setZero();
    stream_form_factors(mesh_, scene_, options_, patch, patch + 1, [&](const FormFactorRow& row) {
      if (usable_[patch]) values = scaled(row);
    });
  }

  const std::vector<char>& usable() const { return usable_; }
  const FormFactorSummary& summary() const { return summary_; }

 private:
  // What each row sends to wholly visible patches and to partly hidden ones, m^2; the latter
  // scaled.
  struct RowSums {
    VectorXd fixed, open;
    VectorXd pairs[3];  // unoccluded, hidden, partly hidden
  };

  VectorXd scaled(const FormFactorRow& row) const {
    VectorXd values = Eigen::Map<const VectorXd>(row.exchange_area_m2.data(), area_m2_.size());
    const double own = scale_[static_cast<Index>(row.patch)];
    for (std::uint32_t j : row.partial) values[j] *= own * scale_[j];
    for (Index j = 0; j < values.size(); ++j)
      if (!usable_[static_cast<std::size_t>(j)]) values[j] = 0.0;
    return values;
  }

  // open_i = x_i sum_j S_ij y_j over the partly hidden pairs.
  RowSums row_sums(const VectorXd& x, const VectorXd& y) {
    RowSums sums{VectorXd::Zero(x.size()), VectorXd::Zero(x.size()), {}};
    for (VectorXd& count : sums.pairs) count.setZero(x.size());
    stream_form_factors(mesh_, scene_, options_, 0, mesh_.size(), [&](const FormFactorRow& row) {
      const auto i = static_cast<Index>(row.patch);
      if (!usable_[row.patch]) return;
      double all = 0.0, partial = 0.0, weighted = 0.0;
      for (std::size_t j = 0; j < usable_.size(); ++j)
        if (usable_[j]) all += row.exchange_area_m2[j];
      for (std::uint32_t j : row.partial)
        if (usable_[j]) {
          partial += row.exchange_area_m2[j];
          weighted += row.exchange_area_m2[j] * y[j];
        }
      sums.fixed[i] = all - partial;
      sums.open[i] = x[i] * weighted;
      sums.pairs[0][i] = static_cast<double>(row.unoccluded);
      sums.pairs[1][i] = static_cast<double>(row.hidden);
      sums.pairs[2][i] = static_cast<double>(row.partial.size());
    });
    ++passes_;
    return sums;
  }
  RowSums row_sums(const VectorXd& x) { return row_sums(x, x); }

  void leave_out_buried(const Visibility& visibility) {
    first_ = row_sums(scale_);
    std::size_t* const counts[] = {&summary_.pairs_unoccluded, &summary_.pairs_hidden,
                                   &summary_.pairs_sampled};
    for (int k = 0; k < 3; ++k)  // each pair is in two rows
      *counts[k] = static_cast<std::size_t>(0.5 * first_.pairs[k].sum());
    for (std::size_t i = 0; i < usable_.size(); ++i) {
      const auto k = static_cast<Index>(i);
      if (first_.fixed[k] + first_.open[k] >= kNearlyEmptyRow * area_m2_[k]) continue;
      usable_[i] = !is_buried(mesh_, scene_, visibility, i);
      summary_.buried_patches += !usable_[i];
    }
    if (summary_.buried_patches > 0) first_ = row_sums(scale_);
  }

  void take_free_areas_of_open(const Visibility& visibility, const VectorXd& row_sums_m2) {
    for (std::size_t i = 0; i < usable_.size(); ++i) {
      if (!usable_[i]) continue;
      const auto k = static_cast<Index>(i);
      area_m2_[k] = free_area_in_open_m2(mesh_, scene_, visibility, i, row_sums_m2[k]);
      summary_.covered_patches += area_m2_[k] < mesh_.patches[i].area_m2;
    }
  }

  // In a closed scene what sees nothing lies outside of it; its row is empty.
  void leave_out_outside() {
    for (std::size_t i = 0; i < usable_.size(); ++i) {
      const auto k = static_cast<Index>(i);
      if (!usable_[i] || first_.fixed[k] + first_.open[k] >= kEmptyRow * area_m2_[k]) continue;
      usable_[i] = 0;
      ++summary_.buried_patches;
    }
  }

  // x_i sum_j S_ij x_j = wanted_i in the rows that can be mended, x = 1 in the others.
  void repair() {
    const Index n = area_m2_.size();
    const VectorXd wanted = area_m2_ - first_.fixed;
    VectorXd mended = VectorXd::Zero(n);
    is_whole_.assign(usable_.size(), 0);
    double weighted = 0.0, area = 0.0;
    for (Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double row_sum = (first_.fixed[i] + first_.open[i]) / area_m2_[i];
      const double error = std::abs(row_sum - 1.0);
      if (usable_[k] && !tested_[k]) covered_.push_back(i);
      is_whole_[k] = tested_[k] && error <= kUnmendableRow;
      if (!is_whole_[k]) continue;
      mended[i] = first_.open[i] >= kLeastShare * area_m2_[i] ? 1.0 : 0.0;
      summary_.closure_error_max = std::max(summary_.closure_error_max, error);
      weighted += area_m2_[i] * error * error;
      area += area_m2_[i];
    }
    summary_.closure_error_mean = area > 0.0 ? std::sqrt(weighted / area) : 0.0;
    VectorXd open = first_.open;
    for (int step = 0; step < kNewtonSteps; ++step) {
      const VectorXd residual = mended.cwiseProduct(wanted - open);
      if (!(residual.cwiseQuotient(area_m2_).cwiseAbs().maxCoeff() > kClosed)) break;
      scale_ = scale_.cwiseProduct(newton_step(residual, open, mended).array().exp().matrix());
      open = row_sums(scale_).open;
    }
    summary_.repair_max = std::pow(scale_.maxCoeff(), 2) - 1.0;
    summary_.repair_max = std::max(summary_.repair_max, 1.0 - std::pow(scale_.minCoeff(), 2));
  }

  // (P + diag(P 1)) d = residual, P = diag(x) S diag(x) on the rows that are mended.
  VectorXd newton_step(const VectorXd& residual, const VectorXd& open, const VectorXd& mended) {
    const VectorXd diagonal = open.cwiseMax(1e-300);
    VectorXd d = VectorXd::Zero(residual.size()), r = residual;
    VectorXd z = r.cwiseQuotient(diagonal), p = z;
    double rz = r.dot(z);
    const double goal = kForcing * kForcing * rz;
    for (int step = 0; step < kInnerSteps && rz > goal; ++step) {
      const VectorXd product = mended.cwiseProduct(row_sums(scale_, scale_.cwiseProduct(p)).open) +
                               diagonal.cwiseProduct(p);
      const double alpha = rz / p.dot(product);
      d += alpha * p;
      r -= alpha * product;
      z = r.cwiseQuotient(diagonal);
      const double next = r.dot(z);
      p = z + next / rz * p;
      rz = next;
    }
    return d;
  }

  const PatchMesh& mesh_;
  const Scene& scene_;
  ExactFormFactorOptions options_;
  VectorXd area_m2_, scale_;
  std::vector<char> usable_, tested_, is_whole_;
  std::vector<Index> covered_;  // partly
  RowSums first_;               // before the repair
  FormFactorSummary summary_;
  int passes_ = 0;
};

}  // namespace

FoundExchange streamed_exchange(const ExchangeRequest& request) {
  auto exchange = std::make_unique<StreamedExchange>(request);
  FoundExchange found;
  found.usable = exchange->usable();
  found.summary = exchange->summary();
  found.exchange = std::move(exchange);
  return found;
}

}  // namespace truebox
