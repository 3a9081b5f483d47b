// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mesh/patch_mesh.h"
#include "sensor/camera.h"

namespace truebox {

/// Pixels that show one element, and points of it that stand for them.
struct PixelBlock {
  std::uint32_t element = 0;
  std::vector<std::uint32_t> pixels;  ///< y * width + x
  std::vector<Vec3> points;           ///< centres of some of the pixels on the surface, m
  Vec3 centre = Vec3::Zero();         ///< mean over all pixels, m
};

struct PixelBlockOptions {
  int margin_px = 1;  ///< pixels left out along every edge of a surface
  int samples = 16;   ///< points of a block, at most
};

struct PixelBlocks {
  std::vector<PixelBlock> blocks;
  std::vector<std::size_t> pixels_of_surface;  ///< seen at their centre, none left out
};

/// Sorts a camera's pixels by the element that their centre sees. Left out: pixels whose corners,
/// or whose neighbours within the margin, see another surface; backs of surfaces; elements that are
/// not usable.
PixelBlocks pixel_blocks(const Scene& scene, const PatchMesh& mesh, const std::vector<char>& usable,
                         const Camera& camera, const PixelBlockOptions& options);

/// A mean over all pixels of a block from values at its points, with its standard uncertainty.
struct SampledMean {
  double value = 0.0;
  double standard_uncertainty = 0.0;
};

/// The plane that fits the values best, at the block's centre; u is the scatter about it over the
/// root of the number of points: nearly 0 where the light is smooth, large where a shadow's edge
/// passes between the points. Below five points the plain mean, u = 0.
SampledMean mean_over_block(const PixelBlock& block, const Eigen::VectorXd& values);

}  // namespace truebox
