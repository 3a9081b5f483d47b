// SPDX-License-Identifier: BSD-3-Clause
// Pixels of a photograph and where a rendered picture has what they show. Internal to this folder.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alignment/camera_parameters.h"
#include "alignment/rendered_view.h"

namespace truebox {

/// One band of both pictures, each scaled to 1 at its 99.9 % quantile.
struct BandPair {
  std::string name;
  std::vector<float> photograph;  ///< linear, `width` x `height`; NaN: saturated or masked
  std::vector<float> render;      ///< of the render's size
};

struct BandPairs {
  int width = 0, height = 0;  ///< of the photograph's planes
  int reduction = 1;          ///< px of the photograph averaged each way
  std::vector<BandPair> bands;
};

/// Bands that both pictures have light in: spectral channels of one name, else R, G, B, else the
/// means. InputError where there is none.
BandPairs paired_bands(const RenderedView& view, const Image& photograph, const Image* mask,
                       int most_px);

struct RadianceSample {
  int x = 0, y = 0;      ///< pixel of the photograph's planes
  int surface = 0;       ///< id
  PixelPosition seen;    ///< its centre, px of the photograph
  PixelPosition render;  ///< where the render has the same point, px
  Eigen::Matrix2d render_from_photo = Eigen::Matrix2d::Identity();  ///< derivative between them
  Vec3 point_m = Vec3::Zero();  ///< as CameraParameters take it, before stretching
};

/// Every pixel whose surroundings, `clearance_px` of the photograph each way, show one surface
/// only, at most about `most` of them on a regular grid.
std::vector<RadianceSample> radiance_samples(const RenderedView& view, const BandPairs& bands,
                                             const CameraParameters& parameters,
                                             const CameraDescription& like, double clearance_px,
                                             std::size_t most);

}  // namespace truebox
