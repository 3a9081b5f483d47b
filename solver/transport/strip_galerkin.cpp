// SPDX-License-Identifier: BSD-3-Clause
#include "transport/strip_galerkin.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "transport/legendre.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

using Eigen::Index;
using Eigen::Vector2d;

constexpr double kGatherTolerance = 1e-14;  // of int K phi at a point, relative
constexpr int kNodes = kMaxGaussPoints;     // of an element, Gauss and Chebyshev

Vector2d left_of(const Vector2d& v) { return {-v.y(), v.x()}; }

// Measured from the nearer end: near a vertex all differences keep their digits.
double distance_to_segment(const Vector2d& p, Vector2d a, Vector2d b) {
  if ((p - b).squaredNorm() < (p - a).squaredNorm()) std::swap(a, b);
  const Vector2d along = b - a;
  const double t = std::clamp(along.dot(p - a) / along.squaredNorm(), 0.0, 1.0);
  return (p - a - t * along).norm();
}

std::vector<double> gauss_nodes() {
  const GaussRule& rule = gauss_rule(kNodes);
  return {rule.nodes.begin(), rule.nodes.begin() + kNodes};
}

// Zeros of T_16, on [0, 1].
std::vector<double> chebyshev_nodes() {
  std::vector<double> nodes;
  for (int m = 0; m < kNodes; ++m)
    nodes.push_back(0.5 - 0.5 * std::cos(std::numbers::pi * (m + 0.5) / kNodes));
  return nodes;
}

// Supremum over one element from its values at the Chebyshev points; see StripSolution.
double supremum(const double* values) {
  double largest = 0.0, tail = 0.0;
  for (int m = 0; m < kNodes; ++m) largest = std::max(largest, std::abs(values[m]));
  for (int k = kNodes / 2 + 1; k < kNodes; ++k) {
    double c = 0.0;
    for (int m = 0; m < kNodes; ++m)
      c += values[m] * std::cos(k * std::numbers::pi * (m + 0.5) / kNodes);
    tail += std::abs(2.0 * c / kNodes);
  }
  return std::numbers::sqrt2 * largest + 2.0 * tail;
}

}  // namespace

std::string StripOptions::invalid() const {
  if (degree < 0 || degree > kMaxDegree) return "degree must lie in [0, 15]";
  if (!(finest > 0.0 && finest < 1.0)) return "finest must lie in (0, 1)";
  if (!(closeness > 0.0)) return "closeness must be positive";
  return {};
}

StripEnclosure::StripEnclosure(std::vector<Strip> strips, const StripOptions& options)
    : strips_(std::move(strips)), options_(options) {
  if (const std::string why = options.invalid(); !why.empty()) throw std::invalid_argument(why);
  for (const Strip& s : strips_)
    if (!(s.length_m() > 0.0)) throw std::invalid_argument("a strip has no length");
  for (const Strip& a : strips_)
    for (const Strip& b : strips_) {
      const Vector2d normal = left_of(b.to_m - b.from_m).normalized();
      const double tolerance = 1e-12 * (a.length_m() + b.length_m());
      const double d0 = normal.dot(a.from_m - b.from_m), d1 = normal.dot(a.to_m - b.from_m);
      if (std::min(d0, d1) < -tolerance && std::max(d0, d1) > tolerance)
        throw std::invalid_argument("a strip crosses the line of another");
    }
  for (std::size_t s = 0; s < strips_.size(); ++s) {
    const Vector2d along = (strips_[s].to_m - strips_[s].from_m).normalized();
    const double half = 0.5 * strips_[s].length_m();
    // Below this an element's place is lost in the rounding of the end it is measured from.
    const auto floor = [&](const Vector2d& end) {
      return std::max(options.finest * strips_[s].length_m(), 1e-12 * end.norm());
    };
    cut({s, true, 0.0, half, strips_[s].from_m, along, left_of(along)}, floor(strips_[s].from_m));
    cut({s, false, 0.0, half, strips_[s].to_m, -along, left_of(along)}, floor(strips_[s].to_m));
  }
  const Index per = options.degree + 1, n = static_cast<Index>(elements_.size());
  const Eigen::MatrixXd at_nodes = gather_matrix(gauss_nodes());
  kernel_.resize(n * per, n * per);
  Eigen::MatrixXd weighted(per, kNodes);  // phi_k w, of an element of unit length
  for (int m = 0; m < kNodes; ++m) {
    legendre(gauss_rule(kNodes).nodes[m], options.degree, weighted.col(m).data());
    weighted.col(m) *= gauss_rule(kNodes).weights[m];
  }
  for (Index e = 0; e < n; ++e)
    kernel_.middleRows(e * per, per).noalias() =
        std::sqrt(elements_[e].length_m()) * weighted * at_nodes.middleRows(e * kNodes, kNodes);
  gathered_ = gather_matrix(chebyshev_nodes());
}

double StripEnclosure::distance_to_others(const Element& element) const {
  const Vector2d a = element.at(0.0), b = element.at(1.0);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < strips_.size(); ++s) {
    if (s == element.strip) continue;
    const Strip& other = strips_[s];
    nearest =
        std::min({nearest, distance_to_segment(a, other.from_m, other.to_m),
                  distance_to_segment(b, other.from_m, other.to_m),
                  distance_to_segment(other.from_m, a, b), distance_to_segment(other.to_m, a, b)});
  }
  return nearest;
}

void StripEnclosure::cut(Element part, double floor_m) {
  if (part.length_m() <= std::max(floor_m, options_.closeness * distance_to_others(part))) {
    elements_.push_back(part);
    return;
  }
  Element near = part, far = part;
  near.far_m = far.near_m = 0.5 * (part.near_m + part.far_m);
  cut(near, floor_m);
  cut(far, floor_m);
}

// int K(x, y) phi_l(y) dy at the nodes of every element: elements * nodes x unknowns.
Eigen::MatrixXd StripEnclosure::gather_matrix(const std::vector<double>& nodes) const {
  const Index per = options_.degree + 1, n = static_cast<Index>(elements_.size());
  const Index count = static_cast<Index>(nodes.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n * count, n * per);
  tbb::parallel_for(Index{0}, n, [&](Index source) {
    const Element& s = elements_[source];
    Eigen::VectorXd sum(per);
    std::array<double, kMaxDegree + 1> phi;
    const auto add = [&](const auto& self, const Vector2d& x, const Vector2d& normal, double t0,
                         double t1, int depth) -> void {
      const double radius = 0.5 * (t1 - t0) * s.length_m();
      const double near = distance_to_segment(x, s.at(t0), s.at(t1)) / radius;
      // Gauss points for a singularity this near the interval: Bernstein's ellipse, one point more
      // for its order.
      const double needed =
          1.0 - 0.5 * std::log(kGatherTolerance) / std::log(near + std::sqrt(near * near + 1.0)) +
          0.5 * options_.degree;
      if (needed > kMaxGaussPoints && depth < 60) {
        self(self, x, normal, t0, 0.5 * (t0 + t1), depth + 1);
        self(self, x, normal, 0.5 * (t0 + t1), t1, depth + 1);
        return;
      }
      const int points = std::min(kMaxGaussPoints, static_cast<int>(std::ceil(needed)));
      const GaussRule& rule = gauss_rule(points);
      for (int q = 0; q < points; ++q) {
        const double t = t0 + rule.nodes[q] * (t1 - t0);
        const Vector2d r = s.at(t) - x;
        const double cosines = std::max(0.0, normal.dot(r)) * std::max(0.0, -s.normal.dot(r));
        const double square = r.squaredNorm();
        const double weight =
            rule.weights[q] * 2.0 * radius * cosines / (2.0 * square * std::sqrt(square));
        legendre(t, options_.degree, phi.data());
        for (Index k = 0; k < per; ++k) sum[k] += weight * phi[k];
      }
    };
    for (Index e = 0; e < n; ++e) {
      if (elements_[e].strip == s.strip) continue;
      for (Index m = 0; m < count; ++m) {
        sum.setZero();
        add(add, elements_[e].at(nodes[m]), elements_[e].normal, 0.0, 1.0, 0);
        matrix.block(e * count + m, source * per, 1, per) =
            sum.transpose() / std::sqrt(s.length_m());
      }
    }
  });
  return matrix;
}

StripSolution StripEnclosure::solve(const std::vector<double>& reflectance,
                                    const std::vector<double>& exitance) const {
  if (reflectance.size() != strips_.size() || exitance.size() != strips_.size())
    throw std::invalid_argument("one reflectance and one exitance a strip");
  for (double rho : reflectance)
    if (!(rho >= 0.0 && rho < 1.0)) throw std::invalid_argument("reflectance must lie in [0, 1)");
  for (double m : exitance)
    if (!std::isfinite(m)) throw std::invalid_argument("exitance must be finite");
  const Index per = options_.degree + 1, n = static_cast<Index>(elements_.size());
  Eigen::MatrixXd system = -kernel_;
  Eigen::MatrixXd source = Eigen::MatrixXd::Zero(n * per, 2);
  for (Index e = 0; e < n; ++e) {
    const std::size_t strip = elements_[e].strip;
    system.middleRows(e * per, per) *= reflectance[strip];
    const double unit = std::sqrt(elements_[e].length_m());
    source.row(e * per) << exitance[strip] * unit, unit;
  }
  system.diagonal().array() += 1.0;
  const Eigen::MatrixXd solved = system.partialPivLu().solve(source);

  double worst[2] = {0.0, 0.0};
  const Eigen::MatrixXd received = gathered_ * solved;
  const std::vector<double> nodes = chebyshev_nodes();
  std::array<double, kMaxDegree + 1> phi;
  std::array<double, kNodes> residual;
  for (Index e = 0; e < n; ++e)
    for (int column = 0; column < 2; ++column) {
      const std::size_t strip = elements_[e].strip;
      double rounding = 0.0;
      for (int m = 0; m < kNodes; ++m) {
        legendre(nodes[m], options_.degree, phi.data());
        double own = 0.0;
        for (Index k = 0; k < per; ++k) own += phi[k] * solved(e * per + k, column);
        own /= std::sqrt(elements_[e].length_m());
        const double in = reflectance[strip] * received(e * kNodes + m, column);
        residual[m] = (column ? 1.0 : exitance[strip]) + in - own;
        // Tolerance of the gathering, and sums of some ten roundings.
        rounding = std::max(rounding, 10.0 * kGatherTolerance * (std::abs(in) + std::abs(own)));
      }
      worst[column] = std::max(worst[column], supremum(residual.data()) + rounding);
    }
  StripSolution solution;
  solution.enclosure_ = this;
  solution.radiosity_ = solved.col(0);
  solution.comparison_ = solved.col(1);
  solution.scale_ =
      worst[1] < 1.0 ? worst[0] / (1.0 - worst[1]) : std::numeric_limits<double>::infinity();
  return solution;
}

double StripSolution::value(const Eigen::VectorXd& coefficients, std::size_t strip,
                            double fraction) const {
  const bool from_start = fraction <= 0.5;
  const double length = enclosure_->strips_[strip].length_m();
  const double position = length * (from_start ? fraction : 1.0 - fraction);
  const Index per = enclosure_->options_.degree + 1;
  std::array<double, kMaxDegree + 1> phi;
  double nearest = std::numeric_limits<double>::infinity(), result = 0.0;
  for (std::size_t e = 0; e < enclosure_->elements_.size(); ++e) {
    const auto& element = enclosure_->elements_[e];
    if (element.strip != strip || element.from_start != from_start) continue;
    const double outside = std::max({element.near_m - position, position - element.far_m, 0.0});
    if (outside >= nearest) continue;
    nearest = outside;
    legendre(std::clamp((position - element.near_m) / element.length_m(), 0.0, 1.0),
             static_cast<int>(per) - 1, phi.data());
    result = 0.0;
    for (Index k = 0; k < per; ++k)
      result += phi[k] * coefficients[static_cast<Index>(e) * per + k];
    result /= std::sqrt(element.length_m());
  }
  return result;
}

double StripSolution::mean(const Eigen::VectorXd& coefficients, std::size_t strip) const {
  const Index per = enclosure_->options_.degree + 1;
  double sum = 0.0;
  for (std::size_t e = 0; e < enclosure_->elements_.size(); ++e)
    if (enclosure_->elements_[e].strip == strip)
      sum += coefficients[static_cast<Index>(e) * per] *
             std::sqrt(enclosure_->elements_[e].length_m());
  return sum / enclosure_->strips_[strip].length_m();
}

double StripSolution::radiosity(std::size_t strip, double fraction) const {
  return value(radiosity_, strip, fraction);
}
double StripSolution::error_bound(std::size_t strip, double fraction) const {
  return scale_ * value(comparison_, strip, fraction);
}
double StripSolution::mean_radiosity(std::size_t strip) const { return mean(radiosity_, strip); }
double StripSolution::mean_error_bound(std::size_t strip) const {
  return scale_ * mean(comparison_, strip);
}

}  // namespace truebox
