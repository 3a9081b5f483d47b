// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "figures/axis.h"

namespace truebox {

/// One curve or one set of points. Vectors are as long as x, or empty where there is nothing to
/// show.
struct PlotSeries {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> u_y{};           ///< standard uncertainty: ribbon of a line, bars of points
  std::vector<double> half_width_x{};  ///< half band width: a horizontal bar
  bool line = true;
  bool markers = false;
  bool dashed = false;  ///< for a law to compare with, such as an expected order
};

/// Lines and points over two axes, linear or logarithmic. The first six series keep apart by
/// colour, marker and dash alike; dashed ones are drawn as text is. Values that are not finite
/// break a line and are left out as points.
struct LinePlot {
  std::string title;  ///< read to those who cannot see the plot
  Axis x;
  Axis y;
  std::vector<PlotSeries> series;
};

/// The plot as one <svg> whose text and lines follow the page's colour (currentColor).
/// Throws std::invalid_argument if vectors of a series have different lengths.
std::string to_svg(const LinePlot& plot);

}  // namespace truebox
