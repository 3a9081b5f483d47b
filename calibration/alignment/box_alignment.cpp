// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/box_alignment.h"

#include <map>
#include <set>

#include "alignment/box_aligner.h"
#include "alignment/pose_search.h"
#include "alignment/rendered_view.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

// Where parameters stand in the list of all.
constexpr std::size_t kFocal = 6, kPrincipal = 7, kK1 = 9, kStretch = 21;

void require_same_shape(const CameraDescription& camera, const Image& photograph) {
  const double film = double(camera.pixels[0]) / camera.pixels[1];
  const double picture = double(photograph.width) / photograph.height;
  if (std::abs(film / picture - 1.0) > 0.01)
    throw MismatchError("the camera has " + std::to_string(camera.pixels[0]) + " x " +
                        std::to_string(camera.pixels[1]) + " pixels, the photograph " +
                        std::to_string(photograph.width) + " x " +
                        std::to_string(photograph.height) + ": another shape");
}

/// What is free at the end, and what is known of it before; about the guess.
ParameterFreedom full_freedom(const CameraParameters& guess, const AlignmentOptions& options,
                              int width_px) {
  ParameterFreedom f;
  for (std::size_t k = 0; k < 6; ++k) f.free[k] = true;
  const auto known = [&](std::size_t i, double value, double u) {
    if (!(u > 0.0)) return;
    f.free[i] = true;
    f.prior_value[i] = value;
    f.prior_u[i] = u;
  };
  known(kFocal, guess.intrinsics[0], options.focal_u * guess.intrinsics[0]);
  for (std::size_t k = 0; k < 2; ++k)
    known(kPrincipal + k, guess.intrinsics[1 + k], options.principal_point_u * width_px);
  // Wide enough for any lens that is no fish-eye: 10 % at r = 0.6.
  const bool radial = options.lens != LensFreedom::fixed, full = options.lens == LensFreedom::full;
  known(kK1, guess.distortion[0], radial ? 0.3 : 0.0);
  known(kK1 + 1, guess.distortion[1], radial ? 0.3 : 0.0);
  known(kK1 + 2, guess.distortion[2], full ? 0.005 : 0.0);
  known(kK1 + 3, guess.distortion[3], full ? 0.005 : 0.0);
  known(kK1 + 4, guess.distortion[4], full ? 0.3 : 0.0);
  for (std::size_t k = 0; k < 3; ++k) known(kStretch + k, 1.0, options.stretch_u);
  return f;
}

/// Pose and focal length alone.
ParameterFreedom coarse_freedom(const ParameterFreedom& full) {
  ParameterFreedom f = full;
  for (std::size_t i = kFocal + 1; i < kCameraParameters; ++i) {
    f.free[i] = false;
    f.prior_u[i] = std::numeric_limits<double>::infinity();
  }
  return f;
}

double share_within(const std::vector<EdgeMatch>& matches, double limit_px) {
  double within = 0.0;
  for (const EdgeMatch& m : matches)
    within += m.use != EdgeUse::unseen && std::abs(m.residual_px) <= limit_px;
  return matches.empty() ? 0.0 : within / static_cast<double>(matches.size());
}

/// How a camera contradicts the guess: three times further off than a guess may be. Pictures full
/// of lines have some that fit, seen from elsewhere.
std::string contradiction(const CameraParameters& guess, const CameraParameters& found) {
  constexpr double kRadians = 0.52, kRelative = 0.35;  // 30 degrees; 10 % three times, and a little
  const auto percent = [](double ratio) {
    return std::to_string(static_cast<int>(std::lround(100.0 * (ratio - 1.0)))) + " %";
  };
  const auto distance = [](const CameraParameters& p) {
    return std::hypot(p.pose[3], p.pose[4], p.pose[5]);
  };
  const double nearer = distance(found) / distance(guess);
  const double longer = found.intrinsics[0] / guess.intrinsics[0];
  const double angle = std::hypot(found.pose[0], found.pose[1], found.pose[2]);
  if (std::abs(nearer - 1.0) > kRelative) return "is off in distance by " + percent(nearer);
  if (std::abs(longer - 1.0) > kRelative) return "is off in focal length by " + percent(longer);
  if (angle > kRadians) return "is turned by over 30 degrees";
  return {};
}

}  // namespace

std::string to_string(EdgeUse use) {
  switch (use) {
    case EdgeUse::used: return "used";
    case EdgeUse::held_out: return "held out";
    case EdgeUse::outlier: return "outlier";
    case EdgeUse::unseen: return "unseen";
  }
  return "unknown";
}

BoxAligner::BoxAligner(std::unique_ptr<EdgeSource> edges, const CameraDescription& guess,
                       const Image& photograph, const AlignmentOptions& options)
    : edges_(std::move(edges)), like_(guess), options_(options) {
  planes_ = edge_planes(photograph, options.most_px);
  guess_ = camera_parameters(like_, edges_->centre_m());
  full_ = full_freedom(guess_, options_, photograph.width);
}

EdgeField BoxAligner::field(int most_px) const {
  const int n = std::max(1, (std::max(planes_.width, planes_.height) + most_px - 1) / most_px);
  std::vector<std::vector<float>> small;
  for (const auto& plane : planes_.guide)
    small.push_back(reduced(plane, planes_.width, planes_.height, n));
  return EdgeField(planes_.width / n, planes_.height / n, small, n * unit_px());
}

std::vector<EdgeSample> BoxAligner::samples(const CameraParameters& p,
                                            EdgeSampling sampling) const {
  std::vector<EdgeSample> found = edges_->visible(p, sampling);
  std::erase_if(found, [&](const EdgeSample& sample) {
    return is_listed(options_.ignore, edges_->border_name(sample));
  });
  return found;
}

CameraParameters BoxAligner::closest(CameraParameters p, const EdgeField& edge_field, double radius,
                                     int rounds, const ParameterFreedom& freedom) const {
  const double scale = edge_field.scale();
  for (int round = 0; round < rounds; ++round) {
    const auto predicted =
        samples(p, {.spacing_px = 6.0 * scale, .probe_px = 1.0 * scale, .margin_px = 0.0});
    // From the full radius down to a third of it.
    const double reach = radius * scale * (1.0 - 0.67 * round / std::max(1, rounds - 1));
    Observations observations{{}, options_.points};
    for (const EdgeSample& s : predicted) {
      if (is_listed(options_.hold_out, edges_->border_name(s))) continue;
      const auto found = edge_field.nearest(s.position, s.normal);
      if (!found || found->distance_px > reach) continue;
      observations.edges.push_back({s.edge,
                                    s.point_m,
                                    {s.position.x_px + found->offset_px * s.normal[0],
                                     s.position.y_px + found->offset_px * s.normal[1]},
                                    s.normal,
                                    scale});
    }
    if (observations.edges.size() + 2 * observations.points.size() < 8) return p;
    p = refine(p, observations, {freedom, 1.5, 15}).parameters;
  }
  return p;
}

CameraParameters BoxAligner::coarse(const std::vector<EdgeSample>& from_guess) const {
  const ParameterFreedom pose = coarse_freedom(full_);
  const EdgeField first = field(160), second = field(320);
  std::vector<CameraParameters> candidates = {guess_};
  const auto found = pose_candidates(guess_, from_guess, first, {}, 24);
  candidates.insert(candidates.end(), found.begin(), found.end());
  const auto score = [&](const CameraParameters& p, const EdgeField& at) {
    const auto seen = samples(p, {.spacing_px = 4.0 * at.scale(), .probe_px = at.scale()});
    return seen.size() < 8 ? 1.0 : edge_distance_score(p, seen, at, 3.0 * at.scale());
  };
  const auto keep_best = [&](const EdgeField& at, std::size_t count) {
    std::multimap<double, CameraParameters> ranked;
    for (const CameraParameters& p : candidates) ranked.emplace(score(p, at), p);
    candidates.clear();
    for (const auto& [value, p] : ranked)
      if (candidates.size() < count) candidates.push_back(p);
  };
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    tell("search", 0.5 * static_cast<double>(i) / static_cast<double>(candidates.size()));
    candidates[i] = closest(candidates[i], first, 12.0, 8, pose);
  }
  keep_best(first, 5);
  for (CameraParameters& p : candidates) p = closest(p, second, 8.0, 6, pose);
  keep_best(second, 1);
  return candidates.front();
}

BoxAlignment BoxAligner::run() {
  BoxAlignment result;
  result.reduction = planes_.reduction;
  const double width = planes_.width * unit_px();
  const auto from_guess = samples(
      guess_, {.spacing_px = width / 80.0, .probe_px = width / 160.0, .margin_px = 0.4 * width});
  result.camera = like_;
  result.parameters = guess_;
  if (from_guess.size() < 8 && options_.points.size() < 4) {
    result.outcome = AlignmentOutcome::invalid_problem;
    result.message =
        "the guess sees no edges of the " + edges_->what() + ", not even near the film";
    return result;
  }
  const bool searched = options_.search && options_.points.size() < 4;
  CameraParameters p = searched ? coarse(from_guess) : guess_;
  // A guess with picked points is first brought to them.
  if (!searched && options_.points.size() >= 4)
    p = refine(p, {{}, options_.points}, {coarse_freedom(full_), 3.0, 50}).parameters;
  tell("refinement", 0.6);
  for (const int size : {640, 1280})
    if (std::max(planes_.width, planes_.height) > size / 2)
      p = closest(p, field(size), 6.0, 5, full_);
  tell("edges", 0.8);
  const bool solved = refine_to_pixels(p, result);
  result.parameters = p;
  result.camera = camera_description(p, like_);
  if (!judge(result)) return result;
  if (!solved) {
    result.outcome = AlignmentOutcome::not_converged;
    result.message = "the refinement did not converge";
    return result;
  }
  state_uncertainty(result);
  if (result.outcome == AlignmentOutcome::converged) fill_statistics(result);
  return result;
}

bool BoxAligner::judge(BoxAlignment& result) const {
  // A prediction that is right has its edge within a pixel or so, or, in a real box whose boards
  // are not quite flat, within some thousandths of the picture. One that is wrong finds some edge
  // in every textured picture, but anywhere in the window: of 4 px each way, a quarter by chance,
  // and half of the pieces once the camera has been fitted to them.
  constexpr double kLeastShare = 0.6;
  constexpr std::size_t kLeastEdges = 3;
  const double limit = std::max(1.0, 0.0015 * planes_.width) * unit_px();
  std::map<std::size_t, std::vector<EdgeMatch>> by_edge;
  std::vector<EdgeMatch> judged;
  for (const EdgeMatch& m : result.matches) {
    if (is_listed(options_.hold_out, m.border)) continue;
    by_edge[m.seen.edge].push_back(m);
    judged.push_back(m);
  }
  result.matched_share = share_within(judged, limit);
  std::size_t found = 0;
  for (const auto& [edge, matches] : by_edge) found += share_within(matches, limit) >= 0.5;
  const std::size_t needed = std::max(kLeastEdges, (2 * by_edge.size() + 2) / 3);
  if (options_.points.size() >= 4) return true;  // a person says that it is this box
  result.outcome = AlignmentOutcome::no_such_box;
  if (const std::string far = contradiction(guess_, result.parameters); !far.empty()) {
    result.message = "the photograph does not show this " + edges_->what() +
                     " near the guess: the best camera " + far;
    return false;
  }
  if (result.matched_share >= kLeastShare && found >= needed) return true;
  result.message =
      "the photograph does not show this " + edges_->what() + ": " + std::to_string(judged.size()) +
      " pieces of edge were predicted at the best position, " +
      std::to_string(static_cast<int>(100.0 * result.matched_share)) + " % of them are there (" +
      std::to_string(found) + " of " + std::to_string(by_edge.size()) + " edges); 60 % and " +
      std::to_string(needed) + " edges are needed";
  return false;
}

BoxAlignment align_box(const Scene& scene, const CameraDescription& guess, const Image& photograph,
                       const AlignmentOptions& options) {
  require_same_shape(guess, photograph);
  CameraDescription like = guess;
  like.pixels = {photograph.width, photograph.height};
  return BoxAligner(edges_of_scene(scene, like), like, photograph, options).run();
}

BoxAlignment align_picture(const RenderedView& view, const Image& photograph,
                           const AlignmentOptions& options) {
  if (!view.is_print()) require_same_shape(view.camera(), photograph);
  const CameraDescription like = view.camera_for(photograph.width, photograph.height);
  return BoxAligner(edges_of_picture(view, like), like, photograph, options).run();
}

}  // namespace truebox
