// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "alignment/refinement.h"
#include "alignment/rendered_view.h"
#include "image/image.h"
#include "radiometry/progress.h"
#include "scene/scene.h"

namespace truebox {

/// Which coefficients of the lens are estimated, each with the prior of a common lens.
enum class LensFreedom {
  fixed,   ///< none: as the guess has them
  radial,  ///< k1, k2
  full,    ///< k1, k2, k3, p1, p2
};

struct AlignmentOptions {
  LensFreedom lens = LensFreedom::radial;
  double focal_u = 0.1;             ///< of the guess's focal length, relative; 0: fixed
  double principal_point_u = 0.02;  ///< of the picture's width; 0: fixed
  double stretch_u = 0.0;           ///< of the scene's extents along its axes, relative; 0: fixed
  bool search = true;               ///< look about the guess first; else it is within some px
  int most_px = 2048;               ///< larger pictures are reduced by averaging
  /// Borders as `border_name` writes them, "ceiling/wall", with * and ? (fnmatch).
  std::vector<std::string> ignore;       ///< not looked for
  std::vector<std::string> hold_out;     ///< looked for and judged, not used
  std::vector<PointObservation> points;  ///< picked by hand
  Progress progress;
};

enum class EdgeUse { used, held_out, outlier, unseen };
std::string to_string(EdgeUse use);

/// A predicted piece of edge and where the photograph has it.
struct EdgeMatch {
  std::string border;
  EdgeUse use = EdgeUse::unseen;
  EdgeObservation seen;      ///< `position` is the photograph's; meaningless where unseen
  PixelPosition predicted;   ///< by the aligned camera
  double residual_px = 0.0;  ///< predicted minus seen along the normal
};

/// One border of two surfaces: how far off the prediction is.
struct BorderStatistics {
  std::string border;
  bool held_out = false;
  std::size_t predicted = 0, matched = 0;
  double mean_px = 0.0, rms_px = 0.0;
  double cross_validated_rms_px = 0.0;  ///< by a camera fitted without this border; NaN if none is
};

struct BoxAlignment {
  AlignmentOutcome outcome = AlignmentOutcome::not_run;
  std::string message;  ///< one sentence, where the outcome is not `converged`
  std::string null_direction;
  CameraDescription camera;
  CameraParameters parameters;
  std::vector<EstimatedParameter> estimated;
  Eigen::MatrixXd covariance;  ///< of `estimated`, in their order and units
  std::vector<EdgeMatch> matches;
  std::vector<BorderStatistics> borders;
  std::vector<double> point_residuals_px;  ///< of options.points, distances
  double matched_share = 0.0;    ///< of predicted pieces that the photograph has where predicted
  double rms_px = 0.0;           ///< of the edges used
  double held_out_rms_px = 0.0;  ///< of those held out; NaN if none are
  double cross_validated_rms_px = 0.0;  ///< each border by a camera fitted without it
  double excess_u_px = 0.0;             ///< scatter beyond the pixels' noise: shape, lens, shading
  EdgeErrors errors;                    ///< the same as the covariance has it, apart by kind
  double blur_px = 0.0;                 ///< median over the edges
  int reduction = 1;                    ///< pixels averaged each way before edges were sought
};

/// Finds the camera that sees the scene's edges where the photograph has them, from a guess up to
/// 10 degrees, 10 % of the distance and 10 % of the focal length off. Coarse to fine: a grid of
/// poses on a reduced picture, closest edges of like direction on finer ones (Cauchy's loss), then
/// steps fitted to the pixels across every predicted piece of edge. All px are the photograph's.
///
/// The covariance takes the pixels' noise and what the residuals tell of further errors, each
/// piece's own and waves along an edge (`edge_error_posterior`). A common error of all edges is not
/// in it: a wrong scene, a lens of another kind, a tone curve other than the photograph says.
///
/// Throws MismatchError where the photograph has another shape than the camera's film.
BoxAlignment align_box(const Scene& scene, const CameraDescription& guess, const Image& photograph,
                       const AlignmentOptions& options);

/// The same for a rendered picture in place of a scene: its own edges, those of shadows too, where
/// its AOVs say that they are; the guess is its camera. Of a print (see RenderedView) the camera
/// found stands for a registration of the whole picture. Lines that the render's polygons do not
/// have cannot be stretched: `stretch_u` has to be 0.
/// Throws MismatchError as above, except for a print, which may have another shape.
BoxAlignment align_picture(const RenderedView& view, const Image& photograph,
                           const AlignmentOptions& options);

}  // namespace truebox
