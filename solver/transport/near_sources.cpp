// SPDX-License-Identifier: BSD-3-Clause
#include "transport/near_sources.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "transport/polygon_rule.h"
#include "transport/shaft_culling.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kNear = 3.0;   // sums of two radii
constexpr int kRulePoints = 2;  // a side: B within an element is taken to be linear, about

// Points of an element and what it sends from there beyond its mean.
struct Source {
  std::vector<Vec3> points;
  std::vector<double> weight_m2;
  BandMatrix excess;  // points x bands
};

class NearSources {
 public:
  NearSources(const PatchMesh& mesh, const Scene& scene, const Gather& gather,
              const std::vector<char>& usable, const Eigen::VectorXd& free_area_m2,
              const BandMatrix& direct_share, const BandMatrix& rest)
      : mesh_(mesh),
        scene_(scene),
        gather_(gather),
        usable_(usable),
        free_area_m2_(free_area_m2),
        direct_share_(direct_share),
        rest_(rest),
        culling_(mesh, scene, true) {
    for (const Patch& patch : mesh.patches) {
      Polygon& polygon = polygons_.emplace_back();
      mesh.polygon_of(patch, polygon);
      double radius_m = 0.0;
      for (const Vec3& v : polygon) radius_m = std::max(radius_m, (v - patch.centroid).norm());
      radius_m_.push_back(radius_m);
      largest_m_ = std::max(largest_m_, radius_m);
    }
    for (const Piece& piece : mesh.pieces) {
      Eigen::AlignedBox3d& box = boxes_.emplace_back();
      for (const Vec3& v : piece.polygon) box.extend(v);
    }
  }

  BandMatrix run() {
    const auto n = static_cast<std::uint32_t>(mesh_.size());
    std::vector<std::vector<std::uint32_t>> near(n);
    std::vector<char> is_source(n, 0);
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, n, 64), [&](const auto& range) {
      for (std::uint32_t i = range.begin(); i < range.end(); ++i) near[i] = sources_near(i);
    });
    for (const auto& of : near)
      for (std::uint32_t j : of) is_source[j] = 1;
    const SmoothField field(mesh_, usable_, rest_);
    std::vector<Source> sources(n);
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, n, 16), [&](const auto& range) {
      Gather::Scratch scratch;
      for (std::uint32_t j = range.begin(); j < range.end(); ++j)
        if (is_source[j]) sources[j] = make_source(j, field, scratch);
    });
    BandMatrix correction = BandMatrix::Zero(n, rest_.cols());
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, n, 16), [&](const auto& range) {
      Gather::Scratch scratch;
      std::vector<std::uint32_t> stack;
      for (std::uint32_t i = range.begin(); i < range.end(); ++i)
        for (std::uint32_t j : near[i]) {
          stack = culling_.blockers();
          const std::size_t to = stack.size();
          if (!culling_.keep_between(end_of(i), end_of(j), stack, 0, to)) continue;
          correction.row(i) +=
              received(i, j, sources[j], std::span(stack).subspan(to), scratch) / free_area_m2_[i];
        }
    });
    return correction;
  }

 private:
  ShaftEnd end_of(std::uint32_t patch) const {
    ShaftEnd end{polygons_[patch], mesh_.plane_of(mesh_.patches[patch]), {}, true};
    for (const Vec3& v : polygons_[patch]) end.box.extend(v);
    return end;
  }

  bool reflects(std::size_t surface) const {
    const auto& rho = scene_.material_of(scene_.surfaces[surface]).reflectance.values;
    return std::any_of(rho.begin(), rho.end(), [](double value) { return value > 0.0; });
  }

  std::vector<std::uint32_t> sources_near(std::uint32_t i) const {
    std::vector<std::uint32_t> found;
    if (!usable_[i]) return found;
    const Patch& patch = mesh_.patches[i];
    for (std::uint32_t p = 0; p < mesh_.pieces.size(); ++p) {
      const Piece& piece = mesh_.pieces[p];
      if (p == patch.piece || scene_.surfaces[piece.surface].is_opening ||
          !reflects(piece.surface) ||
          boxes_[p].exteriorDistance(patch.centroid) > kNear * (radius_m_[i] + largest_m_))
        continue;
      for (std::uint32_t j = piece.first_patch; j < piece.first_patch + piece.patch_count; ++j) {
        const double reach = kNear * (radius_m_[i] + radius_m_[j]);
        if (usable_[j] && free_area_m2_[j] == mesh_.patches[j].area_m2 &&
            (mesh_.patches[j].centroid - patch.centroid).squaredNorm() < reach * reach)
          found.push_back(j);
      }
    }
    return found;
  }

  Source make_source(std::uint32_t j, const SmoothField& field, Gather::Scratch& scratch) const {
    const Patch& patch = mesh_.patches[j];
    Source source;
    for_each_gauss_point(polygons_[j], kRulePoints, [&](const Vec3& point, double weight) {
      source.points.push_back(point);
      source.weight_m2.push_back(weight * patch.area_m2);
    });
    source.excess.resize(static_cast<Index>(source.points.size()), rest_.cols());
    Eigen::VectorXd value(rest_.cols()), direct(rest_.cols());
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(rest_.cols());
    for (std::size_t k = 0; k < source.points.size(); ++k) {
      const auto row = static_cast<Index>(k);
      field.evaluate(j, source.points[k], value);
      direct.setZero();
      gather_.add_direct(source.points[k], mesh_.plane_of(patch).normal, direct, scratch);
      source.excess.row(row) =
          value.transpose() + direct_share_.row(j).cwiseProduct(direct.transpose());
      mean += source.weight_m2[k] / patch.area_m2 * source.excess.row(row);
    }
    source.excess.rowwise() -= mean;
    return source;
  }

  // W nm^-1 beyond what a source of constant brightness sends; pieces `between` may hide a part.
  Eigen::RowVectorXd received(std::uint32_t i, std::uint32_t j, const Source& source,
                              std::span<const std::uint32_t> between,
                              Gather::Scratch& scratch) const {
    const Patch& patch = mesh_.patches[i];
    const Vec3& normal = mesh_.plane_of(mesh_.patches[j]).normal;
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(rest_.cols());
    for (std::size_t k = 0; k < source.points.size(); ++k) {
      const double factor = gather_.visible_factor(source.points[k], normal, polygons_[i],
                                                   patch.piece, between, scratch);
      if (factor > 0.0)
        sum += source.weight_m2[k] * factor * source.excess.row(static_cast<Index>(k));
    }
    return sum;
  }

  const PatchMesh& mesh_;
  const Scene& scene_;
  const Gather& gather_;
  const std::vector<char>& usable_;
  const Eigen::VectorXd& free_area_m2_;
  const BandMatrix& direct_share_;
  const BandMatrix& rest_;
  ShaftCulling culling_;
  std::vector<Polygon> polygons_;
  std::vector<double> radius_m_;
  double largest_m_ = 0.0;
  std::vector<Eigen::AlignedBox3d> boxes_;  // of the pieces
};

}  // namespace

BandMatrix near_source_correction(const PatchMesh& mesh, const Scene& scene, const Gather& gather,
                                  const std::vector<char>& usable,
                                  const Eigen::VectorXd& free_area_m2,
                                  const BandMatrix& direct_share, const BandMatrix& rest) {
  return NearSources(mesh, scene, gather, usable, free_area_m2, direct_share, rest).run();
}

}  // namespace truebox
