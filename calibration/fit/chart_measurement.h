// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "fit/chart_fit.h"
#include "fit/chart_reference.h"
#include "photometry/camera_response.h"
#include "photometry/exposure_merge.h"
#include "photometry/noise_model.h"
#include "readings/chart.h"
#include "readings/measurement_file.h"
#include "uncertainty/en_score.h"
#include "uncertainty/missing_contribution.h"
#include "uncertainty/uncertainty_budget.h"

namespace truebox {

/// What the camera does, estimated once for all bands.
struct InstrumentEstimate {
  NoiseModel noise;
  ResponseEstimate response;
  double curvature_scatter_per_dn = 0.0;  ///< standard deviation between the bands
  std::vector<MasterDark> darks;
};

/// One patch in one band: the photograph's reflectance against the spectrometer's.
struct PatchReading {
  std::string patch;
  bool standard = false;  ///< used as known: input of the fit, never its validation
  bool at_bound = false;  ///< the fit stopped at reflectance 0: no uncertainty is claimed
  Estimate measured;      ///< from the photograph, 1
  Estimate reference;     ///< spectrometer, weighted with the band, 1
  EnScore en;
  UncertaintyBudget measured_budget, reference_budget;
};

/// How well the standards fit when only photosites of this colour are used (first field order).
struct SiteEvidence {
  char site = 'G';
  double white_dn = 0.0;       ///< signal of the brightest standard in the longest exposure, DN
  double standards_rms = 0.0;  ///< of fitted minus known reflectance of the standards
  double held_out_rms = 0.0;   ///< of fitted minus reference of the other patches
  bool used = false;
};

/// Planes for a report, one value a 2 x 2 Bayer cell, width x height, top left first.
struct ChartPlanes {
  int width = 0, height = 0;
  std::vector<float> photograph;           ///< signal / gain: reflectance x relative illumination
  std::vector<float> photograph_variance;  ///< of noise and quantisation; infinite if saturated
  std::vector<float> prediction;  ///< (spectrometer + veil) x fitted illumination; 0 outside
  std::vector<float> prediction_variance;  ///< spectrometer, band centre, standards, illumination
  std::vector<std::uint8_t> patch;         ///< n-th patch, 0 = outside every patch's inner area
};

struct BandMeasurement {
  std::string name;  ///< "450 nm"
  std::string note;  ///< why this colour of photosite, where the file says so
  char site = 'G';
  BandPass band;
  MergeResult merge;
  std::vector<ChartFit> fits;  ///< one a field order
  Estimate veil;               ///< mean over the orders
  bool veil_kept = false;      ///< it exceeded the file's threshold in every order
  std::vector<SiteEvidence> sites;
  std::vector<PatchReading> readings;  ///< one a patch; empty, as the planes, unless converged
  ChartPlanes planes;

  Outcome outcome = Outcome::not_run;  ///< the worst of the fits
  // Held-out patches only, the standards left out:
  double rms = 0.0;                  ///< of measured minus reference
  double rms_measured_centre = 0.0;  ///< had the transmission been taken as measured, unshifted
  double largest_en = 0.0;           ///< of |E_n|
  std::size_t agreeing = 0, held_out = 0;
  double chi2_per_dof = 0.0;  ///< largest of the fits
};

struct ChartMeasurement {
  MeasurementFile file;
  Chart chart;
  InstrumentEstimate instrument;
  std::vector<BandMeasurement> bands;

  Outcome outcome() const;       ///< the worst of the bands
  std::size_t agreeing() const;  ///< held-out patches with |E_n| <= 1, all bands
  std::size_t held_out() const;
  /// What the budget lacks for the held-out patches of all bands.
  MissingContribution missing() const;
};

using Progress = std::function<void(const std::string& stage, double fraction)>;

/// Dark, noise, response, merge, fit and score of every band. Seconds.
/// InputError or MismatchError where the files do not serve; a fit that fails is an outcome.
ChartMeasurement measure_chart(const MeasurementFile& file, const Progress& progress = {});

/// The first part alone: linear photographs with variances.
struct LinearPhotographs {
  InstrumentEstimate instrument;
  std::vector<MergeResult> bands;  ///< in the file's order
};
LinearPhotographs merge_photographs(const MeasurementFile& file, const Chart& chart,
                                    const Progress& progress = {});

}  // namespace truebox
