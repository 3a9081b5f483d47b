// SPDX-License-Identifier: BSD-3-Clause
#include "adaptive/cell_errors.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>

#include "transport/direct_light.h"
#include "transport/gather.h"
#include "transport/sensitivity.h"
#include "transport/solve_radiosity.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kDuals = 6;          // sets of random signs, one for every band in each
constexpr double kLongest = 10.0;  // length over width: longer cells are halved across only
constexpr double kSolved = 1e-6;
// Squares of what halving leaves of the field's error in that direction (third order would be
// 1/64, an edge's x^0.6 1/2.3) and of what belongs to neither direction.
constexpr double kLeftAlong = 0.25, kLeftOfRest = 0.5;

// Length of a cell across a cut over its length along it.
double length_over_width(const Polygon& p, int direction) {
  if (p.size() == 3) {
    const auto k = static_cast<std::size_t>(direction);
    const double edge = (p[(k + 1) % 3] - p[k]).norm();
    return edge * edge / (2.0 * area_vector(p).norm());
  }
  const double u = (p[1] + p[2] - p[0] - p[3]).norm(), v = (p[2] + p[3] - p[0] - p[1]).norm();
  return direction == 0 ? u / v : v / u;
}

// How much of each quarter (in the order of CellTree::mesh) lies in a cell's first half.
std::array<double, 4> first_half(std::size_t corners, int direction) {
  if (corners == 4) return direction == 0 ? std::array{1., 1., 0., 0.} : std::array{1., 0., 1., 0.};
  std::array<double, 4> share = {0.5, 0.5, 0.5, 0.5};
  share[static_cast<std::size_t>(direction)] = 1.0;
  share[static_cast<std::size_t>(direction + 1) % 3] = 0.0;
  return share;
}

// The solution on quartered cells: four rows a cell.
struct Quarters {
  PatchMesh mesh;
  std::vector<std::uint32_t> cell_of;
  std::vector<char> counts;
  BandMatrix reflected, indirect, total;
  std::vector<BandMatrix> dual;
};

class Errors {
 public:
  Errors(const CellTree& cells, const Quarters& quarters, const BandMatrix& field_error,
         const Eigen::VectorXd& field_weight)
      : cells_(cells), q_(quarters), field_error_(field_error), field_weight_(field_weight) {}

  CellError of(Index first) const {
    const Polygon& corners = cells_.cell(q_.cell_of[static_cast<std::size_t>(first)]).corners;
    CellError error;
    const double field = field_square(first);
    error.square = sent_square(first, {1.0, 1.0, 1.0, 1.0}) + field;
    error.halved_square = error.square;
    for (int d = 0; d < CellTree::directions(corners); ++d) {
      if (length_over_width(corners, d) < 1.0 / kLongest) continue;
      const std::array<double, 4> half = first_half(corners.size(), d);
      std::array<double, 4> other;
      for (std::size_t k = 0; k < 4; ++k) other[k] = 1.0 - half[k];
      const double left =
          sent_square(first, half) + sent_square(first, other) + field_left(first, field, half);
      if (left < error.halved_square) error.halved_square = left, error.direction = d;
    }
    return error;
  }

 private:
  double area(Index row) const { return q_.mesh.patches[static_cast<std::size_t>(row)].area_m2; }

  // Mean square over signs and bands of int (R - mean R) Z over a part of the cell.
  double sent_square(Index first, const std::array<double, 4>& share) const {
    const Index bands = q_.reflected.cols();
    double total = 0.0;
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(bands);
    for (Index k = 0; k < 4; ++k) {
      const double weight = share[static_cast<std::size_t>(k)] * area(first + k);
      total += weight;
      mean += weight * q_.reflected.row(first + k);
    }
    mean /= total;
    double sum = 0.0;
    for (const BandMatrix& z : q_.dual) {
      Eigen::RowVectorXd eta = Eigen::RowVectorXd::Zero(bands);
      for (Index k = 0; k < 4; ++k)
        eta += share[static_cast<std::size_t>(k)] * area(first + k) *
               (q_.reflected.row(first + k) - mean).cwiseProduct(z.row(first + k));
      sum += eta.squaredNorm();
    }
    return sum / static_cast<double>(q_.dual.size() * static_cast<std::size_t>(bands));
  }

  double field_square(Index first) const {
    double sum = 0.0;
    for (Index k = 0; k < 4; ++k)
      sum += field_weight_[first + k] * field_error_.row(first + k).squaredNorm();
    return sum / static_cast<double>(field_error_.cols());
  }

  // What differs between the halves is what halving mends.
  double field_left(Index first, double square, const std::array<double, 4>& half) const {
    if (square == 0.0) return 0.0;
    Eigen::RowVectorXd along = Eigen::RowVectorXd::Zero(field_error_.cols());
    double all = 0.0;
    for (Index k = 0; k < 4; ++k) {
      along += (2.0 * half[static_cast<std::size_t>(k)] - 1.0) * field_error_.row(first + k);
      all += field_error_.row(first + k).squaredNorm();
    }
    const double share = all > 0.0 ? std::min(1.0, 0.25 * along.squaredNorm() / all) : 0.0;
    return square * (share * kLeftAlong + (1.0 - share) * (0.5 + 0.5 * kLeftOfRest));
  }

  const CellTree& cells_;
  const Quarters& q_;
  const BandMatrix& field_error_;
  const Eigen::VectorXd& field_weight_;
};

// dB / d ln rho of the goal's material, over each element's own rho; lamps are not observed.
BandMatrix observed_sensitivity(const Quarters& q, const Scene& scene, const Goal& goal,
                                const FormFactors& factors, const BandMatrix& rho,
                                const BandMatrix& direct, const SolveOptions& options) {
  const auto material_of = [&](std::size_t i) {
    return scene.surfaces[q.mesh.surface_of(q.mesh.patches[i])].material;
  };
  std::vector<char> is_in_material(q.mesh.size());
  for (std::size_t i = 0; i < q.mesh.size(); ++i)
    is_in_material[i] = material_of(i) == goal.material;
  const DenseExchange exchange(factors);
  BandMatrix derivative;
  reflectance_sensitivity({exchange, rho, direct, q.indirect}, is_in_material, options, derivative);
  for (Index i = 0; i < derivative.rows(); ++i) {
    const bool is_lamp = scene.materials[material_of(static_cast<std::size_t>(i))].emits();
    for (Index b = 0; b < derivative.cols(); ++b)
      derivative(i, b) = is_lamp || rho(i, b) <= 0.0 ? 0.0 : derivative(i, b) / rho(i, b);
  }
  const auto& reflectance = scene.materials[goal.material].reflectance.values;
  return derivative *
         Eigen::Map<const Eigen::VectorXd>(reflectance.data(), derivative.cols()).asDiagonal();
}

Quarters solve_quarters(const CellTree& cells, const Scene& scene, const Requirements& needs,
                        const Goal& goal, const FormFactorOptions& options,
                        std::mt19937_64& random) {
  Quarters q;
  q.mesh = cells.mesh(1, &q.cell_of);
  const Gather gather(q.mesh, scene, needs.occlusion);
  const auto n = static_cast<Index>(q.mesh.size()), bands = static_cast<Index>(scene.bands.size());
  const BandMatrix direct = mean_direct(q.mesh, scene, gather, element_tree(q.mesh),
                                        ShaftCulling(q.mesh, scene, needs.occlusion));
  BandMatrix rho(n, bands);
  for (Index i = 0; i < n; ++i)
    rho.row(i) = Eigen::Map<const Eigen::RowVectorXd>(
        scene
            .material_of(
                scene.surfaces[q.mesh.surface_of(q.mesh.patches[static_cast<std::size_t>(i)])])
            .reflectance.values.data(),
        bands);
  FormFactorOptions factor_options = options;
  factor_options.occlusion = needs.occlusion;
  factor_options.method = FormFactorMethod::exact_visibility;
  const FormFactors factors =
      form_factors(q.mesh, scene, Visibility(q.mesh, scene), factor_options);
  SolveOptions solve;
  solve.relative_bound = kSolved;
  solve_radiosity(factors, rho, rho.cwiseProduct(direct), solve, q.reflected, {}, &q.indirect);
  q.total = direct + q.indirect;
  q.counts = factors.usable;
  for (std::size_t i = 0; i < q.mesh.size(); ++i)
    q.counts[i] &= !scene.surfaces[q.mesh.surface_of(q.mesh.patches[i])].is_opening;
  const SmoothField places(q.mesh, factors.usable, q.indirect);
  BandMatrix sensitivity;
  if (goal.kind == Goal::Kind::parameter)
    sensitivity = observed_sensitivity(q, scene, goal, factors, rho, direct, solve);
  for (int d = 0; d < (goal.is_random() ? kDuals : 1); ++d) {
    BandMatrix psi;
    solve_radiosity(factors, rho,
                    dual_source(goal, q.mesh, q.counts, q.total, places, sensitivity, random),
                    solve, psi, {}, &q.dual.emplace_back());
  }
  return q;
}

// Of each quarter: its irradiance less what the smooth field of the cells' means says, relative.
BandMatrix errors_between(const CellTree& cells, const Quarters& q, const Goal& goal) {
  const PatchMesh mesh = cells.mesh(0);
  const auto n = static_cast<Index>(mesh.size());
  BandMatrix means = BandMatrix::Zero(n, q.indirect.cols());
  std::vector<char> usable(mesh.size());
  for (Index i = 0; i < n; ++i) {
    double area = 0.0;
    usable[static_cast<std::size_t>(i)] = 1;
    for (Index k = 4 * i; k < 4 * i + 4; ++k) {
      const double part = q.mesh.patches[static_cast<std::size_t>(k)].area_m2;
      means.row(i) += part * q.indirect.row(k);
      area += part;
      usable[static_cast<std::size_t>(i)] &= q.counts[static_cast<std::size_t>(k)];
    }
    means.row(i) /= area;
  }
  const SmoothField field(mesh, usable, means);
  BandMatrix error = q.indirect;
  tbb::parallel_for(tbb::blocked_range<Index>(0, n), [&](const auto& range) {
    Eigen::VectorXd value(q.indirect.cols());
    Polygon quarter;
    for (Index i = range.begin(); i < range.end(); ++i) {
      if (!usable[static_cast<std::size_t>(i)]) {
        error.middleRows(4 * i, 4).setZero();
        continue;
      }
      for (Index k = 4 * i; k < 4 * i + 4; ++k) {
        q.mesh.polygon_of(q.mesh.patches[static_cast<std::size_t>(k)], quarter);
        for (const Polygon& part : CellTree::quarters(quarter)) {
          field.evaluate(static_cast<std::uint32_t>(i), centroid(part), value);
          error.row(k) -= 0.25 * value.transpose();
        }
      }
    }
  });
  return error.cwiseProduct(inverse_irradiance(goal, q.mesh, q.counts, q.total));
}

}  // namespace

std::vector<CellError> cell_errors(const CellTree& cells, const Scene& scene,
                                   const Requirements& needs, const Goal& goal,
                                   const FormFactorOptions& options, std::mt19937_64& random) {
  const Quarters q = solve_quarters(cells, scene, needs, goal, options, random);
  const BandMatrix field_error = errors_between(cells, q, goal);
  const SmoothField places(q.mesh, q.counts, q.indirect);
  const Eigen::VectorXd weight = field_weights(goal, q.mesh, q.counts, places);
  const Errors errors(cells, q, field_error, weight);
  std::vector<CellError> all(cells.size());
  for (Index first = 0; first < q.indirect.rows(); first += 4)
    if (q.counts[static_cast<std::size_t>(first)])
      all[q.cell_of[static_cast<std::size_t>(first)]] = errors.of(first);
  return all;
}

}  // namespace truebox
