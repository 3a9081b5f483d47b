// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/pose_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

constexpr std::array<int, 6> kSteps = {9, 9, 3, 3, 7, 7};  // of each coordinate below

using Grid = std::array<int, 6>;

struct Candidate {
  Grid at{};
  double score = 1.0;
};

// From -1 to 1.
double fraction(const Grid& at, std::size_t k) { return 2.0 * at[k] / (kSteps[k] - 1.0) - 1.0; }

CameraParameters placed(const CameraParameters& guess, const Grid& at, const SearchReach& reach) {
  CameraParameters p = guess;
  const double aim_x = reach.rotation_rad * fraction(at, 0);
  const double aim_y = reach.rotation_rad * fraction(at, 1);
  // Turning the camera moves the box in the picture and turns its view alike; the box's own turn
  // is what is left, half as far each way.
  const double turn_x = aim_x + 0.5 * reach.rotation_rad * fraction(at, 2);
  const double turn_y = aim_y + 0.5 * reach.rotation_rad * fraction(at, 3);
  const double roll = reach.rotation_rad * fraction(at, 4);
  const double size = 1.0 + reach.scale * fraction(at, 5);
  const Eigen::Vector3d t(guess.pose[3], guess.pose[4], guess.pose[5]);
  const Eigen::Vector3d aim(aim_x, aim_y, 0.0);
  const double angle = aim.norm();
  const Eigen::Vector3d moved =
      angle > 0.0 ? Eigen::Vector3d(Eigen::AngleAxisd(angle, aim / angle) * t) : t;
  p.pose = {turn_x, turn_y, roll, moved[0] * size, moved[1] * size, moved[2] * size};
  return p;
}

bool close(const Grid& a, const Grid& b) {
  for (std::size_t k = 0; k < a.size(); ++k)
    if (std::abs(a[k] - b[k]) > 1) return false;
  return true;
}

bool advance(Grid& at) {
  for (std::size_t k = 0; k < at.size(); ++k) {
    if (++at[k] < kSteps[k]) return true;
    at[k] = 0;
  }
  return false;
}

}  // namespace

double edge_distance_score(const CameraParameters& parameters,
                           const std::vector<EdgeSample>& samples, const EdgeField& field,
                           double cap_px) {
  if (samples.empty()) return 1.0;
  // Edges turn with the camera; a sample's own normal is turned by what its neighbour does.
  const double roll = parameters.pose[2];
  const double c = std::cos(roll), s = std::sin(roll);
  double sum = 0.0;
  for (const EdgeSample& sample : samples) {
    const auto px = projected(parameters, sample.point_m);
    const auto found = px ? field.nearest(*px, {c * sample.normal[0] - s * sample.normal[1],
                                                s * sample.normal[0] + c * sample.normal[1]})
                          : std::nullopt;
    sum += found ? std::min(found->distance_px / cap_px, 1.0) : 1.0;
  }
  return sum / static_cast<double>(samples.size());
}

std::vector<CameraParameters> pose_candidates(const CameraParameters& guess,
                                              const std::vector<EdgeSample>& samples,
                                              const EdgeField& field, const SearchReach& reach,
                                              std::size_t count) {
  const double cap_px = 10.0 * field.scale();
  std::vector<Candidate> all;
  Grid at{};
  do all.push_back({at, edge_distance_score(placed(guess, at, reach), samples, field, cap_px)});
  while (advance(at));
  std::sort(all.begin(), all.end(),
            [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  std::vector<Candidate> best;
  for (const Candidate& candidate : all) {
    if (best.size() == count) break;
    const bool taken = std::any_of(best.begin(), best.end(), [&](const Candidate& other) {
      return close(candidate.at, other.at);
    });
    if (!taken) best.push_back(candidate);
  }
  std::vector<CameraParameters> candidates;
  for (const Candidate& candidate : best) candidates.push_back(placed(guess, candidate.at, reach));
  return candidates;
}

}  // namespace truebox
