// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "mesh/patch_mesh.h"
#include "sensor/camera.h"

namespace truebox {

/// A rectangle of pixels: left, top, width, height.
using PixelRectangle = std::array<int, 4>;

/// Pixels that make one reading. Which pixels they are does not change while a camera or the scene
/// moves under them; what they show does.
struct PixelWindow {
  std::vector<std::uint32_t> pixels;  ///< y * width + x
  std::uint32_t piece = 0;            ///< of the mesh, shown by all of them; unless mixed
  std::vector<PixelRectangle> mixed;  ///< the same pixels, where an edge runs through them
  bool is_mixed() const { return !mixed.empty(); }
};

struct PixelWindowOptions {
  int margin_px = 1;  ///< pixels left out along every edge of a surface
  int tile_px = 0;    ///< side of the squares that hold edges; 0: edges are left out
  /// Which pixels measure: photosites of one colour. Empty: all of them.
  std::function<bool(int x, int y)> uses;
};

struct PixelWindows {
  std::vector<PixelWindow> windows;
  std::vector<std::size_t> pixels_of_surface;  ///< seen at their centre, none left out
};

/// Sorts a camera's pixels. Those whose corners and neighbours within the margin see the same
/// surface: by the element that their centre sees. With tiles, squares of pixels through which an
/// edge between lit surfaces runs are a window each: the mean over a whole square knows where the
/// edge is, and a blur smaller than the square moves it little. Left out: squares in or beside
/// which a pixel sees a back or nothing at all, and all other pixels near edges.
PixelWindows pixel_windows(const Scene& scene, const PatchMesh& mesh,
                           const std::vector<char>& usable, const Camera& camera,
                           const PixelWindowOptions& options);

/// One flat piece as a window shows it.
struct PixelBlock {
  std::uint32_t piece = 0;
  double share = 1.0;           ///< of the window
  std::vector<Vec3> points;     ///< of the piece that stand for it, m
  std::vector<double> weights;  ///< of a mixed window's points, they sum to 1; else empty
  Vec3 centre = Vec3::Zero();   ///< mean over its pixels, m
  Vec3 eye = Vec3::Zero();      ///< the camera, m
};

/// What a window of one piece shows: where its pixels' rays meet the plane of the piece. At most
/// `samples` points.
PixelBlock seen_piece(const PatchMesh& mesh, const Camera& camera, const PixelWindow& window,
                      int samples);

/// What a mixed window shows: for each piece its visible part within the pixels, exact by polygon
/// clipping (a lens bends the side of a rectangle by less than its curvature over so few pixels).
/// Shares are of the area on the film; what is black or nothing has none.
std::vector<PixelBlock> seen_pieces(const PatchMesh& mesh, const Scene& scene, const Camera& camera,
                                    const PixelWindow& window);

/// A mean over all pixels of a block from values at its points, with its standard uncertainty.
struct SampledMean {
  double value = 0.0;
  double standard_uncertainty = 0.0;
};

/// The plane that fits the values best, at the block's centre; u is the scatter about it over the
/// root of the number of points: nearly 0 where the light is smooth, large where a shadow's edge
/// passes between the points. Below five points the plain mean, u = 0. Of a mixed window the
/// weighted mean; u is the weighted scatter over the root of the number of points.
SampledMean mean_over_block(const PixelBlock& block, const Eigen::VectorXd& values);

}  // namespace truebox
