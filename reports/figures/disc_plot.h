// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

namespace truebox {

/// A region of the unit disc by its outline.
struct DiscRegion {
  std::vector<std::array<double, 2>> outline;
  bool filled = true;  ///< else dashed, for what would be there if nothing hid it
};

/// Nusselt's analog as a picture: the unit disc below the hemisphere, and what is projected to it.
/// The filled area over the disc's is the view factor.
struct DiscPlot {
  std::string title;
  std::string caption;  ///< one line below the disc
  std::vector<DiscRegion> regions;
};

/// The plot as one <svg> whose text and lines follow the page's colour (currentColor).
std::string to_svg(const DiscPlot& plot);

}  // namespace truebox
