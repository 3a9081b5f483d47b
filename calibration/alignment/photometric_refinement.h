// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alignment/box_alignment.h"
#include "alignment/rendered_view.h"
#include "image/image.h"

namespace truebox {

struct PhotometricOptions {
  const Image* mask =
      nullptr;  ///< pixels of the photograph that are 0 in its first channel: unused
  bool gain_per_surface = false;  ///< else one gain and offset a band: reflectances count as known
  int most_px = 1024;             ///< larger photographs are reduced by averaging
  std::size_t most_samples = 60000;
  Progress progress;
};

/// One band of one surface, or of all: photograph = gain x prediction + offset.
struct BandGain {
  std::string band;
  std::string surface;  ///< empty: all
  double gain = 0.0, gain_u = 0.0;
  double offset = 0.0, offset_u = 0.0;  ///< share of the photograph's white
  double rms = 0.0;                     ///< of the residuals, likewise
};

struct PhotometricRefinement {
  AlignmentOutcome outcome = AlignmentOutcome::not_run;
  std::string message;  ///< one sentence, where the refined camera was not taken
  /// The pose as it is best known: the refined one, or, unless `converged`, that of the edges.
  CameraDescription camera;
  CameraParameters parameters;
  std::vector<EstimatedParameter>
      estimated;  ///< in the edges' order; `prior_u` is that of the edges
  Eigen::MatrixXd covariance;

  std::vector<BandGain> bands;
  std::size_t samples = 0, blocks = 0;
  int block_px = 0;            ///< of the photograph; side of the squares that count as one witness
  double dispersion = 1.0;     ///< how many times more the blocks scatter than independent pixels
  double moved_px = 0.0;       ///< rms shift in the picture against the edges' camera
  double edge_u_px = 0.0;      ///< rms uncertainty of picture positions by the edges alone
  double refined_u_px = 0.0;   ///< and with the radiances
  double contradiction = 0.0;  ///< chi^2 of the move against what it should scatter by
  double p_value = 1.0;        ///< of that; below 0.001 the edges' camera is kept
  double edge_rms_before_px = 0.0, edge_rms_after_px = 0.0;
  /// What was compared, at the camera of the fit (also one that was not taken): channels
  /// "seen.<band>" and "predicted.<band>", gain and offset applied; NaN where nothing was. Every
  /// `picture_step_px`th pixel of the photograph.
  Image compared;
  int picture_step_px = 1;
};

/// Refines a camera found from edges by the light between them: shadows, gradients, borders that no
/// polygon has. Minimised, with all of the edges' information (their estimate with its covariance),
/// over pose, lens, gains g and offsets o of each band b, by Ceres with Cauchy's loss:
///
///   sum_ib [photo_b(y_i) - g_b L_b(x_i - A_i (pi(X_i; p) - y_i)) - o_b]^2 / (phi s_b^2)
///
/// y_i is the centre of a pixel, X_i the point it shows by the camera so far, x_i where the
/// rendered picture has that point, A_i = dx / dy between both pictures, L_b the prediction there
/// (bicubic), pi the projection. Linearised anew until the camera rests. Pixels within a window's
/// width of any surface's edge are left out: those are what the edges were found from. So are
/// saturated ones.
///
/// Honesty. Residuals are no noise only: gradients, penumbrae and reflectances are predicted
/// wrongly by the same amount all over an area. Pixels therefore do not count as witnesses, squares
/// do; their side is doubled as long as that makes the camera less certain. The covariance is the
/// jackknife over squares (each left out in turn, to first order; Efron 1982; cluster-robust,
/// "CR3": Bell, McCaffrey 2002, Surv. Methodol. 28(2)) plus the edges' part, and phi, the squares'
/// scatter over that of independent pixels, lowers the weight of the light against that of the
/// edges.
///
/// A refined camera that lies further from the edges' than both uncertainties allow (p < 0.001)
/// says that prediction and photograph disagree: `no_such_box`, and the edges' camera stays.
/// Errors common to all of the picture remain, as for edges: a lamp that stands elsewhere moves
/// every shadow.
/// `photograph` and `view` share bands by name (spectral, else R G B), else the means of both.
PhotometricRefinement refine_by_radiance(const BoxAlignment& edges, const RenderedView& view,
                                         const Image& photograph,
                                         const PhotometricOptions& options);

}  // namespace truebox
