// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace truebox {

/// Spectral bands: centre and width of each, in nm, centres strictly increasing.
/// A band spans [centre - width/2, centre + width/2]; bands may leave gaps (filters) or touch.
class WavelengthGrid {
 public:
  WavelengthGrid() = default;

  /// Bands at the given centres; a band reaches half way to its neighbours.
  /// Throws std::invalid_argument unless centres are positive, finite and strictly increasing.
  static WavelengthGrid from_centres(std::vector<double> centres_nm);

  /// from, from + step, ..., to (inclusive), each `step` wide. Throws as above.
  static WavelengthGrid uniform(double from_nm, double to_nm, double step_nm);

  std::size_t size() const { return centres_nm_.size(); }
  double centre_nm(std::size_t band) const { return centres_nm_[band]; }
  double width_nm(std::size_t band) const { return widths_nm_[band]; }
  const std::vector<double>& centres_nm() const { return centres_nm_; }
  const std::vector<double>& widths_nm() const { return widths_nm_; }

  friend bool operator==(const WavelengthGrid&, const WavelengthGrid&) = default;

 private:
  std::vector<double> centres_nm_;
  std::vector<double> widths_nm_;
};

}  // namespace truebox
