// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace truebox {

/// Why a photosite's value is no measurement, one bit a reason. Nothing is filled in from
/// neighbours: the value stays what it was, its uncertainty is infinite.
enum PhotositeFlag : std::uint8_t {
  kHotPhotosite = 1,          ///< its dark reading stands out
  kDeadPhotosite = 2,         ///< answers a flat field with under half or over twice the others
  kStuckPhotosite = 4,        ///< reads the same whatever the exposure
  kSaturatedPhotosite = 8,    ///< saturated in every exposure
  kBelowFloorPhotosite = 16,  ///< below the floor in every exposure; the value is kept as a bound
  kMaskedPhotosite = 32,      ///< excluded by the user's mask
  kNotFinitePhotosite = 64,   ///< a reading is NaN or infinite
};

}  // namespace truebox
