// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "photometry/dark_distribution.h"
#include "photometry/defects.h"
#include "photometry/exposure_merge.h"
#include "photometry/flat_field.h"
#include "photometry/photon_transfer.h"
#include "photometry/response_curve.h"
#include "readings/measurement_file.h"
#include "uncertainty/uncertainty_budget.h"

namespace truebox {

/// Noise measured in frames that the model has not seen, over what it predicts.
struct HeldOutNoise {
  std::string group;  ///< the band, or the pair of exposures, that was left out of the fit
  NoiseCheck check;
};

/// Noise of the photosites of one colour.
struct SiteNoise {
  char site = 'Y';
  PhotonTransfer transfer;  ///< fitted to all frames
  NoiseModel model;         ///< used: fitted, or what the file states
  bool given = false;       ///< the file states it
  std::vector<HeldOutNoise> held_out;
  NoiseCheck pooled;  ///< over all groups left out in turn
};

/// What is known of the camera, estimated once for all bands.
struct InstrumentCalibration {
  std::vector<MasterDark> darks;
  std::vector<DarkDistribution> dark_distributions;  ///< one a dark, sigma from photon transfer
  std::vector<SiteNoise> noise;
  ResponseEstimate linearity;  ///< offset and curvature that the exposure series show
  CameraResponse response;     ///< the one used
  ResponseCurve curve;         ///< where recovered from tone-mapped files
  FlatField flat;
  DefectMap defects;
  /// Areas known to be uniform (a chart's patches), where noise and linearity are judged: beside
  /// edges, files that were scaled down mix clipped sensor pixels into readings. Empty: anywhere.
  std::vector<std::uint8_t> labels;
};

/// One linear photograph, photosite by photosite (row by row), in `unit`.
/// u_noise: standard uncertainty independent from photosite to photosite (photons, read-out,
/// rounding, noise of dark and flat frames); u_common: what neighbours share (black level,
/// response, exposure times, flat field's source, glare, scale). Both k = 1. Infinite u_noise:
/// no measurement; `flags` (PhotositeFlag) says why.
struct LinearPhotograph {
  std::string band;
  std::string unit = "DN s^-1";
  int width = 0, height = 0;
  std::vector<float> value, u_noise, u_common;
  std::vector<std::uint8_t> exposures_used, flags;

  std::vector<double> exposures_s, mean_ratio;  ///< as MergeResult
  double chi2_per_dof = 0.0;
  std::size_t dof = 0;
  std::size_t saturated = 0, below_floor = 0;

  double reference_value = 0.0;  ///< median of the photosites that count: the budget's example
  UncertaintyBudget noise_budget, common_budget;  ///< at that value, in `unit`
  Estimate glare;  ///< subtracted, in `unit`; of the photosites of the band's colour
};

struct PhotometricCalibration {
  MeasurementFile file;
  std::vector<InstrumentCalibration> instruments;  ///< one a channel of the files
  std::vector<LinearPhotograph> photographs;       ///< one a band, or a band and channel
};

using CalibrationProgress = std::function<void(const std::string& stage, double fraction)>;

/// From a camera's files to linear photographs: dark, defects, response, noise by photon transfer,
/// flat field, merge, glare, absolute scale, budget (JCGM 100:2008). Files of several channels give
/// one photograph a channel, named "<band>.R".
/// InputError, MismatchError: files that cannot serve, among them those whose noise is neither
/// stated nor to be seen in them.
PhotometricCalibration calibrate_photographs(const MeasurementFile& file,
                                             const CalibrationProgress& progress = {});

/// Channels value, variance (of the noise), u_noise, u_common, exposures, flags; units beside.
Image to_image(const LinearPhotograph& photograph, const MeasurementFile& file);

/// The budget of one photograph as a table of text lines.
std::string budget_text(const LinearPhotograph& photograph);

}  // namespace truebox
