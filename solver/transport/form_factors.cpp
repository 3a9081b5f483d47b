// SPDX-License-Identifier: BSD-3-Clause
#include "transport/form_factors.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <numeric>
#include <stdexcept>

#include "transport/enclosure.h"
#include "transport/exact_form_factors.h"
#include "transport/form_factor.h"

namespace truebox {
namespace {

// Which side of each piece's plane a patch is on: bit 0 some in front, bit 1 some behind.
using Sides = std::vector<unsigned char>;

struct PatchShape {
  PlanarPolygon polygon;
  std::vector<Vec3> samples;  // quasi-random, uniform over the polygon
  Eigen::AlignedBox3d box;
  Sides sides;  // of every piece
};

constexpr int kSampleWindows = 64;

void leave_out(FormFactors& factors, Eigen::Index i) {
  factors.usable[static_cast<std::size_t>(i)] = 0;
  ++factors.summary.buried_patches;
  factors.exchange_area_m2.col(i).setZero();
  factors.exchange_area_m2.row(i).setZero();
}

// In a closed scene what sees nothing lies outside of it, as below the floor that a block is sunk
// into.
void leave_out_outside(FormFactors& factors, const Eigen::VectorXd& row_sums) {
  for (Eigen::Index i = 0; i < factors.size(); ++i)
    if (factors.usable[static_cast<std::size_t>(i)] && row_sums[i] < kEmptyRow)
      leave_out(factors, i);
}

// Changes sampled entries only, and writes down by how much.
void repair(FormFactors& factors, const std::vector<char>& usable,
            const std::vector<std::vector<std::uint32_t>>& sampled, ClosureRepair method) {
  const ClosureReport report =
      repair_closure(factors.exchange_area_m2, factors.area_m2, usable, sampled, method);
  FormFactorSummary& summary = factors.summary;
  summary.repair = method;
  summary.closure_error_max = report.error_before_max;
  summary.closure_error_mean = report.error_before_rms;
  summary.repair_max = report.change_max;
  summary.repair_rms = report.change_rms;
  summary.repair_negative = report.negative;
  summary.closure_residual_max = report.error_after_max;
}

// Elements that a surface crosses count with their free part in open scenes as in closed ones.
void take_free_areas_of_open(FormFactors& factors, const PatchMesh& mesh, const Scene& scene,
                             const Visibility& visibility) {
  for (Eigen::Index i = 0; i < factors.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!factors.usable[k]) continue;
    factors.area_m2[i] =
        free_area_in_open_m2(mesh, scene, visibility, k, factors.exchange_area_m2.col(i).sum());
    factors.summary.covered_patches += factors.area_m2[i] < mesh.patches[k].area_m2;
  }
}

class Builder {
 public:
  Builder(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
          const FormFactorOptions& options)
      : mesh_(mesh),
        scene_(scene),
        visibility_(visibility),
        options_(options),
        tolerance_m_(1e-9 * scene.diameter_m()) {
    make_shapes();
  }

  FormFactors build() {
    const auto n = static_cast<Eigen::Index>(mesh_.size());
    FormFactors result;
    result.area_m2.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) result.area_m2[i] = mesh_.patches[i].area_m2;
    result.exchange_area_m2 = Eigen::MatrixXd::Zero(n, n);
    sampled_.assign(static_cast<std::size_t>(n), {});
    std::atomic<Eigen::Index> done{0};
    std::mutex progress_lock;
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, n, 8), [&](const auto& range) {
      for (Eigen::Index i = range.begin(); i < range.end(); ++i)
        fill_row(i, result.exchange_area_m2);
      const Eigen::Index count = done += range.end() - range.begin();
      if (options_.progress) {
        const std::lock_guard guard(progress_lock);
        options_.progress("form factors", static_cast<double>(count) / static_cast<double>(n));
      }
    });
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = i + 1; j < n; ++j)
        result.exchange_area_m2(i, j) = result.exchange_area_m2(j, i);
    result.summary.pairs_unoccluded = unoccluded_;
    result.summary.pairs_hidden = hidden_;
    result.summary.pairs_sampled = partial_;
    result.summary.rays = rays_;
    mark_buried(result);
    const Eigen::VectorXd row_sums =
        result.exchange_area_m2.colwise().sum().transpose().cwiseQuotient(result.area_m2);
    whole_ = whole_patches(mesh_, scene_, result.usable, row_sums);
    const ClosureTest closure = test_closure(mesh_, scene_, visibility_, whole_, options_.seed);
    result.summary.closed = closure.closed;
    result.summary.closure_rays = closure.rays;
    if (result.summary.closed) {
      leave_out_outside(result, row_sums);
      // Noise makes some of these whole: their free part comes out wrong by as much.
      std::vector<Eigen::Index> covered;
      for (Eigen::Index i = 0; i < n; ++i)
        if (result.usable[static_cast<std::size_t>(i)] && !whole_[static_cast<std::size_t>(i)])
          covered.push_back(i);
      result.summary.covered_patches = covered.size();
      repair(result, whole_, sampled_, options_.repair);
      for (Eigen::Index i : covered) result.area_m2[i] = result.exchange_area_m2.col(i).sum();
    } else {
      take_free_areas_of_open(result, mesh_, scene_, visibility_);
    }
    result.summary.row_sum_max = 0.0;
    for (Eigen::Index i = 0; i < n; ++i)
      result.summary.row_sum_max = std::max(
          result.summary.row_sum_max, result.exchange_area_m2.col(i).sum() / result.area_m2[i]);
    return result;
  }

 private:
  void make_shapes() {
    shapes_.reserve(mesh_.size());
    Polygon polygon;
    for (std::size_t i = 0; i < mesh_.size(); ++i) {
      mesh_.polygon_of(mesh_.patches[i], polygon);
      PatchShape& shape = shapes_.emplace_back(PatchShape{PlanarPolygon(polygon), {}, {}, {}});
      make_samples(shape, i);
      for (const Vec3& v : polygon) shape.box.extend(v);
      shape.sides.assign(mesh_.pieces.size(), 0);
      for (std::size_t p = 0; p < mesh_.pieces.size(); ++p)
        for (const Vec3& v : polygon) {
          const double d = mesh_.pieces[p].plane.distance_m(v);
          if (d > tolerance_m_) shape.sides[p] |= 1;
          if (d < -tolerance_m_) shape.sides[p] |= 2;
        }
    }
    for (std::uint32_t p = 0; p < mesh_.pieces.size(); ++p)
      if (!scene_.surfaces[mesh_.pieces[p].surface].is_opening) blockers_.push_back(p);
    boxes_.resize(mesh_.pieces.size());
    piece_sides_.resize(mesh_.pieces.size());
    for (std::size_t p = 0; p < mesh_.pieces.size(); ++p) {
      for (const Vec3& v : mesh_.pieces[p].polygon) boxes_[p].extend(v);
      piece_sides_[p].assign(mesh_.pieces.size(), 0);
      for (std::size_t q = 0; q < mesh_.pieces.size(); ++q)
        for (const Vec3& v : mesh_.pieces[p].polygon)
          if (mesh_.pieces[q].plane.distance_m(v) > tolerance_m_) piece_sides_[p][q] |= 1;
    }
  }

  // Whether any surface can come between patches i and j.
  bool may_be_occluded(std::size_t i, std::size_t j) const {
    const std::uint32_t pi = mesh_.patches[i].piece, pj = mesh_.patches[j].piece;
    const Eigen::AlignedBox3d hull = shapes_[i].box.merged(shapes_[j].box);
    for (std::uint32_t b : blockers_) {
      if (b == pi || b == pj) continue;
      if ((shapes_[i].sides[b] | shapes_[j].sides[b]) != 3) continue;  // both on one side of it
      if (!(piece_sides_[b][pi] & 1) || !(piece_sides_[b][pj] & 1)) continue;  // behind one of them
      if (separated(boxes_[b], hull)) continue;
      return true;
    }
    return false;
  }

  bool separated(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) const {
    return ((a.min() - b.max()).array() > tolerance_m_).any() ||
           ((b.min() - a.max()).array() > tolerance_m_).any();
  }

  // An additive recurrence: every window of it is evenly spread, so each pair takes its own.
  void make_samples(PatchShape& shape, std::size_t i) const {
    constexpr double kPlastic = 1.32471795724474602596;  // root of x^3 = x + 1 (Roberts 2018)
    std::uint64_t state = hash(options_.seed ^ hash(i));
    double u = unit_interval(state);
    double v = unit_interval(hash(state));
    for (int k = 0; k < kSampleWindows + options_.rays; ++k) {
      u += 1.0 / kPlastic;
      v += 1.0 / (kPlastic * kPlastic);
      u -= std::floor(u);
      v -= std::floor(v);
      shape.samples.push_back(sample_polygon(shape.polygon.vertices, u, v));
    }
  }

  // Kernel-weighted visible share of the pair from quasi-random ray pairs.
  double visible_share(std::size_t i, std::size_t j, std::size_t& rays) const {
    const Vec3& ni = shapes_[i].polygon.plane.normal;
    const Vec3& nj = shapes_[j].polygon.plane.normal;
    const std::uint64_t bits = hash(options_.seed ^ hash(i * mesh_.size() + j));
    const Vec3* from = shapes_[i].samples.data() + bits % kSampleWindows;
    const Vec3* to = shapes_[j].samples.data() + (bits >> 20) % kSampleWindows;
    const auto count = static_cast<unsigned>(options_.rays);
    const auto shift = static_cast<unsigned>((bits >> 40) % count);
    double seen = 0.0, total = 0.0;
    for (unsigned k = 0; k < count; ++k) {
      if (k == count / 2 && (seen == 0.0 || seen == total)) break;
      const Vec3& a = from[k];
      const Vec3& b = to[(7 * k + shift) % count];  // another order, or the two walk in step
      const Vec3 r = b - a;
      const double cos_i = ni.dot(r), cos_j = -nj.dot(r);
      if (cos_i <= 0.0 || cos_j <= 0.0) continue;
      const double r2 = r.squaredNorm();
      const double weight = cos_i * cos_j / (r2 * r2);
      total += weight;
      ++rays;
      if (!visibility_.occluded(a, ni, b, nj)) seen += weight;
    }
    return total > 0.0 ? seen / total : 0.0;
  }

  void fill_row(Eigen::Index row, Eigen::MatrixXd& exchange) {
    const auto i = static_cast<std::size_t>(row);
    const std::uint32_t pi = mesh_.patches[i].piece;
    std::size_t unoccluded = 0, hidden = 0, partial = 0, rays = 0;
    // Column i below the diagonal is contiguous; the upper half is copied afterwards.
    for (std::size_t j = i + 1; j < mesh_.size(); ++j) {
      const std::uint32_t pj = mesh_.patches[j].piece;
      if (pi == pj || !(shapes_[i].sides[pj] & 1) || !(shapes_[j].sides[pi] & 1)) continue;
      double share = 1.0;
      const bool sampled = options_.occlusion && may_be_occluded(i, j);
      if (sampled) {
        share = visible_share(i, j, rays);
        if (share == 0.0) {
          ++hidden;
          continue;
        }
        ++partial;
        sampled_[i].push_back(static_cast<std::uint32_t>(j));
      } else {
        ++unoccluded;
      }
      exchange(static_cast<Eigen::Index>(j), row) =
          share * exchange_area_m2(shapes_[i].polygon, shapes_[j].polygon,
                                   sampled ? 1e-4 : options_.relative_tolerance);
    }
    unoccluded_ += unoccluded;
    hidden_ += hidden;
    partial_ += partial;
    rays_ += rays;
  }

  // A patch under a block sees nothing: every ray from it meets the back of a surface at once.
  void mark_buried(FormFactors& factors) const {
    factors.usable.assign(mesh_.size(), 1);
    for (std::size_t i = 0; i < mesh_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      if (factors.exchange_area_m2.col(row).sum() > kEmptyRow * factors.area_m2[row] ||
          !is_buried(mesh_, scene_, visibility_, i))
        continue;
      factors.usable[i] = 0;
      ++factors.summary.buried_patches;
      factors.exchange_area_m2.col(row).setZero();
      factors.exchange_area_m2.row(row).setZero();
    }
  }

  const PatchMesh& mesh_;
  const Scene& scene_;
  const Visibility& visibility_;
  const FormFactorOptions& options_;
  double tolerance_m_ = 0.0;
  std::vector<PatchShape> shapes_;
  std::vector<std::uint32_t> blockers_;
  std::vector<char> whole_;  // neither buried nor partly covered
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<Sides> piece_sides_;
  std::vector<std::vector<std::uint32_t>> sampled_;  // pairs i < j whose share came from rays
  std::atomic<std::size_t> unoccluded_{0}, hidden_{0}, partial_{0}, rays_{0};
};

}  // namespace

void require_memory(std::size_t elements, const FormFactorOptions& options) {
  const std::size_t bytes = elements * elements * sizeof(double);
  if (bytes <= options.memory_limit_bytes) return;
  const double fits = std::sqrt(static_cast<double>(options.memory_limit_bytes) / sizeof(double));
  throw std::length_error(std::to_string(elements) + " elements need " +
                          std::to_string(bytes >> 20) + " MiB of form factors, the limit is " +
                          std::to_string(options.memory_limit_bytes >> 20) + " MiB; that fits " +
                          std::to_string(static_cast<std::size_t>(fits)) +
                          " elements. Form factors that are streamed or hierarchical take less");
}

namespace {

FormFactors without_rays(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                         const FormFactorOptions& options) {
  ExactFormFactorOptions exact_options;
  exact_options.relative_tolerance = options.relative_tolerance;
  exact_options.occlusion = options.occlusion;
  exact_options.outline_points = options.outline_points;
  auto exact = exact_form_factors<double>(mesh, scene, exact_options, options.memory_limit_bytes);
  FormFactors result;
  result.exchange_area_m2 = std::move(exact.exchange_area_m2);
  result.area_m2 = std::move(exact.area_m2);
  result.usable = std::move(exact.usable);
  FormFactorSummary& summary = result.summary;
  summary.method = FormFactorMethod::exact_visibility;
  summary.pairs_unoccluded = exact.pairs_unoccluded;
  summary.pairs_hidden = exact.pairs_hidden;
  summary.pairs_sampled = exact.pairs_partial;
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    result.usable[k] = 1;
    if (result.exchange_area_m2.col(i).sum() < kNearlyEmptyRow * result.area_m2[i] &&
        is_buried(mesh, scene, visibility, k))
      leave_out(result, i);
  }
  const Eigen::VectorXd row_sums =
      result.exchange_area_m2.colwise().sum().transpose().cwiseQuotient(result.area_m2);
  const std::vector<char> tested = whole_patches(mesh, scene, result.usable, row_sums);
  const ClosureTest closure = test_closure(mesh, scene, visibility, tested, options.seed);
  summary.closed = closure.closed;
  summary.closure_rays = closure.rays;
  if (summary.closed) {
    leave_out_outside(result, row_sums);
    std::vector<char> whole = result.usable;
    std::vector<Eigen::Index> covered;
    for (Eigen::Index i = 0; i < result.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (!whole[k]) continue;
      if (!tested[k]) covered.push_back(i);
      if (!tested[k] || std::abs(row_sums[i] - 1.0) > kUnmendableRow) whole[k] = 0;
    }
    repair(result, whole, exact.partial, options.repair);
    for (Eigen::Index i : covered) result.area_m2[i] = result.exchange_area_m2.col(i).sum();
    summary.covered_patches = covered.size();
  } else {
    take_free_areas_of_open(result, mesh, scene, visibility);
  }
  summary.row_sum_max = 0.0;
  for (Eigen::Index i = 0; i < result.size(); ++i)
    summary.row_sum_max =
        std::max(summary.row_sum_max, result.exchange_area_m2.col(i).sum() / result.area_m2[i]);
  return result;
}

}  // namespace

FormFactors form_factors(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                         const FormFactorOptions& options) {
  require_memory(mesh.size(), options);
  if (options.method == FormFactorMethod::exact_visibility)
    return without_rays(mesh, scene, visibility, options);
  return Builder(mesh, scene, visibility, options).build();
}

}  // namespace truebox
