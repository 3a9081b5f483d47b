// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "align_light.h"
#include "align_render.h"
#include "alignment/box_alignment.h"
#include "document/report.h"
#include "figures/line_overlay.h"

namespace truebox::app {

/// Everything an alignment found, as JSON text; `light` where it was refined by light.
std::string alignment_json(const BoxAlignment& found, const AlignmentSubject& subject,
                           const std::string& photograph, const PhotometricRefinement* light);

/// Predicted pieces of edge over the photograph, each with its residual, magnified.
Picture alignment_overlay(const BoxAlignment& found, const Image& photograph, int most_px = 1600);

/// Verdict, overlay, residuals by border, parameters with their uncertainties.
Report alignment_report(const BoxAlignment& found, const AlignmentSubject& subject,
                        const Image& photograph, const std::string& photograph_path,
                        const PhotometricRefinement* light);

}  // namespace truebox::app
