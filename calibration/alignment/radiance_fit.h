// SPDX-License-Identifier: BSD-3-Clause
// The least-squares problem of refine_by_radiance. Internal to this folder.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "alignment/radiance_samples.h"

namespace truebox {

/// What is known of some of the parameters from elsewhere: a normal distribution.
struct KnownCamera {
  std::vector<std::size_t> indices;  ///< of the free parameters
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;

  Eigen::MatrixXd whitening() const;  ///< W with W^T W the inverse covariance
};

/// One pixel in one band at the solution: standardised residual (by the band's scale), its
/// derivatives by the free parameters and by its gain and offset.
struct RadianceRow {
  std::size_t sample = 0, band = 0, group = 0;
  double residual = 0.0;
  Eigen::VectorXd by_camera;
  std::array<double, 2> by_gain{};
};

/// Camera, gains and offsets that bring a prediction onto a photograph.
class RadianceFit {
 public:
  RadianceFit(const BandPairs& bands, int render_width, int render_height, bool gain_per_surface);
  ~RadianceFit();

  /// Takes over samples (found at `at`), and, the first time, starts gains and scales from them.
  void set_samples(std::vector<RadianceSample> samples, const CameraParameters& at);
  /// Least squares with Cauchy's loss; radiances count 1 / dispersion. False without convergence.
  bool solve(CameraParameters& parameters, const KnownCamera& known, double dispersion);
  /// Each band's robust standard deviation of residuals; to be called between solutions.
  void update_scales(const CameraParameters& parameters);
  std::vector<RadianceRow> rows(const CameraParameters& parameters,
                                const std::vector<std::size_t>& free) const;

  const std::vector<RadianceSample>& samples() const { return samples_; }
  std::size_t groups() const { return gains_.size(); }
  std::size_t band_of(std::size_t group) const { return group / surfaces_.size(); }
  int surface_of(std::size_t group) const { return surfaces_[group % surfaces_.size()]; }
  const std::array<double, 2>& gain(std::size_t group) const { return gains_[group]; }
  double scale(std::size_t band) const { return scales_[band]; }

  static constexpr double kCauchy = 3.0;  ///< in standard deviations

 private:
  struct Light;
  std::size_t group_of(std::size_t band, int surface) const;
  double value(const RadianceSample& sample, std::size_t band) const;
  void start_gains();

  const BandPairs& bands_;
  std::vector<std::unique_ptr<Light>> light_;
  bool per_surface_;
  std::vector<int> surfaces_;
  std::vector<RadianceSample> samples_;
  std::vector<std::array<double, 2>> gains_;  // of each band, surface by surface
  std::vector<double> scales_;
};

}  // namespace truebox
