// SPDX-License-Identifier: BSD-3-Clause
// What a fit of the Cornell Box's three reflectances and an exposure a band costs, against pixels,
// elements and bands: processor time, all threads together. Readings are the model's own, 0.3 %
// noise stated; the search starts at 0.5. Asserts nothing.
#include <fmt/format.h>

#include <ctime>
#include <filesystem>

#include "fit/scene_fit.h"
#include "scene/scene_file.h"

namespace {

using namespace truebox;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void measure(const Scene& truth, int pixels, std::size_t elements) {
  CameraDescription camera = truth.cameras.at("front");
  camera.pixels = {pixels, pixels};
  SceneModelOptions options;
  options.elements = elements;
  Scene guess = truth;
  for (Material& m : guess.materials)
    if (!m.emits() && m.name != "(opening)") m.reflectance = Reflectance(truth.bands.size(), 0.5);
  const double start = cpu_s();
  SceneModel model(guess, options);
  const double factors = cpu_s();
  model.add_view(camera);
  const double view = cpu_s();

  SceneFitProblem problem;
  problem.model = &model;
  problem.reflectances.assign(guess.materials.size(), ReflectanceChoice{});
  for (std::size_t m = 0; m < guess.materials.size(); ++m)
    if (!guess.materials[m].emits() && guess.materials[m].name != "(opening)")
      problem.reflectances[m].hold = Hold::free;
  problem.emissions.assign(1, EmissionChoice{});
  SceneState state = model.state();
  for (std::size_t m = 0; m < truth.materials.size(); ++m)
    for (std::size_t b = 0; b < truth.bands.size(); ++b)
      state.reflectance(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(b)) =
          truth.materials[m].reflectance[b];
  const BandMatrix exact = model.radiosity(state, nullptr).value / 3.14159265358979;
  for (Eigen::Index b = 0; b < exact.cols(); ++b) {
    PlaneReadings plane;
    plane.name = fmt::format("band {}", b + 1);
    plane.gain = Hold::free;
    plane.band_weights = Eigen::VectorXd::Unit(exact.cols(), b);
    const double floor = 1e-3 * exact.col(b).maxCoeff();
    for (Eigen::Index i = 0; i < exact.rows(); ++i)
      plane.readings.push_back(
          {static_cast<std::size_t>(i), exact(i, b), 0.003 * std::max(floor, exact(i, b))});
    problem.planes.push_back(std::move(plane));
  }
  const double before = cpu_s();
  const SceneFit fit = fit_scene(problem, {});
  fmt::print("{:>6} {:>8} {:>6} {:>10} {:>9} {:>10.2f} {:>8.2f} {:>8.2f} {:>6}  {}\n", pixels,
             model.mesh().size(), exact.cols(), fit.parameters.size(), problem.readings(),
             factors - start, view - factors, cpu_s() - before, fit.summary.iterations,
             to_string(fit.summary.outcome));
}

}  // namespace

int main() {
  const Scene scene =
      read_scene(std::filesystem::path(TRUEBOX_REFERENCE_DIR) / "cornell_box" / "cornell_box.toml");
  const std::vector<double> all = {420, 452, 500, 552, 600, 652, 700};
  fmt::print("{:>6} {:>8} {:>6} {:>10} {:>9} {:>10} {:>8} {:>8} {:>6}\n", "pixels", "elements",
             "bands", "parameters", "readings", "factors/s", "view/s", "fit/s", "steps");
  const Scene seven = in_bands_at(scene, all);
  for (const int pixels : {128, 256, 512}) measure(seven, pixels, 1000);
  for (const std::size_t elements : {500, 2000}) measure(seven, 512, elements);
  for (const std::size_t bands : {1, 3})
    measure(in_bands_at(scene, {all.end() - static_cast<std::ptrdiff_t>(bands), all.end()}), 256,
            1000);
}
