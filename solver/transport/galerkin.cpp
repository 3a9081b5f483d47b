// SPDX-License-Identifier: BSD-3-Clause
#include "transport/galerkin.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "scene/requirements.h"
#include "transport/enclosure.h"
#include "transport/moment_integrals.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kResidualPoints = 8;  // each way, crowded towards the edges: see the test

// Whether some of b lies before a.
bool sees(const PolynomialElement& a, const PolynomialElement& b) {
  double farthest = 0.0, size = 0.0;
  for (const Vec3& corner : b.corners()) {
    farthest = std::max(farthest, a.plane_distance_m(corner));
    size = std::max(size, (corner - a.corners()[0]).norm());
  }
  return farthest > 1e-10 * size;
}

}  // namespace

std::string GalerkinOptions::invalid() const {
  if (degree < 0 || degree > kMaxElementDegree) return "degree must lie in [0, 6]";
  if (!(relative_tolerance >= 1e-13 && relative_tolerance < 1.0))
    return "relative_tolerance must lie in [1e-13, 1)";
  if (!(relative_bound > 0.0 && relative_bound < 1.0)) return "relative_bound must lie in (0, 1)";
  return {};
}

GalerkinSystem::GalerkinSystem(const PatchMesh& mesh, const Scene& scene,
                               const GalerkinOptions& options)
    : options_(options), surface_count_(scene.surfaces.size()) {
  if (const std::string why = options.invalid(); !why.empty()) throw std::invalid_argument(why);
  std::unique_ptr<Visibility> rays;
  if (requirements(scene).occlusion) {
    visible_ = std::make_shared<VisibleMoments>(mesh, scene);
    rays = std::make_unique<Visibility>(mesh, scene);
  }
  Polygon polygon;
  for (std::size_t p = 0; p < mesh.size(); ++p) {
    const Patch& patch = mesh.patches[p];
    const std::size_t surface = mesh.surface_of(patch);
    if (scene.surfaces[surface].is_opening || (rays && is_buried(mesh, scene, *rays, p))) continue;
    mesh.polygon_of(patch, polygon);
    for (PolynomialElement& element : polynomial_elements(polygon, options.degree)) {
      elements_.push_back(std::move(element));
      surface_.push_back(surface);
    }
  }
  number_unknowns();
  FormFactorOptions memory;
  memory.memory_limit_bytes = options.memory_limit_bytes;
  require_memory(static_cast<std::size_t>(first_.back()), memory);
  integrate_kernel();
}

void GalerkinSystem::number_unknowns() {
  first_ = {0};
  for (const PolynomialElement& e : elements_) first_.push_back(first_.back() + e.functions());
  factors_.area_m2 = Eigen::VectorXd::Ones(first_.back());
  factors_.usable.assign(static_cast<std::size_t>(first_.back()), 1);
  factors_.summary.row_sum_max = 1.0;
}

void GalerkinSystem::integrate_kernel() {
  Eigen::MatrixXd& k = factors_.exchange_area_m2;
  k = Eigen::MatrixXd::Zero(first_.back(), first_.back());
  tbb::parallel_for(std::size_t{0}, elements_.size(), [&](std::size_t i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!sees(elements_[i], elements_[j]) || !sees(elements_[j], elements_[i])) continue;
      const Eigen::MatrixXd block = moments_of(elements_[i], elements_[j]);
      k.block(first_[i], first_[j], block.rows(), block.cols()) = block;
      k.block(first_[j], first_[i], block.cols(), block.rows()) = block.transpose();
    }
  });
}

Eigen::MatrixXd GalerkinSystem::moments_of(const PolynomialElement& i,
                                           const PolynomialElement& j) const {
  if (visible_) {
    const auto between = visible_->between(i, j);
    if (!between.empty() || !faces_wholly(i, j)) return visible_->exchange(i, j, between);
  }
  return exchange_moments(i, j, options_.relative_tolerance);
}

std::vector<Index> GalerkinSystem::unknowns_of_degree(int degree) const {
  std::vector<Index> kept;
  for (std::size_t e = 0; e < elements_.size(); ++e)
    for (int f = 0; f < elements_[e].functions(); ++f)
      if (elements_[e].has_at_degree(f, degree)) kept.push_back(first_[e] + f);
  return kept;
}

GalerkinSystem GalerkinSystem::at_degree(int degree) const {
  GalerkinSystem lower;
  lower.options_ = options_;
  lower.options_.degree = degree;
  if (const std::string why = lower.options_.invalid(); !why.empty() || degree > options_.degree)
    throw std::invalid_argument("degree must lie in [0, " + std::to_string(options_.degree) + "]");
  lower.surface_count_ = surface_count_;
  lower.visible_ = visible_;
  lower.surface_ = surface_;
  for (std::size_t e = 0; e < elements_.size(); ++e) {
    const auto& c = elements_[e].corners();
    Polygon polygon(c.begin(), c.begin() + (elements_[e].is_triangle() ? 3 : 4));
    lower.elements_.emplace_back(polygon, degree);
  }
  const std::vector<Index> kept = unknowns_of_degree(degree);
  lower.number_unknowns();
  lower.factors_.exchange_area_m2 = kernel()(kept, kept);
  return lower;
}

Eigen::VectorXd GalerkinSystem::project(const Function& function) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(unknowns());
  const int points = options_.degree + 4;
  const GaussRule& rule = gauss_rule(points);
  double phi[kMaxFunctions];
  for (std::size_t e = 0; e < elements_.size(); ++e)
    for (int l = 0; l < points; ++l)
      for (int k = 0; k < points; ++k) {
        const double u = rule.nodes[l], v = rule.nodes[k];
        elements_[e].evaluate(u, v, phi);
        const double w = rule.weights[l] * rule.weights[k] * elements_[e].jacobian_m2(u) *
                         function(surface_[e], elements_[e].at(u, v));
        for (int f = 0; f < elements_[e].functions(); ++f) result[first_[e] + f] += w * phi[f];
      }
  return result;
}

BandMatrix GalerkinSystem::project_constants(const BandMatrix& exitance) const {
  BandMatrix source = BandMatrix::Zero(unknowns(), exitance.cols());
  for (std::size_t e = 0; e < elements_.size(); ++e)
    source.row(first_[e]) =
        std::sqrt(elements_[e].area_m2()) * exitance.row(static_cast<Index>(surface_[e]));
  return source;
}

SolveSummary GalerkinSystem::solve(const BandMatrix& reflectance, const BandMatrix& source,
                                   BandMatrix& coefficients) const {
  BandMatrix rho(unknowns(), reflectance.cols());
  for (std::size_t e = 0; e < elements_.size(); ++e)
    for (Index f = first_[e]; f < first_[e + 1]; ++f)
      rho.row(f) = reflectance.row(static_cast<Index>(surface_[e]));
  SolveOptions options;
  options.relative_bound = options_.relative_bound;
  options.share_bands = false;  // what it saves is little beside the moments
  return solve_radiosity(factors_, rho, source, options, coefficients);
}

double GalerkinSystem::distance_to(const Eigen::VectorXd& coefficients,
                                   const Function& function) const {
  const int points = options_.degree + 4;
  const GaussRule& rule = gauss_rule(points);
  double phi[kMaxFunctions], sum = 0.0;
  for (std::size_t e = 0; e < elements_.size(); ++e)
    for (int l = 0; l < points; ++l)
      for (int k = 0; k < points; ++k) {
        const double u = rule.nodes[l], v = rule.nodes[k];
        elements_[e].evaluate(u, v, phi);
        double difference = -function(surface_[e], elements_[e].at(u, v));
        for (int f = 0; f < elements_[e].functions(); ++f)
          difference += phi[f] * coefficients[first_[e] + f];
        sum += rule.weights[l] * rule.weights[k] * elements_[e].jacobian_m2(u) * difference *
               difference;
      }
  return std::sqrt(sum);
}

BandMatrix GalerkinSystem::surface_means(const BandMatrix& coefficients) const {
  const auto n = static_cast<Index>(surface_count_);
  BandMatrix sum = BandMatrix::Zero(n, coefficients.cols());
  Eigen::VectorXd area = Eigen::VectorXd::Zero(n);
  for (std::size_t e = 0; e < elements_.size(); ++e) {
    const auto s = static_cast<Index>(surface_[e]);
    sum.row(s) += std::sqrt(elements_[e].area_m2()) * coefficients.row(first_[e]);
    area[s] += elements_[e].area_m2();
  }
  for (Index s = 0; s < n; ++s)
    if (area[s] > 0.0) sum.row(s) /= area[s];
  return sum;
}

Eigen::MatrixXd GalerkinSystem::gathered(std::size_t e, const std::vector<Vec3>& points,
                                         const Eigen::MatrixXd& coefficients) const {
  Eigen::MatrixXd sum =
      Eigen::MatrixXd::Zero(static_cast<Index>(points.size()), coefficients.cols());
  Eigen::VectorXd moments;
  for (std::size_t j = 0; j < elements_.size(); ++j) {
    if (!sees(elements_[e], elements_[j]) || !sees(elements_[j], elements_[e])) continue;
    std::vector<const Blocker*> between;
    if (visible_) between = visible_->between(elements_[e], elements_[j]);
    const bool is_clear =
        !visible_ || (between.empty() && faces_wholly(elements_[e], elements_[j]));
    for (std::size_t p = 0; p < points.size(); ++p) {
      moments.setZero(elements_[j].functions());
      if (is_clear)
        add_gathered_moments(points[p], elements_[e].normal(), elements_[j],
                             options_.relative_tolerance, moments.data());
      else
        visible_->add_gathered(points[p], elements_[e].normal(), elements_[j], between,
                               moments.data());
      sum.row(static_cast<Index>(p)).noalias() +=
          moments.transpose() * coefficients.middleRows(first_[j], moments.size());
    }
  }
  return sum;
}

namespace {

// Points and weights of a rule that crowds towards the edges, and every function at each point.
void crowded_points(const PolynomialElement& element, std::vector<Vec3>& points,
                    std::vector<double>& weights, Eigen::MatrixXd& phi) {
  const GaussRule& rule = gauss_rule(kResidualPoints);
  phi.resize(element.functions(), kResidualPoints * kResidualPoints);
  const auto crowd = [](double t) { return t * t * (3.0 - 2.0 * t); };
  for (int l = 0; l < kResidualPoints; ++l)
    for (int k = 0; k < kResidualPoints; ++k) {
      const double s = rule.nodes[l], t = rule.nodes[k], u = crowd(s), v = crowd(t);
      element.evaluate(u, v, phi.col(static_cast<Index>(points.size())).data());
      weights.push_back(rule.weights[l] * rule.weights[k] * 36.0 * s * (1 - s) * t * (1 - t) *
                        element.jacobian_m2(u));
      points.push_back(element.at(u, v));
    }
}

}  // namespace

BandMatrix GalerkinSystem::mean_error_bound(const BandMatrix& reflectance,
                                            const BandMatrix& exitance,
                                            const BandMatrix& coefficients) const {
  const Index n = static_cast<Index>(surface_count_), bands = coefficients.cols();
  Eigen::VectorXd area = Eigen::VectorXd::Zero(n);
  for (std::size_t e = 0; e < elements_.size(); ++e)
    area[static_cast<Index>(surface_[e])] += elements_[e].area_m2();
  BandMatrix bound = BandMatrix::Zero(n, bands);
  // Columns of each band: 0 radiosity, 1 + s the solution for the mean of surface s.
  BandMatrix solved(unknowns(), bands * (n + 1));
  BandMatrix source = BandMatrix::Zero(n, solved.cols());  // rho times the right-hand sides
  for (Index band = 0; band < bands; ++band) {
    const Index first = band * (n + 1);
    source.col(first) = exitance.col(band);
    for (Index s = 0; s < n; ++s)
      if (area[s] > 0.0) source(s, first + s + 1) = reflectance(s, band) / area[s];
    const BandMatrix rho = reflectance.col(band).replicate(1, n + 1);
    BandMatrix of_band;
    solve(rho, project_constants(source.middleCols(first, n + 1)), of_band);
    of_band.col(0) = coefficients.col(band);
    solved.middleCols(first, n + 1) = of_band;
  }
  // Of each column: <s, s> and <z, s_0>, s_0 the radiosity's residual in its band.
  std::vector<Eigen::MatrixXd> part(elements_.size(), Eigen::MatrixXd::Zero(solved.cols(), 2));
  tbb::parallel_for(std::size_t{0}, elements_.size(), [&](std::size_t e) {
    const Index surface = static_cast<Index>(surface_[e]);
    if ((reflectance.row(surface).array() == 0.0).all()) return;  // B = M there, and so is B~
    std::vector<Vec3> points;
    std::vector<double> weights;
    Eigen::MatrixXd phi;
    crowded_points(elements_[e], points, weights, phi);
    const Eigen::MatrixXd in = gathered(e, points, solved);
    const Eigen::MatrixXd own = phi.transpose() * solved.middleRows(first_[e], phi.rows());
    for (Index c = 0; c < solved.cols(); ++c) {
      const double rho = reflectance(surface, c / (n + 1));
      if (rho == 0.0) continue;
      const Index c0 = c - c % (n + 1);
      for (Index p = 0; p < in.rows(); ++p) {
        const double w = weights[static_cast<std::size_t>(p)];
        const double r = (source(surface, c) - own(p, c)) / rho + in(p, c);
        const double r0 = (source(surface, c0) - own(p, c0)) / rho + in(p, c0);
        part[e](c, 0) += w * r * r;
        part[e](c, 1) += w * r0 * own(p, c);
      }
    }
  });
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(solved.cols(), 2);
  for (const Eigen::MatrixXd& p : part) products += p;
  for (Index band = 0; band < bands; ++band) {
    const double gap = 1.0 / reflectance.col(band).maxCoeff() - 1.0;
    const Index first = band * (n + 1);
    for (Index s = 0; s < n; ++s)
      bound(s, band) = std::abs(products(first + s + 1, 1)) +
                       std::sqrt(products(first, 0) * products(first + s + 1, 0)) / gap;
  }
  return bound;
}

}  // namespace truebox
