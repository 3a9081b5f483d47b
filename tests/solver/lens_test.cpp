// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/lens.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "sensor/camera.h"

namespace truebox {
namespace {

LensDistortion all_terms() {
  return {.k1 = -0.31,
          .k2 = 0.12,
          .p1 = 0.0015,
          .p2 = -0.0023,
          .k3 = -0.017,
          .k4 = 0.041,
          .k5 = -0.013,
          .k6 = 0.0029,
          .s1 = 0.0011,
          .s2 = -0.0007,
          .s3 = -0.0019,
          .s4 = 0.0005};
}

// Lenses as calibrations publish them: barrel, pincushion, wide rational, decentred, tilted glass.
std::vector<LensDistortion> lenses() {
  return {{},
          {.k1 = -0.28, .k2 = 0.07},
          {.k1 = 0.15, .k2 = 0.02, .k3 = 0.004},
          {.k1 = 5.1, .k2 = 2.3, .k3 = 0.1, .k4 = 5.4, .k5 = 3.9, .k6 = 0.55},
          {.k1 = -0.2, .p1 = 0.004, .p2 = -0.003},
          {.s1 = 0.01, .s2 = -0.002, .s3 = -0.008, .s4 = 0.001},
          all_terms()};
}

// Directions spread over the field, to `share` of its radius and not beyond 75 degrees.
std::vector<NormalisedPoint> directions(const Lens& lens, double share) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<NormalisedPoint> points = {{0.0, 0.0}};
  const double most =
      std::min(share * lens.field_radius(), std::tan(75.0 / 180.0 * std::numbers::pi));
  for (int i = 0; i < 500; ++i) {
    const double r = most * std::sqrt(uniform(random));
    const double azimuth = 2.0 * std::numbers::pi * uniform(random);
    points.push_back({r * std::cos(azimuth), r * std::sin(azimuth)});
  }
  return points;
}

// Expected values: the published equations in exact rational arithmetic, rounded to 17 digits;
// OpenCV 4.6 itself (projectPoints) agrees to 3e-16.
TEST(Lens, DistortsAsOpenCvPublishes) {
  const double cases[][4] = {{0.1, 0.2, 0.098233719009241341, 0.19657218801848267},
                             {-0.35, 0.28, -0.32844405536824456, 0.26247959864599563},
                             {0.5, -0.4, 0.43707605543233541, -0.35022853034586832},
                             {0.0, 0.0, 0.0, 0.0},
                             {-0.61, -0.02, -0.54402183383936265, -0.017898563004979103}};
  for (const auto& c : cases) {
    const NormalisedPoint image = distorted(all_terms(), NormalisedPoint{c[0], c[1]});
    EXPECT_NEAR(image.x, c[2], 4e-16) << "four roundings of numbers below 1";
    EXPECT_NEAR(image.y, c[3], 4e-16);
  }
}

TEST(Lens, ComesBackFromTheFilm) {
  for (const LensDistortion& distortion : lenses()) {
    const Lens lens(distortion);
    // At 99 % of the field the inverse still is well conditioned enough for 1e-12.
    for (const NormalisedPoint& p : directions(lens, 0.99)) {
      const auto image = lens.distort(p);
      ASSERT_EQ(image.outcome, LensOutcome::ok);
      const auto back = lens.undistort(image.point);
      ASSERT_EQ(back.outcome, LensOutcome::ok) << p.x << " " << p.y;
      const double allowed = 1e-12 * (1.0 + std::hypot(p.x, p.y));
      EXPECT_NEAR(back.point.x, p.x, allowed);
      EXPECT_NEAR(back.point.y, p.y, allowed);
    }
  }
}

TEST(Lens, SaysWhereTheModelFoldsOver) {
  // r'' = r - 0.4 r^3 turns at r = 1 / sqrt(1.2), r'' = (2 / 3) r.
  const double fold = 1.0 / std::sqrt(1.2);
  const Lens lens({.k1 = -0.4});
  EXPECT_NEAR(lens.field_radius(), fold, 1e-15);
  for (double azimuth : {0.0, 0.7, 2.0, 4.4}) {
    const double x = std::cos(azimuth), y = std::sin(azimuth), edge = fold * 2.0 / 3.0;
    EXPECT_EQ(lens.undistort({0.999999 * edge * x, 0.999999 * edge * y}).outcome, LensOutcome::ok);
    for (double beyond : {1.000001, 1.5, 100.0})
      EXPECT_EQ(lens.undistort({beyond * edge * x, beyond * edge * y}).outcome,
                LensOutcome::outside_field)
          << "no direction is imaged there";
    EXPECT_EQ(lens.distort({1.0001 * fold * x, 1.0001 * fold * y}).outcome,
              LensOutcome::outside_field)
        << "folded back onto a place that another direction has";
  }
  EXPECT_EQ(lens.undistort({NAN, 0.0}).outcome, LensOutcome::outside_field);
  EXPECT_EQ(lens.distort({0.0, INFINITY}).outcome, LensOutcome::outside_field);
}

TEST(Lens, EndsItsFieldBeforeAPole) {
  // The denominator 1 - r^2 / 4 vanishes at r = 2, and r'' rises all the way to it.
  const Lens lens({.k4 = -0.25});
  EXPECT_NEAR(lens.field_radius(), 2.0, 1e-14);
  EXPECT_EQ(lens.distort({2.5, 0.0}).outcome, LensOutcome::outside_field);
  const auto far = lens.undistort({1e6, 0.0});
  ASSERT_EQ(far.outcome, LensOutcome::ok) << "r'' reaches every height before the pole";
  EXPECT_NEAR(far.point.x, 2.0, 1e-5);
}

TEST(Lens, IsOneToOneOnItsField) {
  // The least singular value of J bounds how near two images may come: with J's symmetric part
  // positive definite, (a - b) . (image a - image b) > 0 for every pair.
  for (const LensDistortion& distortion : lenses()) {
    const Lens lens(distortion);
    const auto points = directions(lens, 1.0);
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const auto a = lens.distort(points[i]).point, b = lens.distort(points[i + 1]).point;
      EXPECT_GT((points[i].x - points[i + 1].x) * (a.x - b.x) +
                    (points[i].y - points[i + 1].y) * (a.y - b.y),
                0.0);
    }
  }
}

TEST(Lens, JacobianHasItsNumericTwin) {
  for (const LensDistortion& distortion : lenses()) {
    for (const NormalisedPoint& p : {NormalisedPoint{0.31, -0.22}, NormalisedPoint{-0.05, 0.47}}) {
      const auto j = distortion_jacobian(distortion, p);
      const double h = 1e-5;  // central differences: h^2 = 1e-10 off
      const auto right = distorted(distortion, NormalisedPoint{p.x + h, p.y});
      const auto left = distorted(distortion, NormalisedPoint{p.x - h, p.y});
      const auto down = distorted(distortion, NormalisedPoint{p.x, p.y + h});
      const auto up = distorted(distortion, NormalisedPoint{p.x, p.y - h});
      EXPECT_NEAR(j[0], (right.x - left.x) / (2.0 * h), 2e-9);
      EXPECT_NEAR(j[1], (down.x - up.x) / (2.0 * h), 2e-9);
      EXPECT_NEAR(j[2], (right.y - left.y) / (2.0 * h), 2e-9);
      EXPECT_NEAR(j[3], (down.y - up.y) / (2.0 * h), 2e-9);
    }
  }
}

CameraDescription tilted_camera() {
  CameraDescription d;
  d.position_m = {1.0, -2.0, 0.5};
  d.direction = {0.3, 2.0, 0.4};
  d.up = {0.1, 0.0, 1.0};
  d.focal_length_m = 0.024;
  d.film_m = {0.036, 0.024};
  d.pixels = {720, 480};
  d.lens.distortion = all_terms();
  d.lens.principal_point_m = {0.0004, -0.0003};
  return d;
}

TEST(Camera, ProjectsEveryPointOfARayToItsPixel) {
  const Camera camera(tilted_camera());
  for (const PixelPosition p : {PixelPosition{0.0, 0.0}, PixelPosition{719.5, 0.5},
                                PixelPosition{368.0, 234.0}, PixelPosition{100.25, 479.0}}) {
    const auto ray = camera.ray(p);
    ASSERT_TRUE(ray);
    EXPECT_NEAR(ray->direction.norm(), 1.0, 1e-15);
    for (double distance_m : {0.01, 1.0, 1e4}) {
      const auto seen = camera.project(ray->origin_m + distance_m * ray->direction);
      ASSERT_EQ(seen.outcome, LensOutcome::ok);
      // The position's own rounding, 4e-16 m of 2 m seen from 1 cm, is 1e-10 px here.
      EXPECT_NEAR(seen.position.x_px, p.x_px, 1e-9);
      EXPECT_NEAR(seen.position.y_px, p.y_px, 1e-9);
    }
    EXPECT_EQ(camera.project(ray->origin_m - ray->direction).outcome, LensOutcome::behind_camera);
  }
}

TEST(Camera, PutsTheAxisOnThePrincipalPoint) {
  const Camera camera(tilted_camera());
  const auto d = tilted_camera();
  const auto seen = camera.project(d.position_m + d.direction);
  ASSERT_EQ(seen.outcome, LensOutcome::ok);
  EXPECT_NEAR(seen.position.x_px, 360.0 + 0.4 / 0.05, 1e-12) << "0.4 mm right, 0.05 mm a pixel";
  EXPECT_NEAR(seen.position.y_px, 240.0 - 0.3 / 0.05, 1e-12) << "0.3 mm up";
  EXPECT_EQ(camera.project(d.position_m).outcome, LensOutcome::behind_camera) << "the pinhole";
}

TEST(Camera, HasNoRayOutsideTheField) {
  CameraDescription d;
  d.focal_length_m = 0.010;
  d.lens.distortion.k1 = -0.4;  // images nothing beyond r'' = 0.61, 6.1 mm; the corner is at 17.7
  const Camera camera(d);
  EXPECT_FALSE(camera.ray({0.5, 0.5}));
  EXPECT_TRUE(camera.ray({256.0, 256.0}));
}

}  // namespace
}  // namespace truebox
