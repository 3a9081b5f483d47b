// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "radiometry/progress.h"
#include "transport/element_tree.h"
#include "transport/gather.h"
#include "transport/visibility.h"

namespace truebox {

/// Mean irradiance of every element straight from the luminaires, elements x bands, W m^-2 nm^-1.
/// Shafts between groups of elements and a luminaire leave each element the few blockers that may
/// hide a part: nothing between, closed form; hidden, 0; else exact visibility from Gauss points.
/// Rows in parallel, the same values on any number of threads.
BandMatrix mean_direct(const PatchMesh& mesh, const Scene& scene, const Gather& gather,
                       const ElementTree& tree, const ShaftCulling& culling,
                       const Progress& progress = {});

/// The same over the part of an element of a closed scene that no surface covers: mean over those
/// of 256 evenly spread points. 0 where none of them is free.
Eigen::RowVectorXd mean_direct_of_free_part(const PatchMesh& mesh, const Scene& scene,
                                            const Gather& gather, const Visibility& visibility,
                                            std::uint32_t patch);

/// Which lamps each element may see, and what may stand between: found once, asked at many points.
class LitElements {
 public:
  struct Lamp {
    std::uint32_t piece = 0;
    Eigen::VectorXd exitance;            ///< W m^-2 nm^-1, one value a band
    std::vector<std::uint32_t> between;  ///< pieces
  };
  LitElements(const PatchMesh& mesh, const Scene& scene, const ElementTree& tree,
              const ShaftCulling& culling);

  const std::vector<Lamp>& lamps_of(std::uint32_t patch) const { return lamps_[patch]; }
  /// Whether something may stand between an element and one of its lamps.
  bool is_partly_hidden(std::uint32_t patch) const { return partly_hidden_[patch]; }

 private:
  std::vector<std::vector<Lamp>> lamps_;
  std::vector<char> partly_hidden_;
};

}  // namespace truebox
