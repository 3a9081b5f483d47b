// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "provenance/provenance.h"
#include "radiometry/tabulated_spectrum.h"

namespace truebox {

/// A flat target of uniform patches: where each lies in the photograph, and what a spectrometer
/// read on it. Label n (1-based) is the n-th patch, 0 is outside.
struct Chart {
  std::vector<std::string> patches;
  int width = 0, height = 0;
  std::vector<std::uint8_t> labels;            ///< width x height
  std::vector<TabulatedSpectrum> reflectance;  ///< one a patch
  Provenance provenance;                       ///< of the reflectances

  std::size_t index_of(const std::string& patch) const;  ///< patches.size() if there is none
};

/// Reads the label image and the reflectance columns named by `patches`.
/// InputError: an unsourced table, an unknown column, a patch without a pixel, a label too many.
Chart read_chart(const std::filesystem::path& labels, const std::filesystem::path& reflectance,
                 std::vector<std::string> patches);

/// The labels with `margin_px` pixels removed along every patch's edge (4-neighbour erosion):
/// a patch's rim is blurred into its surround.
std::vector<std::uint8_t> eroded_labels(const Chart& chart, int margin_px);

}  // namespace truebox
