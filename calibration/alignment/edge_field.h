// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "image/image.h"

namespace truebox {

/// The edges of a picture and, for every pixel, the nearest of them in each of eight directions.
/// Positions are in px of the file: those of the field times `scale`.
///
/// Edges are the ridges of the Gaussian gradient's magnitude (sigma 1 px, the plane with the
/// largest), placed between pixels by a parabola (Canny 1986, IEEE PAMI 8(6); Devernay 1995, INRIA
/// RR-2724), above three times the median magnitude and 2 % of the strongest. The nearest is
/// propagated in two passes (Danielsson 1980, Comput. Graph. Image Process. 14).
class EdgeField {
 public:
  EdgeField(int width, int height, const std::vector<std::vector<float>>& planes, double scale);

  struct Found {
    double distance_px = 0.0;
    double offset_px = 0.0;  ///< along the normal
  };
  /// The nearest edge whose direction agrees with the line's to 11 to 34 degrees.
  std::optional<Found> nearest(PixelPosition position, const std::array<double, 2>& normal) const;

  /// A point of an edge: px of the file, and the gradient's direction in [0, pi).
  struct Ridge {
    PixelPosition position;
    double angle_rad = 0.0;
  };
  std::vector<Ridge> ridges() const;
  std::size_t edge_count() const { return points_.size(); }
  double scale() const { return scale_; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  struct Point {
    float x, y, angle;  // px of the field; direction of the gradient, [0, pi)
  };
  void find_edges(const std::vector<std::vector<float>>& planes);
  void spread(std::vector<int>& nearest) const;

  static constexpr int kDirections = 8;
  int width_, height_;
  double scale_;
  std::vector<Point> points_;
  std::array<std::vector<int>, kDirections> nearest_;  // index into points_, -1: none
};

}  // namespace truebox
