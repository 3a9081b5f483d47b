// SPDX-License-Identifier: BSD-3-Clause
// A closed grey cube, rho = 1/2, E = 1 everywhere: B = 2.
#include <cmath>
#include <cstdio>

#include "transport/prediction.h"

int main() {
  using namespace truebox;
  Scene scene;
  scene.bands = WavelengthGrid::from_centres({550.0});
  scene.materials = {{"grey", Reflectance(1, 0.5), RadiantExitance(1, 1.0)}};
  const Polygon faces[] = {
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}},
      {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, {{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}},
      {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}}, {{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}}};
  for (const Polygon& face : faces) scene.surfaces.push_back({"face", 0, {face}, false});
  PredictOptions options;
  options.elements = 96;
  const Prediction prediction(scene, options);
  if (prediction.outcome() != SolveOutcome::converged) return 1;
  const double worst = (prediction.radiosity().array() - 2.0).abs().maxCoeff();
  std::printf("worst |B - 2| = %.2g, bound %.2g\n", worst, prediction.radiosity_bound().maxCoeff());
  constexpr double kFormFactorTolerance =
      2e-5;  // relative, the default of FormFactorOptions, and 1/(1 - rho)
  return worst <= 2.0 * kFormFactorTolerance ? 0 : 1;
}
