// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/photometric_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "alignment/block_scatter.h"
#include "alignment/box_aligner.h"
#include "alignment/projection.h"
#include "alignment/radiance_fit.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

constexpr std::size_t kFewestSamples = 400;
constexpr double kLevel = 1e-3;  // of the test whether light and edges agree

std::vector<std::size_t> free_indices(const BoxAlignment& edges) {
  std::vector<std::size_t> indices;
  const auto& names = parameter_names();
  for (const EstimatedParameter& p : edges.estimated)
    indices.push_back(
        static_cast<std::size_t>(std::find(names.begin(), names.end(), p.name) - names.begin()));
  return indices;
}

Eigen::VectorXd picked(const CameraParameters& p, const std::vector<std::size_t>& indices) {
  const auto values = values_of(p);
  Eigen::VectorXd v(static_cast<Eigen::Index>(indices.size()));
  for (std::size_t k = 0; k < indices.size(); ++k)
    v[static_cast<Eigen::Index>(k)] = values[indices[k]];
  return v;
}

/// Points of the edges that were fitted: where the picture's positions are judged.
std::vector<Vec3> judged_points(const BoxAlignment& edges) {
  std::vector<Vec3> points;
  for (const EdgeMatch& m : edges.matches)
    if (m.use == EdgeUse::used) points.push_back(m.seen.point_m);
  return points;
}

double rms_distance_px(const CameraParameters& a, const CameraParameters& b,
                       const std::vector<Vec3>& points) {
  std::vector<double> distances;
  for (const Vec3& point : points) {
    const auto p = projected(a, point), q = projected(b, point);
    if (p && q) distances.push_back(std::hypot(p->x_px - q->x_px, p->y_px - q->y_px));
  }
  return rms_of(distances);
}

/// Uncertainty of the points' positions in the picture, rms of both coordinates together.
double rms_u_px(const CameraParameters& p, const std::vector<std::size_t>& indices,
                const Eigen::MatrixXd& covariance, const std::vector<Vec3>& points) {
  const Eigen::VectorXd u = covariance.diagonal().cwiseSqrt();
  Eigen::MatrixXd by(2 * static_cast<Eigen::Index>(points.size()), u.size());
  by.setZero();
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    CameraParameters moved = p;
    const double step = 0.1 * u[column];
    for (const Block& block : blocks_of(moved))
      if (const int at = static_cast<int>(indices[k]) - block.first; at >= 0 && at < block.size)
        block.values[at] += step;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto from = projected(p, points[i]), to = projected(moved, points[i]);
      if (!from || !to) continue;
      const auto row = 2 * static_cast<Eigen::Index>(i);
      by(row, column) = (to->x_px - from->x_px) / step;
      by(row + 1, column) = (to->y_px - from->y_px) / step;
    }
  }
  return std::sqrt((by * covariance * by.transpose()).trace() / static_cast<double>(points.size()));
}

struct Agreed {
  double chi2 = 0.0, p_value = 1.0;
};

/// Whether the move d from the edges' estimate is one that both uncertainties allow.
Agreed agreement(const Eigen::VectorXd& move, const Eigen::MatrixXd& variance) {
  const Eigen::VectorXd u = variance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      u.cwiseInverse().asDiagonal() * variance * u.cwiseInverse().asDiagonal());
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * move.cwiseQuotient(u);
  Agreed result;
  double degrees = 0.0;
  // What the light hardly moves has no variance to be judged by.
  const double least = 1e-6 * eigen.eigenvalues()[along.size() - 1];
  for (Eigen::Index k = 0; k < along.size(); ++k) {
    if (eigen.eigenvalues()[k] < least) continue;
    result.chi2 += along[k] * along[k] / eigen.eigenvalues()[k];
    degrees += 1.0;
  }
  if (degrees > 0.0) result.p_value = chi_squared_upper_tail(result.chi2, degrees);
  return result;
}

class Refiner {
 public:
  Refiner(const BoxAlignment& edges, const RenderedView& view, const Image& photograph,
          const PhotometricOptions& options)
      : edges_(edges),
        view_(view),
        options_(options),
        bands_(paired_bands(view, photograph, options.mask, options.most_px)),
        fit_(bands_, view.picture().width, view.picture().height, options.gain_per_surface),
        points_(judged_points(edges)) {
    like_ = edges.camera;
    known_.indices = free_indices(edges);
    known_.mean = picked(edges.parameters, known_.indices);
    known_.covariance = edges.covariance;
  }

  PhotometricRefinement run() {
    PhotometricRefinement result;
    result.camera = edges_.camera;
    result.parameters = edges_.parameters;
    result.estimated = edges_.estimated;
    result.covariance = edges_.covariance;
    CameraParameters p = edges_.parameters;
    // Clear of the windows that edges were read from, and of the blur beyond them.
    const double clearance =
        std::max(7.0 * edges_.reduction, 6.0 * edges_.blur_px) + 1.0 * bands_.reduction;
    double dispersion = 1.0;
    bool solved = false;
    BlockScatter scatter;
    constexpr int kRounds = 4;
    for (int round = 0; round < kRounds; ++round) {
      if (options_.progress) options_.progress("light", double(round) / kRounds);
      fit_.set_samples(radiance_samples(view_, bands_, p, like_, clearance, options_.most_samples),
                       p);
      result.samples = fit_.samples().size();
      if (result.samples < kFewestSamples) {
        result.outcome = AlignmentOutcome::invalid_problem;
        result.message = "only " + std::to_string(result.samples) +
                         " pixels show one surface, unmasked and unsaturated, clear of all edges";
        return result;
      }
      const CameraParameters before = p;
      solved = fit_.solve(p, known_, dispersion);
      fit_.update_scales(p);
      scatter = scattered(p, dispersion);
      dispersion = std::max(1.0, scatter.dispersion);
      if (round > 1 && rms_distance_px(before, p, points_) < 1e-3) break;
    }
    scatter = scattered(p, dispersion);
    describe(result, p, scatter);
    show(result, p);
    if (!solved) {
      result.outcome = AlignmentOutcome::not_converged;
      result.message = "the fit to the photograph's light did not converge";
      return result;
    }
    judge(result, p, scatter);
    return result;
  }

 private:
  BlockScatter scattered(const CameraParameters& p, double dispersion) const {
    return block_scatter(fit_.rows(p, known_.indices), fit_.samples(), fit_.groups(),
                         known_information(), dispersion);
  }

  Eigen::MatrixXd known_information() const {
    const Eigen::MatrixXd w = known_.whitening();
    return w.transpose() * w;
  }

  /// The radiances' part and the edges'.
  Eigen::MatrixXd covariance_of(const BlockScatter& s) const {
    const auto n = static_cast<Eigen::Index>(known_.indices.size());
    const Eigen::MatrixXd by_edges =
        s.inverse_curvature.leftCols(n) * known_information() * s.inverse_curvature.topRows(n);
    return s.covariance + by_edges;
  }

  void describe(PhotometricRefinement& result, const CameraParameters& p,
                const BlockScatter& scatter) const {
    const auto n = static_cast<Eigen::Index>(known_.indices.size());
    const Eigen::MatrixXd covariance = covariance_of(scatter);
    const Eigen::MatrixXd camera = covariance.topLeftCorner(n, n);
    result.blocks = scatter.blocks;
    result.block_px = scatter.block_px * bands_.reduction;
    result.dispersion = scatter.dispersion;
    result.moved_px = rms_distance_px(p, edges_.parameters, points_);
    result.edge_u_px = rms_u_px(edges_.parameters, known_.indices, edges_.covariance, points_);
    result.refined_u_px = rms_u_px(p, known_.indices, camera, points_);
    result.edge_rms_before_px = edge_rms(edges_.parameters);
    result.edge_rms_after_px = edge_rms(p);
    const Eigen::MatrixXd k = scatter.inverse_curvature.topLeftCorner(n, n);
    const Eigen::MatrixXd follows = k * scatter.information;  // how the edges' errors move along
    const Agreed agreed = agreement(
        picked(p, known_.indices) - known_.mean,
        scatter.covariance.topLeftCorner(n, n) + follows * known_.covariance * follows.transpose());
    result.contradiction = agreed.chi2;
    result.p_value = agreed.p_value;
    for (std::size_t g = 0; g < fit_.groups(); ++g) {
      BandGain gain;
      gain.band = bands_.bands[fit_.band_of(g)].name;
      if (options_.gain_per_surface) gain.surface = view_.surface_name(fit_.surface_of(g));
      const Eigen::Index at = n + 2 * static_cast<Eigen::Index>(g);
      gain.gain = fit_.gain(g)[0];
      gain.gain_u = std::sqrt(covariance(at, at));
      gain.offset = fit_.gain(g)[1];
      gain.offset_u = std::sqrt(covariance(at + 1, at + 1));
      gain.rms = fit_.scale(fit_.band_of(g));
      result.bands.push_back(gain);
    }
  }

  void show(PhotometricRefinement& result, const CameraParameters& p) const {
    int step = 0;  // of the regular grid that samples lie on
    for (const RadianceSample& s : fit_.samples()) step = std::gcd(std::gcd(step, s.x), s.y);
    step = std::max(step, 1);
    result.picture_step_px = step * bands_.reduction;
    Image& picture = result.compared;
    picture = Image((bands_.width + step - 1) / step, (bands_.height + step - 1) / step);
    const float none = std::numeric_limits<float>::quiet_NaN();
    for (const BandPair& band : bands_.bands)
      for (const char* what : {"seen.", "predicted."}) picture.add_channel(what + band.name, none);
    for (const RadianceRow& row : fit_.rows(p, {})) {
      const RadianceSample& s = fit_.samples()[row.sample];
      const std::size_t i = picture.index(s.x / step, s.y / step);
      const float seen =
          bands_.bands[row.band].photograph[static_cast<std::size_t>(s.y * bands_.width + s.x)];
      picture.channels[2 * row.band].samples[i] = seen;
      picture.channels[2 * row.band + 1].samples[i] =
          seen + static_cast<float>(row.residual * fit_.scale(row.band));
    }
  }

  double edge_rms(const CameraParameters& p) const {
    std::vector<EdgeObservation> seen;
    for (const EdgeMatch& m : edges_.matches)
      if (m.use == EdgeUse::used) seen.push_back(m.seen);
    return rms_of(edge_residuals_px(p, seen));
  }

  void judge(PhotometricRefinement& result, const CameraParameters& p,
             const BlockScatter& scatter) const {
    if (result.p_value < kLevel) {
      result.outcome = AlignmentOutcome::contradiction;
      char text[200];
      std::snprintf(text, sizeof text,
                    "light and edges tell of different cameras (%.2g px apart, p = %.1g): the "
                    "prediction is not that of the photograph; the camera of the edges is kept",
                    result.moved_px, result.p_value);
      result.message = text;
      return;
    }
    result.outcome = AlignmentOutcome::converged;
    result.parameters = p;
    result.camera = camera_description(p, like_);
    const auto n = static_cast<Eigen::Index>(known_.indices.size());
    result.covariance = covariance_of(scatter).topLeftCorner(n, n);
    const auto values = picked(p, known_.indices);
    for (std::size_t i = 0; i < result.estimated.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      result.estimated[i].value = values[k];
      result.estimated[i].prior_u = edges_.estimated[i].standard_uncertainty;
      result.estimated[i].standard_uncertainty = std::sqrt(result.covariance(k, k));
    }
    if (result.refined_u_px > 0.98 * result.edge_u_px)
      result.message = "the light between the edges tells nothing that the edges do not";
  }

  const BoxAlignment& edges_;
  const RenderedView& view_;
  const PhotometricOptions& options_;
  BandPairs bands_;
  RadianceFit fit_;
  CameraDescription like_;
  KnownCamera known_;
  std::vector<Vec3> points_;
};

}  // namespace

PhotometricRefinement refine_by_radiance(const BoxAlignment& edges, const RenderedView& view,
                                         const Image& photograph,
                                         const PhotometricOptions& options) {
  PhotometricRefinement result;
  if (edges.outcome != AlignmentOutcome::converged) {
    result.outcome = edges.outcome;
    result.message = edges.message;
    result.camera = edges.camera;
    result.parameters = edges.parameters;
    return result;
  }
  return Refiner(edges, view, photograph, options).run();
}

}  // namespace truebox
