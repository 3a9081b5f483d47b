// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <vector>

#include "adaptive/goal.h"
#include "mesh/cell_tree.h"
#include "scene/requirements.h"
#include "transport/form_factors.h"

namespace truebox {

/// What a cell adds to the goal's error, and what would be left of it if the cell were halved.
struct CellError {
  double square = 0.0;         ///< its share of the mean square of the relative error
  double halved_square = 0.0;  ///< after halving in the better direction
  int direction = 0;           ///< that direction
};

/// Two errors, their squares added, from one solution on the mesh whose cells are cut in four.
///
/// What the cell does to others (dual-weighted residual): a constant element sends the mean of the
/// radiosity R(y) it reflects, which changes the goal by
///   eta = int (R - mean R) (Z - mean Z) dA,
/// Z(y) the irradiance of the dual solution psi = q + rho F psi: what radiosity at y counts for. R
/// holds exact direct light, so that shadows show. Goals of random signs take the mean square of
/// eta over signs and bands.
///
/// What is wrong between elements: the smooth field of the cells' means, against the irradiance
/// of their quarters.
///
/// `random` goes on from one step to the next. Sources: Smits, Arvo & Salesin (1992), importance;
/// Lischinski, Smits & Greenberg (1994); Becker & Rannacher (2001), ch. 3.
std::vector<CellError> cell_errors(const CellTree& cells, const Scene& scene,
                                   const Requirements& needs, const Goal& goal,
                                   const FormFactorOptions& options, std::mt19937_64& random);

}  // namespace truebox
