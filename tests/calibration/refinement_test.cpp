// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/refinement.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "alignment/scene_edges.h"
#include "support/edge_picture.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

using testing::HasSubstr;

ParameterFreedom pose_and_focal_length() {
  ParameterFreedom freedom;
  for (std::size_t k = 0; k < 7; ++k) freedom.free[k] = true;
  return freedom;
}

/// Every visible piece of edge where the camera sees it, moved along its normal by errors of
/// standard deviation u that are correlated by `rho` from one piece to the next.
Observations observed(const CameraParameters& p, const std::vector<EdgeSample>& samples, double u,
                      double rho, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Observations seen;
  double error = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const EdgeSample& s = samples[i];
    const bool first = i == 0 || samples[i - 1].edge != s.edge;
    error = first ? normal(random) : rho * error + std::sqrt(1.0 - rho * rho) * normal(random);
    const auto px = projected(p, s.point_m);
    seen.edges.push_back({s.edge,
                          s.point_m,
                          {px->x_px + u * error * s.normal[0], px->y_px + u * error * s.normal[1]},
                          s.normal,
                          u});
  }
  return seen;
}

struct Simulated {
  double chi2_per_parameter = 0.0;
  std::size_t misses = 0, checks = 0;
};

/// Fits `trials` simulated pictures; with or without the correlation in the covariance.
Simulated simulate(double rho, bool correlated_covariance, std::size_t trials) {
  const SceneEdges edges(test_box());
  const CameraDescription camera = test_camera();
  const CameraParameters truth = camera_parameters(camera, edges.centre_m());
  const auto samples = edges.visible(Camera(camera), {.spacing_px = 10.0});
  std::mt19937_64 random(11);
  Simulated result;
  for (std::size_t trial = 0; trial < trials; ++trial) {
    const Observations seen = observed(truth, samples, 0.3, rho, random);
    const ParameterFreedom freedom = pose_and_focal_length();
    const Refinement fit = refine(truth, seen, {freedom, 0.0, 50});
    EXPECT_TRUE(fit.converged);
    std::vector<double> standardised = edge_residuals_px(fit.parameters, seen.edges);
    for (double& r : standardised) r /= 0.3;
    const auto along = correlated_covariance ? correlation_along_edges(seen.edges, standardised)
                                             : std::vector<double>{};
    const ParameterCovariance c = parameter_covariance(fit.parameters, seen, freedom, along);
    EXPECT_EQ(c.outcome, AlignmentOutcome::converged);
    Eigen::VectorXd error(7);
    for (std::size_t k = 0; k < 6; ++k)
      error[Eigen::Index(k)] = fit.parameters.pose[k] - truth.pose[k];
    error[6] = fit.parameters.intrinsics[0] - truth.intrinsics[0];
    result.chi2_per_parameter += error.dot(c.covariance.ldlt().solve(error)) / 7.0 / double(trials);
    for (Eigen::Index k = 0; k < 7; ++k) {
      result.misses += std::abs(error[k]) > 2.0 * std::sqrt(c.covariance(k, k));
      ++result.checks;
    }
  }
  return result;
}

TEST(ParameterCovariance, CoversTheTruthUnderIndependentErrors) {
  constexpr std::size_t kTrials = 150;
  const Simulated s = simulate(0.0, true, kTrials);
  // chi^2 of 7 degrees of freedom; its mean within 4 standard deviations.
  EXPECT_NEAR(s.chi2_per_parameter, 1.0, 4.0 * std::sqrt(2.0 / 7.0 / kTrials));
  // Parameters of one trial move together: the trials count, not the checks.
  const auto misses = static_cast<std::size_t>(std::lround(double(s.misses) / 7.0));
  EXPECT_GT(binomial_upper_tail(misses, kTrials, 0.0455), 1e-3) << misses;
  EXPECT_GT(1.0 - binomial_upper_tail(misses + 1, kTrials, 0.0455), 1e-3) << misses;
}

// Errors that go along an edge, as of a board that is bent: neighbours say the same twice.
TEST(ParameterCovariance, TakesCorrelationAlongEdgesIntoAccount) {
  constexpr std::size_t kTrials = 100;
  const Simulated naive = simulate(0.8, false, kTrials);
  const Simulated honest = simulate(0.8, true, kTrials);
  std::printf(
      "chi2/nu with errors correlated by 0.8: %.2f if taken as independent, %.2f as stated\n",
      naive.chi2_per_parameter, honest.chi2_per_parameter);
  EXPECT_GT(naive.chi2_per_parameter, 3.0);  // intervals would be half as wide as they should be
  // Correlations are estimated from residuals, of which the fit has taken away what goes along all
  // of an edge: what is stated stays short by up to a third, of a factor of 2.7.
  EXPECT_LT(honest.chi2_per_parameter, 1.8);
  EXPECT_GT(honest.chi2_per_parameter, 0.5);
}

TEST(ParameterCovariance, NamesTheDirectionThatOnePlaneLeavesOpen) {
  Scene plane = test_box();
  plane.surfaces = {plane.surfaces[2]};
  CameraDescription camera = test_camera();
  camera.direction = Vec3::UnitZ();
  camera.up = Vec3::UnitY();
  camera.position_m = {0.0, 1.0, -3.0};
  const SceneEdges edges(plane);
  const CameraParameters p = camera_parameters(camera, edges.centre_m());
  std::mt19937_64 random(12);
  const auto seen =
      observed(p, edges.visible(Camera(camera), {.spacing_px = 10.0}), 0.3, 0.0, random);
  const ParameterCovariance c = parameter_covariance(p, seen, pose_and_focal_length(), {});
  EXPECT_EQ(c.outcome, AlignmentOutcome::rank_deficient);
  EXPECT_THAT(c.null_direction, HasSubstr("focal length"));
  EXPECT_THAT(c.null_direction, HasSubstr("translation z"));
  EXPECT_EQ(c.covariance.size(), 0);  // no uncertainty is claimed
}

TEST(ExcessU, IsWhatTheStatedUncertaintiesLack) {
  std::mt19937_64 random(13);
  std::normal_distribution<double> normal;
  std::vector<double> residuals, us;
  for (int i = 0; i < 20000; ++i) {
    us.push_back(i % 2 ? 0.1 : 0.4);
    residuals.push_back(std::hypot(us.back(), 0.3) * normal(random));
  }
  EXPECT_NEAR(excess_u_px(residuals, us, 20000.0), 0.3, 0.01);
  for (double& r : residuals) r *= 0.1;
  EXPECT_EQ(excess_u_px(residuals, us, 20000.0), 0.0);
}

TEST(CameraParameters, SurviveTheRoundTripThroughTheSceneFile) {
  CameraDescription camera = test_camera();
  camera.lens.distortion = {0.1, -0.2, 0.003, 0.004, 0.05, 0, 0, 0, 0, 0, 0, 0};
  camera.lens.principal_point_m = {1e-4, 2e-4};
  CameraParameters p = camera_parameters(camera, {0.1, 0.9, 1.2});
  p.pose[0] = 0.2;
  p.pose[1] = -0.1;
  p.pose[2] = 0.3;
  const Camera back(camera_description(p, camera));
  for (const Vec3& point : {Vec3(0, 0, 0), Vec3(1, 2, 2), Vec3(-1, 0.3, 1)}) {
    const auto a = projected(p, point);
    const auto b = back.project(point);
    ASSERT_TRUE(a);
    EXPECT_NEAR(a->x_px, b.position.x_px, 1e-9);
    EXPECT_NEAR(a->y_px, b.position.y_px, 1e-9);
    const auto rows = camera_from_world(p);
    const Vec3 in_camera = back.camera_from_world(point);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(
          rows[k][0] * point[0] + rows[k][1] * point[1] + rows[k][2] * point[2] + rows[k][3],
          in_camera[Eigen::Index(k)], 1e-12);
  }
}

// Every sample against a second opinion: is it in sight of the camera, by a ray of its own?
TEST(SceneEdges, OnlyEdgesInSightAreSampledAndContactsAre) {
  const Scene scene = test_box();
  const SceneEdges edges(scene);
  const CameraDescription camera = test_camera();
  const auto samples = edges.visible(Camera(camera), {.spacing_px = 10.0});
  std::vector<TriangleGroup> groups(1);
  for (const Surface& surface : scene.surfaces)
    for (const Triangle& t : fan(surface.pieces[0])) groups[0].triangles.push_back(t);
  const TriangleRays rays(groups);
  std::size_t contacts = 0, far_corner = 0;
  for (const EdgeSample& s : samples) {
    const Vec3 sight = s.point_m - camera.position_m;
    const auto hit = rays.first_hit(camera.position_m, sight.normalized(), 1);
    // A ray at the edge itself may just miss its surfaces; what it may not do is meet one before.
    if (hit) {
      EXPECT_GT(hit->distance_m, 0.98 * sight.norm()) << edges.border_name(s);
    }
    const std::string border = edges.border_name(s);
    contacts += border.starts_with("cube side") && border.ends_with("/floor");
    far_corner += border == "back/floor";
  }
  EXPECT_GT(contacts, 5u);
  EXPECT_GT(far_corner, 5u);
}

}  // namespace
}  // namespace truebox
