// SPDX-License-Identifier: BSD-3-Clause
#include "plan_colour.h"

#include <algorithm>
#include <filesystem>

#include "commands.h"
#include "difference/ciede2000.h"
#include "radiometry/lamp_weighting.h"
#include "radiometry/processor_time.h"
#include "scene/lamp_spectrum.h"
#include "scene/scene_file.h"

namespace truebox::app {
namespace {

constexpr std::size_t kElements = 600;
constexpr std::size_t kCounts[] = {4, 6, 8, 12, 16, 24, 36, 48};

struct Colours {
  std::vector<Tristimulus> of_element;
  double processor_s = 0.0;
};

Tristimulus weighted(const Eigen::RowVectorXd& stimulus, const std::vector<Tristimulus>& weights) {
  Tristimulus sum;
  for (std::size_t b = 0; b < weights.size(); ++b) {
    const double value = stimulus[static_cast<Eigen::Index>(b)];
    sum.X += value * weights[b].X;
    sum.Y += value * weights[b].Y;
    sum.Z += value * weights[b].Z;
  }
  return sum;
}

PredictOptions small_solve(const Scene& scene) {
  PredictOptions options;
  std::size_t pieces = 0;
  for (const Surface& surface : scene.surfaces) pieces += surface.pieces.size();
  options.elements = std::max(kElements, 16 * pieces);
  options.form_factors.method = FormFactorMethod::exact_visibility;
  return options;
}

// Reflected light of every usable element, seen in the scene's bands.
Colours colours_of(const Scene& scene, const Observer& observer) {
  Colours colours;
  const double start = process_cpu_s();
  const Prediction prediction(scene, small_solve(scene));
  colours.processor_s = process_cpu_s() - start;
  const auto weights = display_weights(scene, observer);
  const PatchMesh& mesh = prediction.fine().mesh;
  const BandMatrix irradiance = prediction.irradiance();
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const auto& rho =
        scene.material_of(scene.surfaces[mesh.surface_of(mesh.patches[i])]).reflectance;
    const Eigen::RowVectorXd reflected =
        irradiance.row(static_cast<Eigen::Index>(i))
            .cwiseProduct(Eigen::Map<const Eigen::RowVectorXd>(
                rho.values.data(), static_cast<Eigen::Index>(rho.values.size())));
    colours.of_element.push_back(weighted(reflected, weights));
  }
  return colours;
}

// The lamps' light, as bright as the brightest element.
Tristimulus white_of(const Scene& scene, const Observer& observer, const Colours& colours) {
  Eigen::RowVectorXd lamp = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(scene.bands.size()));
  for (const Material& material : scene.materials)
    lamp += Eigen::Map<const Eigen::RowVectorXd>(material.exitance.values.data(), lamp.size());
  Tristimulus white = weighted(lamp, display_weights(scene, observer));
  double brightest = 0.0;
  for (const Tristimulus& c : colours.of_element) brightest = std::max(brightest, c.Y);
  const double scale = brightest / white.Y;
  return {scale * white.X, scale * white.Y, scale * white.Z};
}

}  // namespace

std::vector<BandChoice> band_choices(const Scene& scene, const PredictionArguments& a) {
  if (lamp_spectrum(scene).empty() || scene.is_total) return {};
  const Observer observer = read_observer(
      std::filesystem::path(reference_directory()) / "colour" / "cie1931_2deg_xyz.csv",
      "CIE 1931 2 deg");
  const Colours truth = colours_of(scene, observer);
  const Tristimulus white = white_of(scene, observer, truth);
  const PatchMesh mesh =
      uniform_mesh(scene, edge_for_count(scene, small_solve(scene).elements / 16), 2);
  std::vector<BandChoice> choices;
  const auto progress = terminal_progress(a.quiet);
  for (const std::size_t count : kCounts) {
    if (count >= scene.bands.size()) break;
    if (progress) progress("bands", static_cast<double>(count) / 48.0);
    const Scene coarse = read_scene(a.scene, {.lamp_weighted_bands = count});
    const Colours found = colours_of(coarse, observer);
    BandChoice choice{count, 0.0, 0.0, found.processor_s};
    double area = 0.0;
    for (std::size_t i = 0; i < found.of_element.size(); ++i) {
      if (truth.of_element[i].Y <= 0.0) continue;
      const double dE =
          ciede2000(cielab(found.of_element[i], white), cielab(truth.of_element[i], white));
      choice.largest_dE00 = std::max(choice.largest_dE00, dE);
      choice.mean_dE00 += mesh.patches[i].area_m2 * dE;
      area += mesh.patches[i].area_m2;
    }
    if (area > 0.0) choice.mean_dE00 /= area;
    choices.push_back(choice);
  }
  if (progress) progress("bands", 1.0);
  choices.push_back({0, 0.0, 0.0, truth.processor_s});
  return choices;
}

}  // namespace truebox::app
