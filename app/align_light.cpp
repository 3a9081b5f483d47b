// SPDX-License-Identifier: BSD-3-Clause
#include "align_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "prediction_options.h"
#include "sensor/aovs.h"
#include "sensor/render.h"

namespace truebox::app {
namespace {

using nlohmann::json;

constexpr int kMostRendered = 512;  // px a side: radiances between edges are smooth

std::optional<RenderedView> predicted_view(const LightArguments& a, const std::string& scene_path,
                                           CameraDescription camera) {
  const int most = std::max(camera.pixels[0], camera.pixels[1]);
  for (int& side : camera.pixels)
    if (most > kMostRendered)
      side = static_cast<int>(std::lround(double(side) * kMostRendered / most));
  PredictionArguments prediction;
  prediction.scene = scene_path;
  prediction.elements = a.elements;
  const auto predicted = predict(prediction);
  if (predicted->prediction->outcome() != SolveOutcome::converged) return std::nullopt;
  Image picture = render(*predicted->prediction, Camera(camera), {}).radiance;
  add_display_channels(picture, predicted->scene.bands,
                       read_observer(std::filesystem::path(reference_directory()) / "colour" /
                                         "cie1931_2deg_xyz.csv",
                                     "CIE 1931 2 deg"));
  return RenderedView(std::move(picture), camera, geometry_aovs(predicted->scene, Camera(camera)));
}

Picture channel_picture(const Image& image, std::size_t channel, ValueRange range) {
  return false_colour(image.width, image.height, image.channels[channel].samples, range, "light",
                      "of the photograph's white");
}

PictureRow compared_row(const PhotometricRefinement& light) {
  const Image& image = light.compared;
  std::vector<float> difference(image.pixel_count());
  for (std::size_t i = 0; i < difference.size(); ++i)
    difference[i] = image.channels[1].samples[i] - image.channels[0].samples[i];
  const ValueRange range = value_range(image.channels[0].samples, 0.005);
  const std::string band = light.bands.front().band;
  return {
      {{"Photograph", channel_picture(image, 0, range), "the photograph's light between the edges"},
       {"Prediction", channel_picture(image, 1, range),
        "the prediction there, gain and offset applied"},
       {"Predicted minus photographed",
        signed_false_colour(image.width, image.height, difference,
                            symmetric_limit(difference, 0.99), "difference",
                            "of the photograph's white"),
        "the signed difference"}},
      fmt::format("Band {}: what was compared, one of {} px each way. Left out: what lies "
                  "close to edges, masked or saturated pixels.",
                  band, light.picture_step_px),
      {}};
}

}  // namespace

PhotometricRefinement refine_by_light(const LightArguments& a, const AlignmentSubject& subject,
                                      const BoxAlignment& edges, const Image& photograph,
                                      const Progress& progress) {
  PhotometricOptions options;
  options.gain_per_surface = a.gains == "surface";
  options.progress = progress;
  Image mask;
  if (!a.mask.empty()) {
    mask = read_image(a.mask);
    options.mask = &mask;
  }
  if (subject.view) return refine_by_radiance(edges, *subject.view, photograph, options);
  std::optional<RenderedView> view;
  if (edges.outcome == AlignmentOutcome::converged)
    view = predicted_view(a, subject.scene->path, edges.camera);
  if (view) return refine_by_radiance(edges, *view, photograph, options);
  PhotometricRefinement refused;
  refused.outcome = edges.outcome == AlignmentOutcome::converged ? AlignmentOutcome::not_converged
                                                                 : edges.outcome;
  refused.message = "the prediction did not converge";
  if (edges.outcome != AlignmentOutcome::converged) refused.message = edges.message;
  refused.camera = edges.camera;
  refused.parameters = edges.parameters;
  return refused;
}

json light_json(const PhotometricRefinement& light) {
  json out{{"outcome", to_string(light.outcome)},
           {"message", light.message},
           {"pixels", light.samples},
           {"squares", light.blocks},
           {"square_px", light.block_px},
           {"dispersion", light.dispersion},
           {"moved_px", light.moved_px},
           {"u_of_positions_by_edges_px", light.edge_u_px},
           {"u_of_positions_with_light_px", light.refined_u_px},
           {"chi_squared_of_move", light.contradiction},
           {"p_value_of_move", light.p_value},
           {"edge_rms_before_px", light.edge_rms_before_px},
           {"edge_rms_after_px", light.edge_rms_after_px},
           {"camera_from_world", camera_from_world(light.parameters)},
           {"parameters", json::array()},
           {"covariance", json::array()},
           {"bands", json::array()}};
  for (const EstimatedParameter& p : light.estimated)
    out["parameters"].push_back({{"name", p.name},
                                 {"unit", p.unit},
                                 {"value", p.value},
                                 {"u", p.standard_uncertainty},
                                 {"u_by_edges", p.prior_u}});
  for (Eigen::Index i = 0; i < light.covariance.rows(); ++i) {
    json row = json::array();
    for (Eigen::Index k = 0; k < light.covariance.cols(); ++k)
      row.push_back(light.covariance(i, k));
    out["covariance"].push_back(row);
  }
  for (const BandGain& b : light.bands)
    out["bands"].push_back({{"band", b.band},
                            {"surface", b.surface},
                            {"gain", b.gain},
                            {"gain_u", b.gain_u},
                            {"offset", b.offset},
                            {"offset_u", b.offset_u},
                            {"residual", b.rms}});
  return out;
}

Section light_section(const PhotometricRefinement& light) {
  Section section{"Light between the edges", {}};
  if (!light.message.empty()) section.blocks.push_back(Paragraph{light.message + "."});
  if (light.bands.empty()) return section;
  section.blocks.push_back(Paragraph{fmt::format(
      "{} pixels in {} squares of {} px, each of which counts as one witness: residuals that go "
      "along in whole areas make the squares scatter {:.3g} times as much as independent pixels "
      "would. The camera moved by {:.2g} px in the picture (rms); its positions there are known to "
      "{:.2g} px by the edges and to {:.2g} px with the light. Edges are met within {:.3g} px rms, "
      "before {:.3g} px.",
      light.samples, light.blocks, light.block_px, light.dispersion, light.moved_px,
      light.edge_u_px, light.refined_u_px, light.edge_rms_after_px, light.edge_rms_before_px)});
  section.blocks.push_back(compared_row(light));
  Table parameters{"Parameters, standard uncertainties k = 1",
                   {{"parameter"}, {"with light"}, {"u by edges", "", 2}, {"unit"}},
                   {}};
  for (const EstimatedParameter& p : light.estimated)
    parameters.rows.push_back(
        {p.name, Cell(p.value, p.standard_uncertainty), Cell(p.prior_u), p.unit});
  Table bands{"Photograph = gain x prediction + offset, both scaled to their white",
              {{"band"}, {"surface"}, {"gain"}, {"offset"}, {"residual", "%", 3}},
              {}};
  for (const BandGain& b : light.bands)
    bands.rows.push_back({b.band, b.surface.empty() ? "all" : b.surface, Cell(b.gain, b.gain_u),
                          Cell(b.offset, b.offset_u), Cell(100.0 * b.rms)});
  section.blocks.push_back(parameters);
  section.blocks.push_back(bands);
  return section;
}

Check light_check(const PhotometricRefinement& light) {
  const bool good = light.outcome == AlignmentOutcome::converged;
  return {"light agrees with the edges",
          good ? Agreement::agrees : Agreement::warning,
          light.p_value,
          0.001,
          "",
          good ? "probability of a move at least as large, were both right" : light.message};
}

void print_light(const PhotometricRefinement& light) {
  fmt::print("\nlight between the edges: {}{}\n", to_string(light.outcome),
             light.message.empty() ? "" : ": " + light.message);
  if (light.bands.empty()) return;
  fmt::print(
      "  {} pixels, {} squares of {} px, dispersion {:.3g}; moved {:.3g} px; positions known to "
      "{:.2g} px, by edges alone {:.2g} px; edges met within {:.3g} px rms, before {:.3g} px\n",
      light.samples, light.blocks, light.block_px, light.dispersion, light.moved_px,
      light.refined_u_px, light.edge_u_px, light.edge_rms_after_px, light.edge_rms_before_px);
  if (light.outcome != AlignmentOutcome::converged) return;
  for (const EstimatedParameter& p : light.estimated)
    fmt::print("  {:<18} {:>13.6g} +- {:<10.2g} {}\n", p.name, p.value, p.standard_uncertainty,
               p.unit == "1" ? "" : p.unit);
}

}  // namespace truebox::app
