// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "alignment/box_alignment.h"
#include "document/report.h"
#include "figures/line_overlay.h"

namespace truebox::app {

/// Everything an alignment found, as JSON text.
std::string alignment_json(const BoxAlignment& found, const Scene& scene,
                           const std::string& photograph);

/// Predicted pieces of edge over the photograph, each with its residual, magnified.
Picture alignment_overlay(const BoxAlignment& found, const Image& photograph, int most_px = 1600);

/// Verdict, overlay, residuals by border, parameters with their uncertainties.
Report alignment_report(const BoxAlignment& found, const Scene& scene, const Image& photograph,
                        const std::string& photograph_path);

}  // namespace truebox::app
