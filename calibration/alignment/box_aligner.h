// SPDX-License-Identifier: BSD-3-Clause
// The steps of align_box. Internal to this folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "alignment/box_alignment.h"
#include "alignment/edge_field.h"
#include "alignment/edge_planes.h"
#include "alignment/edge_source.h"

namespace truebox {

class BoxAligner {
 public:
  /// `guess` has the photograph's pixels.
  BoxAligner(std::unique_ptr<EdgeSource> edges, const CameraDescription& guess,
             const Image& photograph, const AlignmentOptions& options);

  BoxAlignment run();

 private:
  double unit_px() const { return planes_.reduction; }  // of the planes, in the photograph's px

  std::vector<EdgeSample> samples(const CameraParameters& p, EdgeSampling sampling) const;
  EdgeField field(int most_px) const;
  CameraParameters closest(CameraParameters p, const EdgeField& edge_field, double radius,
                           int rounds, const ParameterFreedom& freedom) const;
  CameraParameters coarse(const std::vector<EdgeSample>& from_guess) const;
  std::vector<EdgeMatch> measure(const CameraParameters& p, const EdgeField& finest, double radius);
  bool refine_to_pixels(CameraParameters& p, BoxAlignment& result);
  bool judge(BoxAlignment& result) const;
  void state_uncertainty(BoxAlignment& result) const;
  void fill_statistics(BoxAlignment& result) const;
  void tell(const std::string& stage, double share) const {
    if (options_.progress) options_.progress(stage, share);
  }

  std::unique_ptr<EdgeSource> edges_;
  CameraDescription like_;
  const AlignmentOptions& options_;
  EdgePlanes planes_;
  CameraParameters guess_;
  ParameterFreedom full_;
  double half_width_ = 5.0;  // of windows, px of the planes
  double blur_ = 0.0;        // likewise
};

/// Observations of the matches that are used, their u enlarged by what the fit showed.
Observations observations_of(const std::vector<EdgeMatch>& matches,
                             const std::vector<PointObservation>& points, double excess_px);

/// Updates residuals, marks outliers (4 standard deviations) and returns the excess u, px.
double reject_outliers(const CameraParameters& p, std::vector<EdgeMatch>& matches,
                       double degrees_taken);

/// Whether a border's name fits one of the patterns (fnmatch).
bool is_listed(const std::vector<std::string>& patterns, const std::string& border);

double rms_of(const std::vector<double>& values);  ///< NaN without values
double median_of(std::vector<double> values);      ///< likewise

}  // namespace truebox
