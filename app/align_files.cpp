// SPDX-License-Identifier: BSD-3-Clause
#include "align_files.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace truebox::app {
namespace {

using nlohmann::json;

json number(double v) { return std::isfinite(v) ? json(v) : json(nullptr); }

/// A round factor that makes residuals of this size some 8 px of the picture.
double magnification(double rms_px, double px_per_shown) {
  if (!(rms_px > 0.0)) return 1.0;
  const double wanted = 8.0 * px_per_shown / rms_px;
  double factor = 1.0;
  for (const double next : {2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0})
    if (next <= wanted) factor = next;
  return factor;
}

std::array<std::uint8_t, 3> colour_of(EdgeUse use) {
  switch (use) {
    case EdgeUse::used: return {90, 255, 120};
    case EdgeUse::held_out: return {90, 170, 255};
    case EdgeUse::outlier: return {255, 70, 70};
    case EdgeUse::unseen: break;
  }
  return {255, 210, 60};
}

Agreement agreement_of(AlignmentOutcome outcome) {
  return outcome == AlignmentOutcome::converged ? Agreement::agrees : Agreement::fails;
}

json border_json(const BorderStatistics& b) {
  return {{"border", b.border},
          {"held_out", b.held_out},
          {"predicted", b.predicted},
          {"matched", b.matched},
          {"mean_px", number(b.mean_px)},
          {"rms_px", number(b.rms_px)},
          {"cross_validated_rms_px", number(b.cross_validated_rms_px)}};
}

json match_json(const EdgeMatch& m) {
  json item{{"border", m.border},
            {"use", to_string(m.use)},
            {"predicted_px", {m.predicted.x_px, m.predicted.y_px}},
            {"normal", m.seen.normal}};
  if (m.use == EdgeUse::unseen) return item;
  item["seen_px"] = {m.seen.position.x_px, m.seen.position.y_px};
  item["residual_px"] = m.residual_px;
  item["u_px"] = m.seen.u_px;
  return item;
}

Table parameter_table(const BoxAlignment& found) {
  Table table{"Parameters, standard uncertainties k = 1",
              {{"parameter"}, {"estimate"}, {"known before, u", "", 2}, {"unit"}},
              {}};
  for (const EstimatedParameter& p : found.estimated)
    table.rows.push_back({p.name, Cell(p.value, p.standard_uncertainty),
                          std::isfinite(p.prior_u) ? Cell(p.prior_u) : Cell("nothing"), p.unit});
  return table;
}

Table border_table(const BoxAlignment& found) {
  Table table{"Predicted minus photographed, across the edge",
              {{"border"},
               {"use"},
               {"pieces seen"},
               {"mean", "px", 3, true},
               {"rms", "px", 3, true},
               {"rms if left out", "px", 3, true}},
              {}};
  for (const BorderStatistics& b : found.borders)
    table.rows.push_back(
        {b.border, b.held_out ? "held out" : "fitted",
         fmt::format("{} of {}", b.matched, b.predicted),
         b.matched > 0 ? Cell(b.mean_px) : Cell("-"), b.matched > 0 ? Cell(b.rms_px) : Cell("-"),
         std::isfinite(b.cross_validated_rms_px) ? Cell(b.cross_validated_rms_px) : Cell("-")});
  return table;
}

}  // namespace

std::string alignment_json(const BoxAlignment& found, const AlignmentSubject& subject,
                           const std::string& photograph, const PhotometricRefinement* light) {
  json out{{"outcome", to_string(found.outcome)},
           {"message", found.message},
           {"null_direction", found.null_direction},
           {"aligned_to", subject.kind()},
           {"file", subject.path},
           {"scene", subject.scene ? json(subject.scene->path) : json(nullptr)},
           {"photograph", photograph},
           {"pixels", found.camera.pixels},
           {"matched_share", found.matched_share},
           {"px_averaged_each_way", found.reduction}};
  const auto& p = found.parameters;
  const Vec3 position = found.camera.position_m;
  out["camera_from_world"] = {
      {"rows", camera_from_world(p)}, {"unit", "m"}, {"axes", "right, down, forward"}};
  out["position_m"] = {position[0], position[1], position[2]};
  out["intrinsics_px"] = {{"focal_x", p.intrinsics[0]},
                          {"focal_y", p.intrinsics[0] * p.aspect},
                          {"principal_point", {p.intrinsics[1], p.intrinsics[2]}},
                          {"pixel_centre", "(0.5, 0.5) is the centre of the top left pixel"}};
  for (std::size_t k = 0; k < p.distortion.size(); ++k)
    out["distortion"][parameter_names()[9 + k]] = p.distortion[k];
  out["stretch"] = p.stretch;
  out["stretch_about_m"] = {p.centre_m[0], p.centre_m[1], p.centre_m[2]};
  for (const EstimatedParameter& e : found.estimated)
    out["parameters"].push_back({{"name", e.name},
                                 {"unit", e.unit},
                                 {"value", e.value},
                                 {"u", e.standard_uncertainty},
                                 {"prior_u", number(e.prior_u)}});
  for (Eigen::Index i = 0; i < found.covariance.rows(); ++i) {
    json row = json::array();
    for (Eigen::Index k = 0; k < found.covariance.cols(); ++k)
      row.push_back(found.covariance(i, k));
    out["covariance"].push_back(row);
  }
  out["residuals"] = {{"rms_px", number(found.rms_px)},
                      {"held_out_rms_px", number(found.held_out_rms_px)},
                      {"cross_validated_rms_px", number(found.cross_validated_rms_px)},
                      {"scatter_beyond_noise_px", found.excess_u_px},
                      {"error_of_each_piece_px", found.errors.white_u_px},
                      {"error_along_edges_px", found.errors.wave_u_px},
                      {"error_along_edges_length_px", found.errors.wave_length_px},
                      {"blur_px", found.blur_px},
                      {"points_px", found.point_residuals_px}};
  out["borders"] = json::array();
  for (const BorderStatistics& b : found.borders) out["borders"].push_back(border_json(b));
  out["pieces"] = json::array();
  for (const EdgeMatch& m : found.matches) out["pieces"].push_back(match_json(m));
  if (light) out["light"] = light_json(*light);
  return out.dump(1) + "\n";
}

Picture alignment_overlay(const BoxAlignment& found, const Image& photograph, int most_px) {
  const double shown =
      std::max(1.0, std::ceil(std::max(photograph.width, photograph.height) / double(most_px)));
  const double factor = magnification(found.rms_px, shown);
  std::vector<OverlayLine> lines;
  for (const EdgeMatch& m : found.matches) {
    const double half = 5.0 * found.reduction;
    const auto& n = m.seen.normal;
    const auto colour = colour_of(m.use);
    const PixelPosition& at = m.predicted;
    lines.push_back({{at.x_px + half * n[1], at.y_px - half * n[0]},
                     {at.x_px - half * n[1], at.y_px + half * n[0]},
                     colour});
    if (m.use == EdgeUse::unseen) continue;
    lines.push_back(
        {at,
         {at.x_px - factor * m.residual_px * n[0], at.y_px - factor * m.residual_px * n[1]},
         colour});
  }
  return line_overlay(
      photograph, lines, most_px,
      fmt::format("Predicted edges; ticks point to where the photograph has them, {:g} times "
                  "magnified. Green: fitted, blue: held out, red: outlier, yellow: no edge found.",
                  factor));
}

Report alignment_report(const BoxAlignment& found, const AlignmentSubject& subject,
                        const Image& photograph, const std::string& photograph_path,
                        const PhotometricRefinement* light) {
  Report report;
  report.title = subject.kind() == "print" ? "Photograph registered to a picture"
                 : subject.edges_of_view   ? "Camera from the edges of a render"
                                           : "Camera from the edges of a box";
  report.subtitle = fmt::format("{} against {}", subject.path, photograph_path);
  const Agreement agreement = agreement_of(found.outcome);
  const bool good = agreement == Agreement::agrees;
  report.verdict = {
      agreement, good ? fmt::format("The predicted edges are found in the photograph: {:.0f} % of "
                                    "them, {:.3g} px rms.",
                                    100.0 * found.matched_share, found.rms_px)
                      : found.message};
  report.checks = {{"predicted edges found", agreement, found.matched_share, 0.6, "",
                    "share of the predicted pieces of edge that the photograph has there"}};
  report.key_numbers = {{"edges found", 100.0 * found.matched_share, "%"}};
  if (good) {
    report.key_numbers.push_back({"residual, edges fitted", found.rms_px, "px", 3, "rms"});
    report.key_numbers.push_back({"residual, each border left out", found.cross_validated_rms_px,
                                  "px", 3, "rms, cross-validated"});
    if (std::isfinite(found.held_out_rms_px))
      report.key_numbers.push_back({"residual, held out", found.held_out_rms_px, "px", 3, "rms"});
  }
  if (light) {
    report.checks.push_back(light_check(*light));
    if (good && report.checks.back().outcome == Agreement::warning)
      report.verdict = {Agreement::warning, report.verdict.sentence + " " + light->message + "."};
  }
  Section pictures{"Overlay", {}};
  pictures.blocks.push_back(
      PictureRow{{{"Predicted edges over the photograph", alignment_overlay(found, photograph),
                   "the photograph with the predicted edges drawn over it"}},
                 "",
                 {}});
  report.sections.push_back(std::move(pictures));
  if (good) {
    report.sections.push_back({"Edges", {border_table(found)}});
    report.sections.push_back(
        {"Parameters",
         {Paragraph{fmt::format("Errors of the edges beyond the pixels' own noise (shape of the "
                                "box, lens, shading), as "
                                "the residuals tell: {:.3g} px from piece to piece, {:.3g} px in "
                                "waves along an edge, "
                                "correlated over some {:.3g} px. Both are in the uncertainties.",
                                found.errors.white_u_px, found.errors.wave_u_px,
                                found.errors.wave_length_px)},
          parameter_table(found)}});
  }
  if (good && subject.kind() == "print")
    report.sections.back().blocks.push_back(
        Paragraph{"The render says nothing of where its pixels lie: it is taken for a print 1 m in "
                  "front of the camera. Pose and focal length stand for the registration of the "
                  "whole picture; they are no camera of the scene."});
  if (light) report.sections.push_back(light_section(*light));
  report.provenance = {{subject.kind(), subject.path}, {"photograph", photograph_path}};
  if (subject.view && subject.scene) report.provenance.push_back({"scene", subject.scene->path});
  return report;
}

}  // namespace truebox::app
