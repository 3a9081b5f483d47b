// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "scene/polygon.h"

namespace truebox {

/// A convex piece cut as uniform_mesh cuts it, without its contact lines: edges of about `edge_m`.
std::vector<Polygon> uniform_cells(const Polygon& piece, double edge_m);

}  // namespace truebox
