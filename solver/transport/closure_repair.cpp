// SPDX-License-Identifier: BSD-3-Clause
#include "transport/closure_repair.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace truebox {
namespace {

constexpr double kLeastShare = 1e-3;  // of a row that must be open to change
constexpr int kMostSweeps = 200;
constexpr double kTolerance = 1e-12;

class Repair {
 public:
  Repair(Eigen::MatrixXd& exchange, const Eigen::VectorXd& area, const std::vector<char>& usable,
         const std::vector<std::vector<std::uint32_t>>& entries)
      : exchange_(exchange), area_(area), usable_(usable), entries_(entries) {
    const Eigen::Index n = area.size();
    missing_ = area;
    open_ = Eigen::VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < n; ++i) missing_[i] -= exchange.col(i).sum();
    for_each([&](Eigen::Index i, Eigen::Index j, double s) {
      open_[i] += s;
      open_[j] += s;
      ++report.entries;
    });
    mended_.resize(static_cast<std::size_t>(n));
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      mended_[k] = usable[k] && open_[i] >= kLeastShare * area[i];
      report.rows_left_alone += usable[k] && !mended_[k];
    }
    double weighted = 0.0, total = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!usable[static_cast<std::size_t>(i)]) continue;
      const double error = std::abs(missing_[i]) / area[i];
      report.error_before_max = std::max(report.error_before_max, error);
      weighted += area[i] * error * error;
      total += area[i];
    }
    report.error_before_rms = total > 0.0 ? std::sqrt(weighted / total) : 0.0;
  }

  ClosureReport report;

  void scale() {
    const Eigen::Index n = area_.size();
    Eigen::VectorXd x = Eigen::VectorXd::Ones(n), sum(n);
    for (report.sweeps = 1; report.sweeps <= kMostSweeps; ++report.sweeps) {
      sum.setZero();
      for_each([&](Eigen::Index i, Eigen::Index j, double s) {
        sum[i] += s * x[j];
        sum[j] += s * x[i];
      });
      double change = 0.0;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (!mended_[static_cast<std::size_t>(i)]) continue;
        const double wanted = std::clamp((open_[i] + missing_[i]) / sum[i], 0.25, 4.0);
        const double next = std::sqrt(x[i] * wanted);  // half a step each: i and j both move
        change = std::max(change, std::abs(next - x[i]));
        x[i] = next;
      }
      if (change < kTolerance) break;
    }
    apply([&](Eigen::Index i, Eigen::Index j, double) { return x[i] * x[j]; });
  }

  // Normal equations (diag(W 1) + W) l = missing, W = S o S, by conjugate gradients.
  void least_squares() {
    const Eigen::Index n = area_.size();
    Eigen::VectorXd l = Eigen::VectorXd::Zero(n), r = missing_, p, product(n), scale(n);
    scale.setZero();
    for_each([&](Eigen::Index i, Eigen::Index j, double s) {
      scale[i] += s * s;
      scale[j] += s * s;
    });
    for (Eigen::Index i = 0; i < n; ++i)
      if (!mended_[static_cast<std::size_t>(i)]) r[i] = scale[i] = 0.0;
    const auto preconditioned = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
      return (scale.array() > 0.0).select(v.array() / scale.array().max(1e-300), 0.0);
    };
    Eigen::VectorXd z = preconditioned(r);
    p = z;
    double rz = r.dot(z);
    const double goal = kTolerance * kTolerance * rz;
    for (report.sweeps = 0; report.sweeps < kMostSweeps && rz > goal; ++report.sweeps) {
      product.setZero();
      for_each([&](Eigen::Index i, Eigen::Index j, double s) {
        const double both = s * s * (p[i] + p[j]);
        product[i] += both;
        product[j] += both;
      });
      for (Eigen::Index i = 0; i < n; ++i)
        if (!mended_[static_cast<std::size_t>(i)]) product[i] = 0.0;
      const double step = rz / p.dot(product);
      l += step * p;
      r -= step * product;
      z = preconditioned(r);
      const double next = r.dot(z);
      p = z + next / rz * p;
      rz = next;
    }
    apply([&](Eigen::Index i, Eigen::Index j, double s) { return 1.0 + s * (l[i] + l[j]); });
  }

 private:
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      for (std::uint32_t j : entries_[i])
        visit(row, static_cast<Eigen::Index>(j), exchange_(static_cast<Eigen::Index>(j), row));
    }
  }

  template <class Factor>
  void apply(const Factor& factor) {
    double squares = 0.0;
    std::size_t changed = 0;
    for_each([&](Eigen::Index i, Eigen::Index j, double s) {
      if (s == 0.0) return;
      double by = factor(i, j, s);
      if (by < 0.0) {
        ++report.negative;
        by = 0.0;
      }
      report.change_max = std::max(report.change_max, std::abs(by - 1.0));
      squares += (by - 1.0) * (by - 1.0);
      ++changed;
      exchange_(j, i) = exchange_(i, j) = s * by;
    });
    report.change_rms = changed > 0 ? std::sqrt(squares / static_cast<double>(changed)) : 0.0;
    for (Eigen::Index i = 0; i < area_.size(); ++i)
      if (usable_[static_cast<std::size_t>(i)])
        report.error_after_max =
            std::max(report.error_after_max, std::abs(exchange_.col(i).sum() / area_[i] - 1.0));
  }

  Eigen::MatrixXd& exchange_;
  const Eigen::VectorXd& area_;
  const std::vector<char>& usable_;
  const std::vector<std::vector<std::uint32_t>>& entries_;
  Eigen::VectorXd missing_, open_;  // of each row: what it lacks, what may change
  std::vector<char> mended_;
};

}  // namespace

std::string ClosureReport::brief() const {
  if (method == ClosureRepair::none) return "no repair";
  char text[256];
  std::snprintf(text, sizeof text,
                "%s: %zu entries changed by %.1e rms, %.1e at most; rows off by %.1e rms before, "
                "%.1e at most after (%d sweeps, %zu rows left alone, %zu entries set to 0)",
                method == ClosureRepair::scaling ? "symmetric scaling" : "weighted least squares",
                entries, change_rms, change_max, error_before_rms, error_after_max, sweeps,
                rows_left_alone, negative);
  return text;
}

ClosureReport repair_closure(Eigen::MatrixXd& exchange_area_m2, const Eigen::VectorXd& area_m2,
                             const std::vector<char>& usable,
                             const std::vector<std::vector<std::uint32_t>>& entries,
                             ClosureRepair method) {
  Repair repair(exchange_area_m2, area_m2, usable, entries);
  repair.report.method = method;
  repair.report.error_after_max = repair.report.error_before_max;
  if (method != ClosureRepair::none) repair.report.error_after_max = 0.0;
  if (method == ClosureRepair::scaling) repair.scale();
  if (method == ClosureRepair::least_squares) repair.least_squares();
  return repair.report;
}

}  // namespace truebox
