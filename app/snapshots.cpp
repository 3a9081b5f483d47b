// SPDX-License-Identifier: BSD-3-Clause
#include "snapshots.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "colour/colour_pipeline.h"
#include "image/image_file.h"
#include "mesh/smooth_field.h"
#include "prediction_options.h"
#include "scene/requirements.h"
#include "sensor/camera.h"

namespace truebox::app {
namespace {

using Eigen::Index;

constexpr double kNextAfter = 1.5;  // times the passes of the last picture

class Snapshots {
 public:
  Snapshots(const Scene& scene, const SnapshotOptions& options)
      : scene_(scene), options_(options), needs_(requirements(scene)) {
    CameraDescription camera = find_camera(scene, options.camera);
    camera.pixels = {
        options.width_px,
        std::max(1, static_cast<int>(options.width_px * camera.film_m[1] / camera.film_m[0]))};
    camera_ = camera;
    for (const Tristimulus& weight : band_weights(scene.bands, options.observer))
      weight_.push_back(linear_bt709(weight));
  }

  void look_at(const PatchMesh& mesh, const BandMatrix& source) {
    const Camera camera(camera_);
    const Visibility visibility(mesh, scene_);
    const std::vector<char> all(mesh.size(), 1);
    const SmoothField finder(mesh, all, BandMatrix::Zero(source.rows(), 1));
    element_.clear();
    for (int y = 0; y < camera.height_px(); ++y)
      for (int x = 0; x < camera.width_px(); ++x) {
        const auto ray = camera.ray({x + 0.5, y + 0.5});
        const auto hit = ray ? visibility.first_hit(ray->origin_m, ray->direction) : std::nullopt;
        element_.push_back(
            hit && hit->front ? static_cast<Index>(finder.find_patch(hit->piece, hit->point)) : -1);
      }
    surface_.clear();
    for (const Patch& patch : mesh.patches) surface_.push_back(mesh.surface_of(patch));
    double white = 0.0;
    for (Index i = 0; i < source.rows(); ++i) {
      const LinearRgb rgb = colour(source, i, false);
      white = std::max({white, rgb[0], rgb[1], rgb[2]});
    }
    exposure_ = white > 0.0 ? 1.0 / white : 1.0;
  }

  void take(double passes, const BandMatrix& reflected) {
    if (passes < next_) return;
    next_ = std::max(passes, 1e-6) * kNextAfter;
    Image image(camera_.pixels[0], camera_.pixels[1]);
    for (const char* name : {"R", "G", "B"}) image.add_channel(name);
    for (std::size_t p = 0; p < element_.size(); ++p) {
      if (element_[p] < 0) continue;
      const LinearRgb rgb = colour(reflected, element_[p], true);
      for (std::size_t c = 0; c < 3; ++c) image.channels[c].samples[p] = static_cast<float>(rgb[c]);
    }
    const DisplayPicture picture = colours_.picture(image, exposure_);
    const std::string name = fmt::format("passes_{:08.4f}.png", passes);
    const auto png = encode_png_rgb8(picture.width, picture.height, picture.rgb);
    write_file_atomically(options_.folder / name, png.data(), png.size());
    table_ += fmt::format("{},{:.6g}\n", name, passes);
    write_file_atomically(options_.folder / "snapshots.csv", "file,matrix_passes\n" + table_);
  }

 private:
  // Radiance of an element; what it emits itself only if asked for.
  LinearRgb colour(const BandMatrix& reflected, Index element, bool own) const {
    const auto& exitance =
        scene_.material_of(scene_.surfaces[surface_[static_cast<std::size_t>(element)]]).exitance;
    LinearRgb rgb{};
    for (std::size_t b = 0; b < weight_.size(); ++b) {
      double radiosity =
          needs_.band_scale[b] * reflected(element, static_cast<Index>(needs_.band_source[b]));
      if (own) radiosity += exitance[b];
      for (std::size_t c = 0; c < 3; ++c) rgb[c] += weight_[b][c] * radiosity / std::numbers::pi;
    }
    return rgb;
  }

  const Scene& scene_;
  SnapshotOptions options_;
  Requirements needs_;
  CameraDescription camera_;
  ColourPipeline colours_;
  std::vector<LinearRgb> weight_;       // of each band
  std::vector<Index> element_;          // that each pixel sees, -1: none
  std::vector<std::uint32_t> surface_;  // of each element
  double exposure_ = 1.0, next_ = 0.0;
  std::string table_;
};

}  // namespace

std::function<std::function<void(double, const BandMatrix&)>(const PatchMesh&, const BandMatrix&)>
snapshots(const Scene& scene, const SnapshotOptions& options) {
  auto taken = std::make_shared<Snapshots>(scene, options);
  return [taken](const PatchMesh& mesh, const BandMatrix& source) {
    taken->look_at(mesh, source);
    return [taken](double passes, const BandMatrix& reflected) { taken->take(passes, reflected); };
  };
}

}  // namespace truebox::app
