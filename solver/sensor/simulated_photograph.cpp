// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/simulated_photograph.h"

#include "sensor/spectral_responsivity.h"

namespace truebox {

SimulatedPhotograph simulate_photograph(const Prediction& prediction,
                                        const CameraDescription& camera,
                                        const RenderOptions& options, std::uint64_t seed) {
  const Scene& scene = prediction.scene();
  SimulatedPhotograph photograph;
  photograph.scene = render(prediction, Camera(camera), options);
  const PhotoCurrent current =
      photo_current(photograph.scene.radiance, scene.bands, luminaire_spectrum(scene), camera);
  photograph.image = read_out(current, *camera.sensor, seed);
  return photograph;
}

}  // namespace truebox
