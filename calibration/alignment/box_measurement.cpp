// SPDX-License-Identifier: BSD-3-Clause
#include <fnmatch.h>

#include <map>

#include "alignment/box_aligner.h"
#include "alignment/edge_localisation.h"

namespace truebox {
namespace {

constexpr double kSpacing = 12.0;  // px of the planes along an edge: a window each

}  // namespace

bool is_listed(const std::vector<std::string>& patterns, const std::string& border) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), border.c_str(), 0) == 0;
  });
}

double median_of(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double rms_of(const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0.0;
  for (double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

Observations observations_of(const std::vector<EdgeMatch>& matches,
                             const std::vector<PointObservation>& points, double excess_px) {
  Observations observations{{}, points};
  for (const EdgeMatch& m : matches) {
    if (m.use != EdgeUse::used) continue;
    observations.edges.push_back(m.seen);
    observations.edges.back().noise_u_px = m.seen.u_px;
    observations.edges.back().u_px = std::hypot(m.seen.u_px, excess_px);
  }
  return observations;
}

double reject_outliers(const CameraParameters& p, std::vector<EdgeMatch>& matches,
                       double degrees_taken) {
  std::vector<double> sizes;
  for (EdgeMatch& m : matches) {
    if (m.use == EdgeUse::unseen) continue;
    m.residual_px = edge_residuals_px(p, {m.seen})[0];
    if (const auto px = projected(p, m.seen.point_m)) m.predicted = *px;
    if (m.use != EdgeUse::held_out) sizes.push_back(std::abs(m.residual_px));
  }
  double excess = 1.4826 * median_of(sizes);  // a robust start: the normal distribution's quartile
  if (sizes.empty()) return 0.0;
  for (int round = 0; round < 8; ++round) {
    std::vector<double> residuals, us;
    for (EdgeMatch& m : matches) {
      if (m.use == EdgeUse::unseen || m.use == EdgeUse::held_out) continue;
      const bool in = std::abs(m.residual_px) <= 4.0 * std::hypot(m.seen.u_px, excess);
      m.use = in ? EdgeUse::used : EdgeUse::outlier;
      if (!in) continue;
      residuals.push_back(m.residual_px);
      us.push_back(m.seen.u_px);
    }
    excess = excess_u_px(residuals, us, static_cast<double>(residuals.size()) - degrees_taken);
  }
  return excess;
}

std::vector<EdgeMatch> BoxAligner::measure(const CameraParameters& p, const EdgeField& finest,
                                           double radius) {
  const double unit = unit_px();
  const auto predicted = samples(p, {.spacing_px = kSpacing * unit,
                                     .probe_px = 1.5 * unit,
                                     .margin_px = -half_width_ * unit,
                                     .clearance_px = (half_width_ + 1.0) * unit});
  std::vector<EdgeMatch> matches;
  std::vector<double> blurs;
  for (const EdgeSample& s : predicted) {
    EdgeMatch match;
    match.border = edges_->border_name(s);
    match.predicted = s.position;
    match.seen = {s.edge, s.point_m, s.position, s.normal, 1.0};
    double shift = 0.0;
    if (radius > 0.0)
      if (const auto near = finest.nearest(s.position, s.normal);
          near && near->distance_px <= radius * unit)
        shift = near->offset_px;
    const PixelPosition centre = {(s.position.x_px + shift * s.normal[0]) / unit,
                                  (s.position.y_px + shift * s.normal[1]) / unit};
    const auto found =
        localised_edge(planes_, {centre, s.normal, s.half_length_px / unit, half_width_});
    if (found) {
      const double offset = shift + found->offset_px * unit;
      match.use = is_listed(options_.hold_out, match.border) ? EdgeUse::held_out : EdgeUse::used;
      match.seen.position = {s.position.x_px + offset * s.normal[0],
                             s.position.y_px + offset * s.normal[1]};
      match.seen.u_px = std::max(found->u_px, 1e-3) * unit;
      blurs.push_back(found->blur_px);
    }
    matches.push_back(match);
  }
  if (!blurs.empty()) blur_ = median_of(blurs);
  return matches;
}

bool BoxAligner::refine_to_pixels(CameraParameters& p, BoxAlignment& result) {
  constexpr int kRounds = 4;
  const EdgeField finest = field(std::max(planes_.width, planes_.height));
  const auto degrees = static_cast<double>(full_.indices().size());
  bool converged = false;
  double spread = 2.0;  // of residuals, px of the planes
  for (int round = 0; round < kRounds; ++round) {
    // Later windows lie on the prediction itself, so that no edge beside it is preferred.
    const double radius = round < 2 ? 6.0 - 2.0 * round : 3.0 * spread > 2.0 ? 3.0 * spread : 0.0;
    result.matches = measure(p, finest, std::min(radius, 6.0));
    half_width_ = std::clamp(3.0 + 4.0 * blur_, 5.0, 12.0);
    double excess = reject_outliers(p, result.matches, degrees);
    if (observations_of(result.matches, options_.points, 0.0).edges.size() < 8) return false;
    // Two solutions a round: the second with the outliers and the weights of the first.
    for (int again = 0; again < 2; ++again) {
      const bool last = round + 1 == kRounds;
      const Refinement r = refine(p, observations_of(result.matches, options_.points, excess),
                                  {full_, last ? 0.0 : 3.0, 50});
      p = r.parameters;
      converged = r.converged;
      excess = reject_outliers(p, result.matches, degrees);
    }
    std::vector<double> sizes;
    for (const EdgeMatch& m : result.matches)
      if (m.use == EdgeUse::used) sizes.push_back(std::abs(m.residual_px) / unit_px());
    spread = sizes.empty() ? 2.0 : 1.4826 * median_of(sizes);
    result.excess_u_px = excess;
  }
  result.blur_px = blur_ * unit_px();
  return converged;
}

void BoxAligner::state_uncertainty(BoxAlignment& result) const {
  const Observations seen = observations_of(result.matches, options_.points, result.excess_u_px);
  const ParameterCovariance c = parameter_covariance(result.parameters, seen, full_);
  result.outcome = c.outcome;
  result.null_direction = c.null_direction;
  if (c.outcome != AlignmentOutcome::converged) {
    result.message = "the edges do not determine " + c.null_direction;
    return;
  }
  result.covariance = c.covariance;
  result.errors = c.errors;
  const auto values = values_of(result.parameters);
  Eigen::Index k = 0;
  for (const std::size_t i : full_.indices()) {
    result.estimated.push_back({parameter_names()[i], parameter_units()[i], values[i],
                                std::sqrt(c.covariance(k, k)), full_.prior_u[i]});
    ++k;
  }
}

void BoxAligner::fill_statistics(BoxAlignment& result) const {
  std::map<std::string, std::vector<const EdgeMatch*>> by_border;
  for (const EdgeMatch& m : result.matches) by_border[m.border].push_back(&m);
  std::vector<double> used, held_out, all_crossed;
  const auto residuals_of = [](const std::vector<const EdgeMatch*>& matches, EdgeUse use) {
    std::vector<double> residuals;
    for (const EdgeMatch* m : matches)
      if (m->use == use) residuals.push_back(m->residual_px);
    return residuals;
  };
  for (const auto& [border, matches] : by_border) {
    BorderStatistics s;
    s.border = border;
    s.held_out = is_listed(options_.hold_out, border);
    s.predicted = matches.size();
    const auto r = residuals_of(matches, s.held_out ? EdgeUse::held_out : EdgeUse::used);
    s.matched = r.size();
    for (double v : r) s.mean_px += v / static_cast<double>(r.size());
    s.rms_px = rms_of(r);
    auto& list = s.held_out ? held_out : used;
    list.insert(list.end(), r.begin(), r.end());
    s.cross_validated_rms_px = std::numeric_limits<double>::quiet_NaN();
    if (!s.held_out && !r.empty()) {
      std::vector<EdgeMatch> others, own;
      for (const EdgeMatch& m : result.matches)
        if (m.use == EdgeUse::used) (m.border == border ? own : others).push_back(m);
      if (others.size() >= 8) {
        const CameraParameters without =
            refine(result.parameters, observations_of(others, options_.points, result.excess_u_px),
                   {full_, 0.0, 50})
                .parameters;
        std::vector<EdgeObservation> left_out;
        for (const EdgeMatch& m : own) left_out.push_back(m.seen);
        const auto crossed = edge_residuals_px(without, left_out);
        s.cross_validated_rms_px = rms_of(crossed);
        all_crossed.insert(all_crossed.end(), crossed.begin(), crossed.end());
      }
    }
    result.borders.push_back(s);
  }
  result.rms_px = rms_of(used);
  result.held_out_rms_px = rms_of(held_out);
  result.cross_validated_rms_px = rms_of(all_crossed);
  for (const PointObservation& point : options_.points) {
    const auto px = projected(result.parameters, point.point_m);
    result.point_residuals_px.push_back(
        px ? std::hypot(px->x_px - point.position.x_px, px->y_px - point.position.y_px)
           : std::numeric_limits<double>::quiet_NaN());
  }
}

}  // namespace truebox
