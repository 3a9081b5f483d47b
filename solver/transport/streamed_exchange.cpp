// SPDX-License-Identifier: BSD-3-Clause
#include "transport/streamed_exchange.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>

#include "transport/enclosure.h"
#include "transport/exact_form_factors.h"

namespace truebox {
namespace {

using Eigen::Index;

class StreamedExchange final : public ExchangeOperator {
 public:
  StreamedExchange(const PatchMesh& mesh, const Scene& scene, const ExactFormFactorOptions& options)
      : mesh_(mesh), scene_(scene), options_(options), row_sum_(static_cast<Index>(mesh.size())) {
    area_m2_.resize(row_sum_.size());
    for (Index i = 0; i < area_m2_.size(); ++i)
      area_m2_[i] = mesh.patches[static_cast<std::size_t>(i)].area_m2;
  }

  const Eigen::VectorXd& area_m2() const override { return area_m2_; }
  double row_sum_max() const override { return row_sum_max_; }

  BandMatrix product(const BandMatrix& x) const override {
    BandMatrix shown = x;
    for (Index i = 0; i < shown.rows(); ++i)
      if (!usable_[static_cast<std::size_t>(i)]) shown.row(i).setZero();
    BandMatrix sum = BandMatrix::Zero(x.rows(), x.cols());
    stream_form_factors(mesh_, scene_, options_, [&](std::size_t i, std::span<const double> row) {
      if (!usable_[i]) return;
      sum.row(static_cast<Index>(i)).noalias() =
          Eigen::Map<const Eigen::RowVectorXd>(row.data(), x.rows()) * shown;
    });
    return sum;
  }

  void row(Index i, Eigen::Ref<Eigen::VectorXd> values) const override {
    values.setZero();
    const auto patch = static_cast<std::size_t>(i);
    if (!usable_[patch]) return;
    stream_form_factors(mesh_, scene_, options_, patch, patch + 1, [&](const FormFactorRow& found) {
      for (Index j = 0; j < values.size(); ++j)
        if (usable_[static_cast<std::size_t>(j)])
          values[j] = found.exchange_area_m2[static_cast<std::size_t>(j)];
    });
  }

  // One pass that only looks: which rows sum to what, and which elements are buried.
  void survey(const Visibility& visibility, std::uint64_t seed, FormFactorSummary& summary) {
    std::mutex counting;
    stream_form_factors(mesh_, scene_, options_, 0, mesh_.size(), [&](const FormFactorRow& found) {
      double sum = 0.0;
      for (const double value : found.exchange_area_m2) sum += value;
      row_sum_[static_cast<Index>(found.patch)] = sum;
      const std::lock_guard lock(counting);
      summary.pairs_unoccluded += found.unoccluded;
      summary.pairs_hidden += found.hidden;
      summary.pairs_sampled += found.partial.size();
    });
    for (std::size_t* pairs :
         {&summary.pairs_unoccluded, &summary.pairs_hidden, &summary.pairs_sampled})
      *pairs /= 2;  // each was met from both sides
    usable_.assign(mesh_.size(), 1);
    for (std::size_t i = 0; i < mesh_.size(); ++i) {
      const auto row = static_cast<Index>(i);
      if (row_sum_[row] >= kNearlyEmptyRow * area_m2_[row] ||
          !is_buried(mesh_, scene_, visibility, i))
        continue;
      usable_[i] = 0;
      ++summary.buried_patches;
    }
    const ClosureTest closure = test_closure(mesh_, scene_, visibility, usable_, seed);
    summary.closed = closure.closed;
    summary.closure_rays = closure.rays;
    double squares = 0.0, area = 0.0;
    for (std::size_t i = 0; i < mesh_.size(); ++i) {
      if (!usable_[i]) continue;
      const auto row = static_cast<Index>(i);
      const double share = row_sum_[row] / area_m2_[row], error = std::abs(share - 1.0);
      row_sum_max_ = std::max(row_sum_max_, share);
      if (!summary.closed) continue;
      summary.closure_error_max = std::max(summary.closure_error_max, error);
      if (error > kPartlyBuriedRow) continue;
      squares += area_m2_[row] * error * error;
      area += area_m2_[row];
    }
    summary.closure_error_mean = area > 0.0 ? std::sqrt(squares / area) : 0.0;
    summary.closure_residual_max = summary.closure_error_max;
    summary.row_sum_max = row_sum_max_;
    summary.method = FormFactorMethod::exact_visibility;
  }

  const std::vector<char>& usable() const { return usable_; }

 private:
  const PatchMesh& mesh_;
  const Scene& scene_;
  ExactFormFactorOptions options_;
  Eigen::VectorXd area_m2_, row_sum_;
  std::vector<char> usable_;
  double row_sum_max_ = 0.0;
};

}  // namespace

FindExchange streamed_exchange() {
  return [](const ExchangeRequest& request) {
    ExactFormFactorOptions options;
    options.relative_tolerance = request.options.relative_tolerance;
    options.occlusion = request.options.occlusion;
    auto exchange = std::make_unique<StreamedExchange>(request.mesh, request.scene, options);
    FoundExchange found;
    exchange->survey(request.visibility, request.options.seed, found.summary);
    found.usable = exchange->usable();
    found.exchange = std::move(exchange);
    return found;
  };
}

}  // namespace truebox
