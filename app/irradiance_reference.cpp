// SPDX-License-Identifier: BSD-3-Clause
#include "irradiance_reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "path_tracer/path_scene.h"
#include "path_tracer/path_tracer.h"
#include "radiometry/input_error.h"
#include "radiometry/processor_time.h"
#include "radiometry/table_file.h"
#include "sensor/camera.h"
#include "transport/enclosure.h"

namespace truebox::app {
namespace {

using Eigen::Index;

constexpr double kHeight = 1e-4;  // of the scene's diagonal: above a place, to look at it
constexpr double kBandTolerance_nm = 0.01;

bool reflects_everywhere(const Material& material) {
  const auto& rho = material.reflectance.values;
  return material.scattering == Scattering::lambertian &&
         std::all_of(rho.begin(), rho.end(), [](double r) { return r > 0.0; });
}

std::vector<ProbePoint> places_by_area(const Scene& scene, std::size_t count,
                                       std::mt19937_64& random) {
  std::vector<const Polygon*> pieces;
  std::vector<double> areas;
  for (const Surface& surface : scene.surfaces)
    if (!surface.is_opening && reflects_everywhere(scene.material_of(surface)))
      for (const Polygon& piece : surface.pieces) {
        pieces.push_back(&piece);
        areas.push_back(area_vector(piece).norm());
      }
  if (pieces.empty()) throw InputError(scene.path, 0, "a Lambertian surface that reflects", "none");
  std::vector<ProbePoint> places;
  double total = 0.0;
  for (const double area : areas) total += area;
  for (std::size_t k = 0; k < count; ++k) {
    double rest = total * unit_interval(random());
    std::size_t piece = 0;
    while (piece + 1 < areas.size() && rest >= areas[piece]) rest -= areas[piece++];
    const double u = unit_interval(random()), v = unit_interval(random());
    places.push_back({fmt::format("place_{}", k), sample_polygon(*pieces[piece], u, v),
                      plane_of(*pieces[piece]).normal});
  }
  return places;
}

std::vector<ProbePoint> places_by_pixel(const Scene& scene, std::size_t count,
                                        std::mt19937_64& random, const Camera& camera) {
  const PathScene rays(scene);
  std::vector<ProbePoint> places;
  for (std::size_t tried = 0; places.size() < count; ++tried) {
    if (tried > 1000 * count)
      throw InputError(scene.path, 0, "Lambertian surfaces in the camera's view", "hardly any");
    const double x = camera.width_px() * unit_interval(random());
    const double y = camera.height_px() * unit_interval(random());
    const auto ray = camera.ray({x, y});
    if (!ray) continue;
    const auto hit = rays.first_hit(ray->origin_m, ray->direction);
    if (!hit || !hit->front || !reflects_everywhere(*hit->face->material)) continue;
    places.push_back({fmt::format("pixel_{:.0f}_{:.0f}", std::floor(x), std::floor(y)), hit->point,
                      hit->normal});
  }
  return places;
}

// What is looked at in each place: for its reflectance and its own light.
std::vector<const Material*> materials_at(const Scene& scene,
                                          const std::vector<ProbePoint>& places) {
  const PathScene rays(scene);
  const double height_m = kHeight * scene.diameter_m();
  std::vector<const Material*> materials;
  for (const ProbePoint& place : places) {
    const auto hit =
        rays.first_hit(place.position_m + height_m * place.normal, Vec3(-place.normal));
    const bool is_there = hit && hit->front && (hit->point - place.position_m).norm() < height_m &&
                          hit->face->material->scattering == Scattering::lambertian;
    if (!is_there)
      throw InputError(scene.path, 0, "a place on the lit side of a Lambertian surface",
                       '"' + place.name + "\" is on none");
    materials.push_back(hit->face->material);
  }
  return materials;
}

IrradianceTable joined(const IrradianceTable& a, const IrradianceTable& b) {
  IrradianceTable sum = a;
  sum.value = 0.5 * (a.value + b.value);
  sum.standard_error =
      0.5 * (a.standard_error.array().square() + b.standard_error.array().square()).sqrt().matrix();
  return sum;
}

}  // namespace

double IrradianceTable::relative_error() const {
  double sum = 0.0;
  Index lit = 0;
  for (Index i = 0; i < value.rows(); ++i)
    for (Index k = 0; k < value.cols(); ++k)
      if (value(i, k) > 0.0 && std::isfinite(standard_error(i, k))) {
        sum += std::pow(standard_error(i, k) / value(i, k), 2.0);
        ++lit;
      }
  return lit == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(lit));
}

std::vector<ProbePoint> random_places(const Scene& scene, std::size_t count, std::uint64_t seed,
                                      const CameraDescription* camera) {
  std::mt19937_64 random(seed);
  return camera ? places_by_pixel(scene, count, random, Camera(*camera))
                : places_by_area(scene, count, random);
}

IrradianceTable trace_irradiance(const Scene& scene, const std::vector<ProbePoint>& places,
                                 int paths, std::uint64_t seed, const Progress& progress) {
  const std::vector<const Material*> materials = materials_at(scene, places);
  const double height_m = kHeight * scene.diameter_m();
  PathTraceOptions options;
  options.samples = paths;
  options.seed = seed;
  options.progress = progress;
  const PathTracedImage image = trace_paths(
      scene, static_cast<int>(places.size()), 1,
      [&](int x, int, UnitPair) -> std::optional<PixelRay> {
        const ProbePoint& place = places[static_cast<std::size_t>(x)];
        return PixelRay{place.position_m + height_m * place.normal, Vec3(-place.normal)};
      },
      options);
  IrradianceTable table;
  table.value.resize(static_cast<Index>(places.size()), static_cast<Index>(scene.bands.size()));
  table.standard_error.resize(table.value.rows(), table.value.cols());
  for (Index i = 0; i < table.value.rows(); ++i)
    for (Index k = 0; k < table.value.cols(); ++k) {
      const auto pixel = static_cast<std::size_t>(i), band = static_cast<std::size_t>(k);
      const Material& material = *materials[pixel];
      const double rho = material.reflectance[band], pi = std::numbers::pi;
      const double radiance = image.radiance.channels[band].samples[pixel];
      const double deviation = std::sqrt(image.variance.channels[band].samples[pixel]);
      table.value(i, k) = rho > 0.0 ? (pi * radiance - material.exitance[band]) / rho : 0.0;
      table.standard_error(i, k) =
          rho > 0.0 ? pi * deviation / rho : std::numeric_limits<double>::infinity();
    }
  table.source = fmt::format("path tracing, {} paths a place", image.samples);
  return table;
}

IrradianceTable trace_reference(const Scene& scene, const std::vector<ProbePoint>& places,
                                double relative_error, int least_paths, int most_paths,
                                double patience_s, std::uint64_t seed, const Progress& progress) {
  const double start_s = process_cpu_s();
  bool is_stopped = false;
  int paths = least_paths;
  IrradianceTable table = trace_irradiance(scene, places, paths, seed);
  while (table.relative_error() > relative_error && paths < most_paths) {
    // The next round takes as long as all so far.
    is_stopped = 2.0 * (process_cpu_s() - start_s) > patience_s;
    if (is_stopped) break;
    const double done = relative_error / table.relative_error();
    if (progress) progress("reference", std::min(0.99, done * done));
    table = joined(table, trace_irradiance(scene, places, paths, ++seed));
    paths *= 2;
  }
  if (progress) progress("reference", 1.0);
  table.source =
      fmt::format("path tracing, {} paths a place, standard error {:.2g} % rms{}", paths,
                  100.0 * table.relative_error(),
                  is_stopped ? fmt::format(" (stopped: {:.2g} % would take more than {:.0f} "
                                           "s of processor time, --reference-time)",
                                           100.0 * relative_error, patience_s)
                             : "");
  return table;
}

std::vector<double> bands_of_irradiance(const std::string& path) {
  const TableFile table = read_table(path);
  const std::size_t column = table.column_index("band_nm");
  std::set<double> bands;
  for (std::size_t row = 0; row < table.rows.size(); ++row) bands.insert(table.number(row, column));
  return {bands.begin(), bands.end()};
}

IrradianceTable read_irradiance(const std::string& path, const std::vector<ProbePoint>& places,
                                const WavelengthGrid& bands) {
  const TableFile file = read_table(path);
  const std::size_t name = file.column_index("name"), band_nm = file.column_index("band_nm"),
                    value = file.column_index("irradiance"),
                    error = file.column_index("standard_error");
  IrradianceTable table;
  table.value =
      BandMatrix::Constant(static_cast<Index>(places.size()), static_cast<Index>(bands.size()),
                           std::numeric_limits<double>::quiet_NaN());
  table.standard_error = table.value;
  std::map<std::string, Index> place_of;
  for (const ProbePoint& place : places)
    place_of.emplace(place.name, static_cast<Index>(place_of.size()));
  for (std::size_t row = 0; row < file.rows.size(); ++row) {
    const auto place = place_of.find(file.rows[row][name]);
    if (place == place_of.end()) continue;
    for (Index k = 0; k < table.value.cols(); ++k) {
      const double nm = bands.centre_nm(static_cast<std::size_t>(k));
      if (std::abs(nm - file.number(row, band_nm)) > kBandTolerance_nm) continue;
      table.value(place->second, k) = file.number(row, value);
      table.standard_error(place->second, k) = file.number(row, error);
      if (table.standard_error(place->second, k) < 0.0)
        throw InputError(path, file.row_lines[row], "a standard error of 0 or more",
                         file.rows[row][error]);
    }
  }
  for (const auto& [label, row] : place_of)
    for (Index k = 0; k < table.value.cols(); ++k)
      if (std::isnan(table.value(row, k)))
        throw InputError(path, 0,
                         fmt::format("the irradiance at \"{}\" in the band at {} nm", label,
                                     bands.centre_nm(static_cast<std::size_t>(k))),
                         "none");
  const auto source = file.header.find("source");
  table.source = fmt::format("{} ({}), standard error {:.2g} % rms", path,
                             source == file.header.end() ? "no source stated" : source->second,
                             100.0 * table.relative_error());
  return table;
}

std::string irradiance_csv(const IrradianceTable& table, const std::vector<ProbePoint>& places,
                           const Scene& scene) {
  std::string text = fmt::format(
      "# quantity: irradiance\n# unit: {}\n# uncertainty: column standard_error (k = 1)\n# source: "
      "truebox {}, {}\nname,band_nm,irradiance,standard_error\n",
      scene.exitance_unit(), table.source, scene.path);
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t b = 0; b < scene.bands.size(); ++b) {
      const auto row = static_cast<Index>(i), band = static_cast<Index>(b);
      text += fmt::format("\"{}\",{},{:.9g},{:.3g}\n", places[i].name, scene.bands.centre_nm(b),
                          table.value(row, band), table.standard_error(row, band));
    }
  return text;
}

}  // namespace truebox::app
