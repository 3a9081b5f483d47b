// SPDX-License-Identifier: BSD-3-Clause
// A photograph and a rendered picture: registered by the picture's own edges.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <set>

#include "alignment/box_alignment.h"
#include "alignment/render_mapping.h"
#include "radiometry/input_error.h"
#include "sensor/aovs.h"
#include "support/edge_picture.h"

namespace truebox {
namespace {

using testing::HasSubstr;

/// A shadow's edge across every wall, as no polygon has it.
double half_in_shadow(int surface, const Vec3& p) {
  return even_shade(surface, p) * (surface >= 0 && p[0] + 0.4 * p[1] > 0.5 ? 0.6 : 1.0);
}

const Image& render() {
  static const Image kImage = edge_picture(test_box(), test_camera(), half_in_shadow, 0.0, 1);
  return kImage;
}

/// Turned by 4 degrees, its lens 5 % longer and not without distortion; `moved` also elsewhere.
CameraDescription photographer(bool moved) {
  CameraDescription camera = test_camera(540, 450);
  const Eigen::Matrix3d r(Eigen::AngleAxisd(0.07, Vec3(0.3, 1.0, 0.5).normalized()));
  camera.direction = r * camera.direction;
  camera.up = r * camera.up;
  camera.focal_length_m *= 1.05;
  camera.lens.distortion.k1 = -0.08;
  if (moved) camera.position_m += Vec3(0.1, -0.05, 0.12);
  return camera;
}

/// rms distance between where the mapping has the render's pixels and where they are.
double mapping_error_px(const RenderedView& view, const Image& mapping,
                        const CameraDescription& truth) {
  const Camera camera(truth);
  const RenderedView exact(render(), test_camera(),
                           geometry_aovs(test_box(), Camera(test_camera())));
  double sum = 0.0, n = 0.0;
  for (int y = 0; y < mapping.height; ++y)
    for (int x = 0; x < mapping.width; ++x) {
      const std::size_t i = mapping.index(x, y);
      const auto place = exact.at_pixel(x, y);
      if (!place || !std::isfinite(mapping.channels[0].samples[i])) continue;
      const auto at = camera.project(place->point_m);
      sum += std::pow(mapping.channels[0].samples[i] - at.position.x_px, 2) +
             std::pow(mapping.channels[1].samples[i] - at.position.y_px, 2);
      n += 1.0;
    }
  EXPECT_GT(n, 0.5 * static_cast<double>(view.picture().pixel_count()));
  return std::sqrt(sum / n);
}

TEST(AlignPicture, FindsTheCameraByTheEdgesOfARenderWithAovs) {
  const CameraDescription truth = photographer(true);
  const Image photo = edge_picture(test_box(), truth, half_in_shadow, 0.01, 2);
  const RenderedView view(render(), test_camera(),
                          geometry_aovs(test_box(), Camera(test_camera())));
  const BoxAlignment found = align_picture(view, photo, {});
  ASSERT_EQ(found.outcome, AlignmentOutcome::converged) << found.message;
  // Lines that only the light draws count too.
  const bool shadow = std::any_of(found.matches.begin(), found.matches.end(), [](const auto& m) {
    return m.use == EdgeUse::used && m.border == "on back";
  });
  EXPECT_TRUE(shadow);
  const Image mapping = photo_from_render(view, found.parameters, photo.width, photo.height);
  const double error = mapping_error_px(view, mapping, truth);
  std::printf("render with AOVs: mapped within %.3f px rms, edges %.3f px rms\n", error,
              found.rms_px);
  EXPECT_LT(error, 0.1);
}

// From one place, what a picture shows does not depend on how far it is: no geometry is needed.
TEST(AlignPicture, RegistersAPhotographToAPictureThatSaysNothingOfItsScene) {
  const CameraDescription truth = photographer(false);
  const Image photo = edge_picture(test_box(), truth, half_in_shadow, 0.01, 3);
  const RenderedView view{render()};
  const BoxAlignment found = align_picture(view, photo, {});
  ASSERT_EQ(found.outcome, AlignmentOutcome::converged) << found.message;
  const Image mapping = photo_from_render(view, found.parameters, photo.width, photo.height);
  const double error = mapping_error_px(view, mapping, truth);
  std::printf("print: mapped within %.3f px rms, edges %.3f px rms\n", error, found.rms_px);
  EXPECT_LT(error, 0.1);
  // The photograph in the render's pixels shows what the render shows, away from the lens' corners.
  const Image seen = in_render_pixels(photo, mapping);
  double sum = 0.0, n = 0.0;
  for (int y = 100; y < 300; ++y)
    for (int x = 120; x < 360; ++x) {
      const float v = seen.channels[0].samples[seen.index(x, y)];
      ASSERT_TRUE(std::isfinite(v));
      sum += std::abs(v - render().channels[0].samples[render().index(x, y)]);
      n += 1.0;
    }
  EXPECT_LT(sum / n, 0.01);  // noise of 1 %, averaged a little, and edges half a pixel wide
}

TEST(AlignPicture, RefusesAnotherPicture) {
  const RenderedView view{render()};
  std::mt19937_64 random(5);
  Image noise(480, 400);
  for (float& v : noise.add_channel("Y").samples) v = float(random() % 1000) / 1000.0f;
  const BoxAlignment found = align_picture(view, noise, {});
  EXPECT_EQ(found.outcome, AlignmentOutcome::no_such_box) << found.matched_share;
  EXPECT_THAT(found.message, HasSubstr("does not show this picture"));
}

TEST(RenderedView, NamesTheChannelThatIsMissing) {
  Image aovs(480, 400);
  aovs.add_channel("surface.id");
  try {
    RenderedView(render(), test_camera(), aovs);
    FAIL() << "AOVs without positions";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("position.X"));
  }
  EXPECT_THROW(RenderedView(render(), test_camera(), Image(10, 10)), MismatchError);
}

// A wall behind another: what the photograph's camera cannot see has no place there.
TEST(PhotoFromRender, LeavesOutWhatIsHiddenInThePhotograph) {
  CameraDescription aside = test_camera();
  aside.position_m += Vec3(-0.9, 0.0, 0.3);
  aside.direction += Vec3(0.25, 0.0, 0.0);
  const RenderedView view(render(), test_camera(),
                          geometry_aovs(test_box(), Camera(test_camera())));
  const CameraParameters p = camera_parameters(aside, Vec3(0.0, 1.0, 1.0));
  const Image mapping = photo_from_render(view, p, 480, 400);
  const RenderedView there(render(), aside, geometry_aovs(test_box(), Camera(aside)));
  // Borders aside, where a pixel's centre decides; and what the render does not show at all.
  const auto surface_there = [&](PixelPosition at) {
    const int x = static_cast<int>(at.x_px), y = static_cast<int>(at.y_px);
    int found = -1;
    for (int dy = -2; dy <= 2; ++dy)
      for (int dx = -2; dx <= 2; ++dx) {
        const auto seen = there.at_pixel(x + dx, y + dy);
        const int id = seen ? seen->surface : 0;
        if (found >= 0 && id != found) return -1;
        found = id;
      }
    return found;
  };
  std::set<int> shown;
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 480; ++x)
      if (const auto place = view.at_pixel(x, y)) shown.insert(place->surface);
  std::size_t right = 0, wrong = 0, lost = 0, hidden = 0;
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 480; ++x) {
      const auto place = view.at_pixel(x, y);
      const auto at = place ? projected(p, place->point_m) : std::nullopt;
      if (!at || at->x_px < 4 || at->y_px < 4 || at->x_px > 476 || at->y_px > 396) continue;
      const int seen = surface_there(*at);
      if (!shown.contains(seen)) continue;
      const bool visible = seen == place->surface;
      const bool mapped = std::isfinite(mapping.channels[0].samples[mapping.index(x, y)]);
      right += visible == mapped;
      wrong += mapped && !visible;
      lost += visible && !mapped;
      hidden += !visible;
    }
  std::printf("mapped or hidden rightly %zu, mapped though hidden %zu, lost %zu\n", right, wrong,
              lost);
  EXPECT_GT(hidden, 50u);
  // A face of which the render shows a part only hides nothing by its other part.
  EXPECT_LT(static_cast<double>(wrong), 0.01 * static_cast<double>(right));
  EXPECT_LT(static_cast<double>(lost), 0.001 * static_cast<double>(right));
}

}  // namespace
}  // namespace truebox
