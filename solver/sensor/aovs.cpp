// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/aovs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>

#include "image/spectral_image.h"

namespace truebox {
namespace {

constexpr int kSide = 4;  // of the points that find the coverage

enum ChannelOrder { kId, kPosition, kNormal = kPosition + 3, kCoverage = kNormal + 3, kPlanes };

// "S0.400,000000nm" -> "<layer>.400,000000nm"
std::string layer_name(const std::string& layer, double nm) {
  const std::string name = spectral_channel_name(nm);
  return layer + name.substr(name.find('.'));
}

struct Geometry {
  const Scene& scene;
  const PatchMesh& mesh;
  const Visibility& visibility;

  std::optional<Visibility::Hit> seen(const Camera& camera, double x, double y) const {
    const auto ray = camera.ray({x, y});
    if (!ray) return std::nullopt;
    auto hit = visibility.first_hit(ray->origin_m, ray->direction);
    if (hit && !hit->front && !is_clear(hit->piece)) hit.reset();
    return hit;
  }
  bool is_clear(std::uint32_t piece) const {
    return scene.material_of(scene.surfaces[mesh.pieces[piece].surface]).scattering ==
           Scattering::dielectric;
  }
  float id(const std::optional<Visibility::Hit>& hit) const {
    return hit ? static_cast<float>(mesh.pieces[hit->piece].surface + 1) : 0.0f;
  }
};

// Calls at_centre(pixel, hit) for each pixel, after its geometry is written.
template <class AtCentre>
Image fill(const Geometry& g, const Camera& camera, const AtCentre& at_centre) {
  Image image(camera.width_px(), camera.height_px());
  for (const char* name : {"surface.id", "position.X", "position.Y", "position.Z", "normal.X",
                           "normal.Y", "normal.Z", "coverage"})
    image.add_channel(name);
  for (const char* axis : {"X", "Y", "Z"}) {
    image.attributes[std::string("unit:position.") + axis] = "m";
    image.attributes[std::string("unit:normal.") + axis] = "1";
  }
  image.attributes["unit:surface.id"] = image.attributes["unit:coverage"] = "1";
  for (std::size_t s = 0; s < g.scene.surfaces.size(); ++s)
    if (!g.scene.surfaces[s].is_opening)
      image.attributes["surface." + std::to_string(s + 1)] = g.scene.surfaces[s].name;
  tbb::parallel_for(0, camera.height_px(), [&](int y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      const std::size_t pixel = image.index(x, y);
      const auto plane = [&](int k) -> float& { return image.channels[k].samples[pixel]; };
      const auto hit = g.seen(camera, x + 0.5, y + 0.5);
      int same = 0;
      for (int k = 0; k < kSide * kSide; ++k)
        same += g.id(g.seen(camera, x + (k % kSide + 0.5) / kSide,
                            y + (k / kSide + 0.5) / kSide)) == g.id(hit);
      plane(kCoverage) = static_cast<float>(same) / (kSide * kSide);
      plane(kId) = g.id(hit);
      if (!hit) continue;
      const double side = hit->front ? 1.0 : -1.0;
      for (int k = 0; k < 3; ++k) {
        plane(kPosition + k) = static_cast<float>(hit->point[k]);
        plane(kNormal + k) = static_cast<float>(side * g.mesh.pieces[hit->piece].plane.normal[k]);
      }
      at_centre(image, pixel, *hit);
    }
  });
  return image;
}

}  // namespace

Image geometry_aovs(const Scene& scene, const Camera& camera) {
  const PatchMesh mesh = uniform_mesh(scene, scene.diameter_m());
  const Visibility visibility(mesh, scene);
  return fill(Geometry{scene, mesh, visibility}, camera,
              [](Image&, std::size_t, const Visibility::Hit&) {});
}

Image render_aovs(const Prediction& prediction, const Camera& camera) {
  const auto& bands = prediction.scene().bands.centres_nm();
  Image light(camera.width_px(), camera.height_px());
  for (const char* layer : {"irradiance", "irradiance_bound"})
    for (double nm : bands) {
      light.add_channel(layer_name(layer, nm));
      light.attributes["unit:" + light.channels.back().name] = "W m^-2 nm^-1";
    }
  Image image = fill(
      Geometry{prediction.scene(), prediction.fine().mesh, prediction.visibility()}, camera,
      [&](const Image&, std::size_t pixel, const Visibility::Hit& hit) {
        Gather::Scratch scratch;
        const BoundedIrradiance e = prediction.irradiance_on(hit.piece, hit.point, scratch);
        for (std::size_t b = 0; b < bands.size(); ++b) {
          const auto k = static_cast<Eigen::Index>(b);
          light.channels[b].samples[pixel] = static_cast<float>(e.value[k]);
          light.channels[bands.size() + b].samples[pixel] = static_cast<float>(e.error_bound[k]);
        }
      });
  std::move(light.channels.begin(), light.channels.end(), std::back_inserter(image.channels));
  image.attributes.merge(light.attributes);
  return image;
}

}  // namespace truebox
