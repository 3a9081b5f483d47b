// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/form_factors.h"

namespace truebox {

/// The same matrix as form_factors without rays: exact_form_factors with the outlines of shadows seen
/// from 3 x 3 points of one element. Deterministic, so that what differs between two meshes is
/// the meshes. No repair: rows of a closed scene were measured to sum to 1 within 2e-4 rms. The
/// summary's `closed` says that all rows sum to 1 within kClosed, not that no ray escaped.
/// Throws as require_memory.
FormFactors noise_free_form_factors(const PatchMesh& mesh, const Scene& scene,
                                    const FormFactorOptions& options);

}  // namespace truebox
