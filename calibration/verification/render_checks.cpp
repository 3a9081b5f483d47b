// SPDX-License-Identifier: BSD-3-Clause
#include "verification/render_checks.h"

#include <algorithm>
#include <cmath>

#include "image/image_file.h"
#include "image/spectral_image.h"
#include "path_tracer/path_tracer.h"
#include "scene/scene_file.h"
#include "sensor/render.h"
#include "verification/picture_agreement.h"

namespace truebox {
namespace {

constexpr int kBlock_px = 16;
constexpr double kBiasScores = 4.0;  // 6e-5, of the largest of seven bands 4e-4
constexpr double kLeastBias = 1e-3;  // what the grid of 6000 elements is good for
constexpr double kSpread = 0.1;
constexpr double kFamilyLevel = 0.01;  // chance to fail one pair that agrees

void add_p_values(const std::string& pair, const Image& map, Image& all) {
  if (all.channels.empty()) all = Image(map.width, map.height);
  all.attributes["unit"] = "1";
  for (const Channel& channel : map.channels)
    all.channels.push_back({pair + channel.name.substr(channel.name.find('.')), channel.samples});
}

void compare(const std::string& pair, const UncertainPicture& test,
             const UncertainPicture& reference, std::vector<AccuracyCheck>& checks,
             Image* p_values) {
  const PictureAgreement pixels = picture_agreement(test, reference);
  const PictureAgreement blocks = picture_agreement(test, reference, kBlock_px);
  checks.push_back({"render", pair + ": family-wise p of 16 x 16 px blocks", blocks.family_wise_p,
                    1.0, 1.0 - kFamilyLevel, "1", "level 1 % of all blocks and bands together"});
  checks.push_back({"render", pair + ": bias of the worst band", pixels.bias, 0.0,
                    std::max(kLeastBias, kBiasScores * std::abs(pixels.bias / pixels.bias_score)),
                    "1", "4 standard errors of a whole band, at least 0.1 %"});
  checks.push_back({"render", pair + ": spread of the scores", pixels.rms_score, 1.0,
                    std::hypot(1.0, pixels.rms_bound) - 1.0 + kSpread, "1",
                    "N(0, 1), widened by what the bounds admit and by 0.1: the standard errors of "
                    "dark pixels are themselves uncertain"});
  if (p_values) add_p_values(pair, pixels.p_values, *p_values);
}

}  // namespace

std::vector<AccuracyCheck> check_renders(const std::filesystem::path& reference_dir,
                                         const RenderCheckOptions& options, Image* p_values) {
  const auto folder = reference_dir / "independent_renders";
  const Image independent = read_image(folder / "cornell_box_front_256_7bands.exr");
  const Image independent_u = read_image(folder / "cornell_box_front_256_7bands_stderr.exr");
  const Scene scene = in_bands_at(read_scene(reference_dir / "cornell_box" / "cornell_box.toml"),
                                  spectral_channels(independent).wavelengths_nm);
  CameraDescription description = scene.cameras.at("front");
  description.pixels = {independent.width, independent.height};
  const Camera camera(description);

  PredictOptions predict;
  predict.elements = options.elements;
  predict.progress = options.progress;
  const Prediction prediction(scene, predict);
  const RenderedImage radiosity = render(prediction, camera, {.progress = options.progress});

  PathTraceOptions trace;
  trace.samples = options.samples;
  trace.progress = options.progress;
  const PathTracedImage paths = trace_paths(
      scene, independent.width, independent.height,
      [&](int x, int y, UnitPair at) {
        const Ray ray = *camera.ray({x + at.u, y + at.v});
        return PixelRay{ray.origin_m, ray.direction};
      },
      trace);
  const Image paths_u = paths.standard_error();

  const UncertainPicture by_radiosity{&radiosity.radiance, nullptr, &radiosity.error_bound};
  const UncertainPicture by_paths{&paths.radiance, &paths_u, nullptr, paths.randomisations - 1};
  const UncertainPicture by_others{&independent, &independent_u};
  std::vector<AccuracyCheck> checks;
  compare("paths-independent", by_paths, by_others, checks, p_values);
  compare("radiosity-independent", by_radiosity, by_others, checks, p_values);
  compare("radiosity-paths", by_radiosity, by_paths, checks, p_values);
  return checks;
}

}  // namespace truebox
