// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/scene.h"

namespace truebox {

/// What two surfaces see of each other.
enum class Sight : unsigned char {
  none,     ///< nothing: they turn their backs, or one blocker hides all. Certain
  partial,  ///< something may stand between; blockers that hide all only together are here, too
  full,     ///< nothing stands between any two points that face each other. Certain
};

/// Which surfaces of a scene can see which, by the shafts between their pieces, each piece cut at
/// the other's horizon first. No sampling: `none` and `full` hold, `partial` is the safe answer.
/// Cost: pairs of pieces times pieces. Sources: see shaft_occlusion.
class MutualVisibility {
 public:
  /// Scenes of more than `most_pieces` planar pieces are judged by `sample` random pairs of pieces
  /// instead: then only the shares below mean something.
  explicit MutualVisibility(const Scene& scene, std::size_t most_pieces = 600,
                            std::size_t sample = 20000);

  bool is_complete() const { return sights_.size() == surfaces_ * surfaces_; }
  /// Symmetric; a surface of several pieces may see itself. Needs is_complete().
  Sight between(std::size_t i, std::size_t j) const { return sights_[i * surfaces_ + j]; }

  /// Pairs of different planar pieces, weighted alike: of all, or of the sample.
  struct Shares {
    std::size_t pairs = 0;
    std::size_t facing_away = 0;  ///< they turn their backs
    std::size_t hidden = 0, partial = 0, full = 0;
    double share(std::size_t part) const {
      return pairs == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(pairs);
    }
  };
  const Shares& shares() const { return shares_; }

 private:
  std::size_t surfaces_ = 0;
  std::vector<Sight> sights_;
  Shares shares_;
};

}  // namespace truebox
