// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "image/image.h"
#include "radiometry/progress.h"
#include "verification/accuracy_check.h"

namespace truebox {

struct RenderCheckOptions {
  std::size_t elements = 6000;  ///< of the radiosity solution
  int samples = 256;            ///< of the path tracer, a pixel
  Progress progress;
};

/// Three pictures of the published Cornell Box by three routes (radiosity with exact direct light,
/// this project's path tracer, the independent path tracer), compared in pairs: family-wise p-value
/// of all 16 x 16 px blocks in all lit bands, bias of whole bands and spread of the scores of all
/// pixels. `p_values`, if not null, gets one channel a pair and band: "<pair>.<nm>nm".
std::vector<AccuracyCheck> check_renders(const std::filesystem::path& reference_dir,
                                         const RenderCheckOptions& options, Image* p_values);

}  // namespace truebox
