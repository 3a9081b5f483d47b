// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace truebox {

/// A flat strip without ends, seen in section (m). Lit on the left of the way from `from_m` to
/// `to_m`; its back is black.
struct Strip {
  Eigen::Vector2d from_m, to_m;
  double length_m() const { return (to_m - from_m).norm(); }
};

struct StripOptions {
  int degree = 11;  ///< of the polynomials in an element, 0 to kMaxDegree
  /// Shortest element where strips meet, of the strip's length; 1e-12 of the place's distance from
  /// the origin at least, so that a vertex is resolved best in the origin.
  double finest = 1e-16;
  double closeness = 1.0;  ///< an element is no longer than this times its distance to other strips
  std::string invalid() const;  ///< why these options cannot be used; empty if they can
};

class StripSolution;

/// Radiosity between long strips: everything is constant along them, so that
///   B(x) = M(x) + rho int K(x, y) B(y) dy,   K = cos_x cos_y / (2 r)
/// with lengths and angles in the section (the kernel behind Hottel's crossed strings). Galerkin
/// with orthonormal Legendre polynomials on elements that halve towards the places where strips
/// meet. Nothing may stand between the strips.
/// Throws std::invalid_argument for invalid options, a strip without length, or a strip that
/// crosses the line of another: their factors would have a kink.
/// Sources: Hottel (1954); Atkinson (1997), ch. 4 and 8 (Galerkin, graded meshes).
class StripEnclosure {
 public:
  StripEnclosure(std::vector<Strip> strips, const StripOptions& options);

  /// `reflectance` in [0, 1) and `exitance` (W m^-2 nm^-1), one number a strip.
  /// Throws std::invalid_argument otherwise.
  StripSolution solve(const std::vector<double>& reflectance,
                      const std::vector<double>& exitance) const;

  Eigen::Index unknowns() const { return kernel_.rows(); }

 private:
  friend class StripSolution;
  // Positions are measured from the nearer end of the strip: tiny elements keep their digits.
  struct Element {
    std::size_t strip;
    bool from_start;
    double near_m, far_m;
    Eigen::Vector2d end, inward, normal;
    double length_m() const { return far_m - near_m; }
    Eigen::Vector2d at(double t) const { return end + (near_m + t * length_m()) * inward; }
  };
  void cut(Element part, double floor_m);
  double distance_to_others(const Element& element) const;
  Eigen::MatrixXd gather_matrix(const std::vector<double>& nodes) const;

  std::vector<Strip> strips_;
  StripOptions options_;
  std::vector<Element> elements_;
  Eigen::MatrixXd kernel_;    // int int phi_k K phi_l
  Eigen::MatrixXd gathered_;  // int K phi_l at the points of the residual
};

/// Radiosity on the strips and a bound of its error at every point. The enclosure must outlive it.
/// With the residual r = M + rho K B~ - B~ and W = (I - rho K)^-1 1, which is solved for beside B:
///   |B(x) - B~(x)| <= sup |r| W(x),   W(x) <= W~(x) / (1 - sup |r_W|)
/// because the kernel is nowhere negative. The residual comes from K integrated point by point, so
/// that it holds the errors of discretisation, of the Galerkin integrals and of the solve at once.
/// Its supremum: 16 Chebyshev points an element bound a polynomial of degree 8 by sqrt(2) times
/// their largest value (Ehlich & Zeller 1964); what lies above degree 8 adds twice the sum of its
/// Chebyshev coefficients.
class StripSolution {
 public:
  /// Radiosity at `fraction` of a strip's length (0: from, 1: to) and its bound, W m^-2 nm^-1.
  double radiosity(std::size_t strip, double fraction) const;
  double error_bound(std::size_t strip, double fraction) const;
  double mean_radiosity(std::size_t strip) const;
  double mean_error_bound(std::size_t strip) const;

 private:
  friend class StripEnclosure;
  double value(const Eigen::VectorXd& coefficients, std::size_t strip, double fraction) const;
  double mean(const Eigen::VectorXd& coefficients, std::size_t strip) const;

  const StripEnclosure* enclosure_ = nullptr;
  Eigen::VectorXd radiosity_, comparison_;
  double scale_ = 0.0;  // sup |r| / (1 - sup |r_W|)
};

}  // namespace truebox
