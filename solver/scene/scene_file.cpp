// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene_file.h"

#include <toml++/toml.h>

#include <cmath>
#include <set>
#include <sstream>

#include "radiometry/input_error.h"
#include "radiometry/lamp_weighting.h"
#include "radiometry/planck.h"
#include "radiometry/table_file.h"
#include "scene/lamp_spectrum.h"

namespace truebox {
namespace {

constexpr double kFirstNm = 400.0, kLastNm = 700.0;  // of bands that only have a number

std::string described(const toml::node& node) {
  std::ostringstream text;
  if (node.is_table()) return "a table";
  text << toml::node_view<const toml::node>(node);
  std::string value = text.str();
  if (value.size() > 60) value = value.substr(0, 57) + "...";
  return value;
}

// Reads one scene file; keeps the path so that every mistake can name its place.
class Reader {
 public:
  Reader(std::filesystem::path path, const SceneFileOptions& options)
      : path_(std::move(path)), options_(options) {}

  Scene read() {
    const toml::table root = parse();
    allow_keys(root, {"length_unit", "bands", "materials", "surfaces", "openings", "cameras"});
    scene_.path = path_.string();
    read_unit(root);
    read_bands(root);
    read_materials(root);
    read_surfaces(root, "surfaces", false);
    read_surfaces(root, "openings", true);
    read_cameras(root);
    return std::move(scene_);
  }

 private:
  [[noreturn]] void fail(const toml::node& node, const std::string& expected,
                         const std::string& found) const {
    throw InputError(path_.string(), static_cast<int>(node.source().begin.line), expected, found);
  }

  toml::table parse() const {
    if (!std::filesystem::is_regular_file(path_))
      throw InputError(path_.string(), 0, "a scene file", "no such file");
    try {
      return toml::parse_file(path_.string());
    } catch (const toml::parse_error& error) {
      throw InputError(path_.string(), static_cast<int>(error.source().begin.line), "valid TOML",
                       std::string(error.description()));
    }
  }

  void allow_keys(const toml::table& table, const std::set<std::string>& known) const {
    for (const auto& [key, node] : table) {
      if (known.contains(std::string(key.str()))) continue;
      std::string list;
      for (const auto& name : known) list += (list.empty() ? "" : ", ") + name;
      throw InputError(path_.string(), static_cast<int>(key.source().begin.line),
                       "one of the keys " + list, "\"" + std::string(key.str()) + "\"");
    }
  }

  const toml::node& need(const toml::table& table, const char* key, const char* what) const {
    const toml::node* node = table.get(key);
    if (!node) fail(table, what, std::string("no key \"") + key + "\"");
    return *node;
  }

  double number(const toml::node& node, const char* what = "a finite number") const {
    const auto value = node.value<double>();
    if (!value || node.is_string() || node.is_boolean() || !std::isfinite(*value))
      fail(node, what, described(node));
    return *value;
  }

  std::string text(const toml::node& node, const char* what) const {
    if (!node.is_string()) fail(node, what, described(node));
    return *node.value<std::string>();
  }

  const toml::table& table_of(const toml::node& node, const char* what) const {
    if (!node.is_table()) fail(node, what, described(node));
    return *node.as_table();
  }

  std::vector<double> numbers(const toml::node& node, const char* what) const {
    if (!node.is_array()) fail(node, what, described(node));
    std::vector<double> values;
    for (const auto& item : *node.as_array()) values.push_back(number(item));
    return values;
  }

  Vec3 vector(const toml::node& node, const char* what) const {
    const auto values = numbers(node, what);
    if (values.size() != 3) fail(node, what, std::to_string(values.size()) + " numbers");
    return {values[0], values[1], values[2]};
  }

  void read_unit(const toml::table& root) {
    static const std::map<std::string, double> kMetres = {
        {"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"in", 0.0254}};
    const toml::node& node =
        need(root, "length_unit", "length_unit = \"m\", \"cm\", \"mm\" or \"in\"");
    scene_.length_unit = text(node, "a unit in quotes");
    const auto found = kMetres.find(scene_.length_unit);
    if (found == kMetres.end()) fail(node, "\"m\", \"cm\", \"mm\" or \"in\"", described(node));
    scene_.metres_per_unit = found->second;
  }

  void read_bands(const toml::table& root) {
    const toml::node* node = root.get("bands");
    if (!node) {  // a grey scene: one band, and no spectrum may ask for more
      scene_.bands = WavelengthGrid::from_centres({550.0});
      grey_ = true;
      return;
    }
    const toml::table& bands = table_of(*node, "a table [bands]");
    allow_keys(bands, {"from_nm", "to_nm", "step_nm", "centres_nm", "count", "scheme", "total"});
    if (const toml::node* total = bands.get("total")) {
      if (!total->is_boolean() || !*total->value<bool>() || bands.size() > 1)
        fail(*total, "total = true and nothing else in [bands]", described(*node));
      // One band over all wavelengths; its centre has no meaning.
      scene_.bands = WavelengthGrid::from_centres({550.0});
      scene_.is_total = grey_ = true;
      return;
    }
    try {
      if (bands.contains("count") || bands.contains("scheme")) {
        read_lamp_weighted(root, bands);
        return;
      }
      if (const toml::node* centres = bands.get("centres_nm")) {
        scene_.bands =
            WavelengthGrid::from_centres(numbers(*centres, "a list of band centres in nm"));
      } else {
        const char* what = "from_nm, to_nm and step_nm, or centres_nm = [...]";
        scene_.bands = WavelengthGrid::uniform(number(need(bands, "from_nm", what)),
                                               number(need(bands, "to_nm", what)),
                                               number(need(bands, "step_nm", what)));
      }
      if (options_.lamp_weighted_bands > 0) read_lamp_weighted(root, bands);
    } catch (const std::invalid_argument& error) {
      fail(*node, "usable bands", error.what());
    }
  }

  // count = 16, scheme = "lamp_weighted", from_nm and to_nm; or as many asked for by the caller,
  // over what the file's bands cover.
  void read_lamp_weighted(const toml::table& root, const toml::table& bands) {
    std::size_t count = options_.lamp_weighted_bands;
    double from_nm = kFirstNm, to_nm = kLastNm;
    if (bands.contains("count") || bands.contains("scheme")) {
      for (const char* key : {"step_nm", "centres_nm"})
        if (const toml::node* other = bands.get(key))
          fail(*other, "count and scheme, or step_nm, or centres_nm", "both");
      const toml::node& scheme = need(bands, "scheme", "scheme = \"lamp_weighted\"");
      if (text(scheme, "scheme = \"lamp_weighted\"") != "lamp_weighted")
        fail(scheme, "scheme = \"lamp_weighted\"", described(scheme));
      const toml::node& wanted = need(bands, "count", "count = number of bands");
      const double value = number(wanted, "count = number of bands");
      if (value < 1.0 || value > 1000.0 || value != std::floor(value))
        fail(wanted, "1 to 1000 bands", described(wanted));
      if (count == 0) count = static_cast<std::size_t>(value);
      if (const toml::node* node = bands.get("from_nm")) from_nm = number(*node);
      if (const toml::node* node = bands.get("to_nm")) to_nm = number(*node);
    } else {
      const WavelengthGrid& own = scene_.bands;
      from_nm = own.centre_nm(0) - 0.5 * own.width_nm(0);
      to_nm = own.centres_nm().back() + 0.5 * own.widths_nm().back();
    }
    scene_.bands = equal_bands(from_nm, to_nm, count);
    lamp_ = all_lamps(root, bands);
  }

  // The sum of all emissions, as they are tabulated: what the scene is lit by before anything is
  // reflected, each square metre of lamp counted alike.
  TabulatedSpectrum all_lamps(const toml::table& root, const toml::node& bands) const {
    std::vector<TabulatedSpectrum> lamps;
    const toml::table* materials = root.get_as<toml::table>("materials");
    for (const auto& [key, node] : materials ? *materials : toml::table{}) {
      const toml::table* material = node.as_table();
      if (!material) continue;
      if (const toml::node* hot = material->get("temperature_K"))
        fail(*hot, "lamps with an exitance, because the bands are weighted by them",
             "a temperature");
      if (const toml::node* exitance = material->get("exitance")) {
        lamps.push_back(tabulated(*exitance, "an exitance"));
        for (double value : lamps.back().values())
          if (value < 0.0) fail(*exitance, "exitance >= 0", std::to_string(value));
      }
    }
    if (lamps.empty()) fail(bands, "a material with an exitance to weight the bands by", "none");
    return sum_of(lamps);
  }

  // As the file or the source tabulates it; a number holds at all wavelengths.
  TabulatedSpectrum tabulated(const toml::node& node, const char* what) const {
    if (!node.is_table()) return TabulatedSpectrum({550.0}, {number(node, what)});
    if (grey_)
      fail(node, "bands by wavelength, because a material or camera has a spectrum",
           scene_.is_total ? "total = true" : "no [bands]");
    const toml::table& table = *node.as_table();
    try {
      if (table.contains("file")) {
        allow_keys(table, {"file", "column", "scale"});
        const auto file = path_.parent_path() / text(need(table, "file", what), "a file name");
        const auto column = text(need(table, "column", "column = \"name\""), "a column name");
        const toml::node* scale = table.get("scale");  // for data that are only relative
        const auto table_curve = spectrum_from_table(read_table(file), column);
        std::vector<double> values = table_curve.values();
        for (double& v : values) v *= scale ? number(*scale) : 1.0;
        return TabulatedSpectrum(table_curve.wavelengths_nm(), std::move(values));
      }
      allow_keys(table, {"nm", "value"});
      return TabulatedSpectrum(numbers(need(table, "nm", what), "a list of wavelengths in nm"),
                               numbers(need(table, "value", what), "a list of values"));
    } catch (const std::invalid_argument& error) {
      fail(node, "a sorted spectrum with as many values as wavelengths", error.what());
    }
  }

  std::vector<double> spectrum(const toml::node& node, const char* what) const {
    const TabulatedSpectrum table = tabulated(node, what);
    return lamp_.empty() ? sample_bands(table, scene_.bands)
                         : lamp_weighted_means(table, scene_.bands, lamp_);
  }

  // Light is the mean over a band, whatever weights the reflectances there.
  std::vector<double> emission(const TabulatedSpectrum& exitance) const {
    if (lamp_.empty()) return sample_bands(exitance, scene_.bands);
    std::vector<double> means;
    for (std::size_t b = 0; b < scene_.bands.size(); ++b)
      means.push_back(exitance.band_mean(scene_.bands.centre_nm(b), scene_.bands.width_nm(b)));
    return means;
  }

  void read_materials(const toml::table& root) {
    const auto& materials = table_of(need(root, "materials", "a table [materials.NAME]"), "tables");
    for (const auto& [key, node] : materials) {
      const toml::table& table = table_of(node, "a table [materials.NAME]");
      Material material;
      material.name = std::string(key.str());
      material.scattering = scattering(table);
      material.reflectance = Reflectance(scene_.bands.size(), 0.0);
      material.exitance = RadiantExitance(scene_.bands.size(), 0.0);
      switch (material.scattering) {
        case Scattering::lambertian:
          allow_keys(table, {"scattering", "reflectance", "exitance", "temperature_K"});
          read_reflectance(table, material);
          read_exitance(table, material);
          if (const toml::node* temperature = table.get("temperature_K"))
            add_thermal_emission(*temperature, material);
          break;
        case Scattering::mirror:
          allow_keys(table, {"scattering", "reflectance", "refractive_index", "absorption_index"});
          if (table.contains("refractive_index"))
            read_conductor(table, material);
          else
            read_reflectance(table, material);
          break;
        case Scattering::rough_conductor:
          allow_keys(table, {"scattering", "roughness", "refractive_index", "absorption_index"});
          read_conductor(table, material);
          read_roughness(table, material);
          break;
        case Scattering::dielectric:
          allow_keys(table, {"scattering", "refractive_index"});
          material.refractive_index = refractive_index(table);
          break;
      }
      scene_.materials.push_back(std::move(material));
    }
  }

  // Kirchhoff (1860): an opaque surface emits 1 - rho of what a black one does.
  void add_thermal_emission(const toml::node& node, Material& material) {
    const double temperature_K = number(node, "a temperature in K");
    if (temperature_K < 0.0) fail(node, "a temperature in K, 0 or above", described(node));
    if (grey_ && !scene_.is_total)
      fail(node, "[bands] by wavelength, or total = true, to emit in", "no [bands]");
    scene_.is_thermal = true;
    for (std::size_t b = 0; b < scene_.bands.size(); ++b) {
      const double centre = scene_.bands.centre_nm(b), half = 0.5 * scene_.bands.width_nm(b);
      const double black = scene_.is_total
                               ? blackbody_exitance(temperature_K)
                               : mean_planck_exitance(std::max(centre - half, 1e-3 * centre),
                                                      centre + half, temperature_K);
      material.exitance[b] += (1.0 - material.reflectance[b]) * black;
    }
  }

  Scattering scattering(const toml::table& table) const {
    static const std::map<std::string, Scattering> kKinds = {
        {"lambertian", Scattering::lambertian},
        {"mirror", Scattering::mirror},
        {"rough-conductor", Scattering::rough_conductor},
        {"dielectric", Scattering::dielectric}};
    const toml::node* node = table.get("scattering");
    if (!node) return Scattering::lambertian;
    const char* kinds = "\"lambertian\", \"mirror\", \"rough-conductor\" or \"dielectric\"";
    const auto found = kKinds.find(text(*node, kinds));
    if (found == kKinds.end()) fail(*node, kinds, described(*node));
    return found->second;
  }

  void read_reflectance(const toml::table& table, Material& material) {
    const toml::node& rho =
        need(table, "reflectance", "reflectance = number, { nm, value } or { file, column }");
    material.reflectance = Reflectance(spectrum(rho, "a reflectance"));
    for (double r : material.reflectance.values)
      if (r < 0.0 || r >= 1.0)
        fail(rho, "0 <= reflectance < 1 (at 1 and above, energy would be created)",
             std::to_string(r));
  }

  void read_exitance(const toml::table& table, Material& material) {
    const toml::node* exitance = table.get("exitance");
    if (!exitance) return;
    material.exitance_spectrum = tabulated(*exitance, "an exitance");
    material.exitance = RadiantExitance(emission(material.exitance_spectrum));
    for (double e : material.exitance.values)
      if (e < 0.0) fail(*exitance, "exitance >= 0", std::to_string(e));
  }

  RefractiveIndex refractive_index(const toml::table& table) {
    const toml::node& node = need(table, "refractive_index",
                                  "refractive_index = number, { nm, value } or { file, column }");
    RefractiveIndex n(spectrum(node, "a refractive index"));
    for (double value : n.values)
      if (!(value > 0.0)) fail(node, "a refractive index above 0", std::to_string(value));
    return n;
  }

  void read_conductor(const toml::table& table, Material& material) {
    if (const toml::node* rho = table.get("reflectance"))
      fail(*rho, "a reflectance or optical constants, which say the same", "both");
    material.refractive_index = refractive_index(table);
    const toml::node& node = need(table, "absorption_index",
                                  "absorption_index = number, { nm, value } or { file, column }");
    material.absorption_index = RefractiveIndex(spectrum(node, "an absorption index"));
    for (double value : material.absorption_index.values)
      if (value < 0.0) fail(node, "an absorption index of 0 or more", std::to_string(value));
  }

  void read_roughness(const toml::table& table, Material& material) const {
    const toml::node& node = need(table, "roughness", "roughness = number, the GGX alpha");
    material.roughness = number(node);
    if (material.roughness < 0.01 || material.roughness > 1.0)
      fail(node, "0.01 <= roughness <= 1 (smoother is a mirror)", described(node));
  }

  std::size_t material_index(const toml::node& node) const {
    const std::string name = text(node, "a material's name in quotes");
    std::string known;
    for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
      if (scene_.materials[i].name == name) return i;
      known += (known.empty() ? "" : ", ") + scene_.materials[i].name;
    }
    fail(node, "one of the materials " + known, "\"" + name + "\"");
  }

  Polygon polygon(const toml::node& node) const {
    if (!node.is_array() || node.as_array()->size() < 3)
      fail(node, "at least three vertices [[x, y, z], ...]", described(node));
    Polygon vertices;
    for (const auto& item : *node.as_array())
      vertices.push_back(scene_.metres_per_unit * vector(item, "a vertex [x, y, z]"));
    const double size = diameter_m(vertices);
    if (!(area_vector(vertices).norm() > 1e-14 * size * size))
      fail(node, "a polygon with an area", "one without");
    return vertices;
  }

  static bool is_planar(const Polygon& polygon) {
    const Plane plane = plane_of(polygon);
    const double tolerance = 1e-9 * diameter_m(polygon);
    for (const Vec3& v : polygon)
      if (std::abs(plane.distance_m(v)) > tolerance) return false;
    return true;
  }

  std::vector<Polygon> pieces(const toml::table& table) const {
    const toml::node& node = need(table, "vertices", "vertices = [[x, y, z], ...]");
    const Polygon outline = polygon(node);
    std::vector<Polygon> holes;
    if (const toml::node* list = table.get("holes")) {
      if (!list->is_array()) fail(*list, "holes = [[[x, y, z], ...], ...]", described(*list));
      for (const auto& item : *list->as_array()) holes.push_back(polygon(item));
    }
    if (!is_planar(outline)) {
      if (outline.size() != 4 || !holes.empty())
        fail(node, "a planar polygon (only a quad without holes may be bent)", "a bent one");
      return {{outline[0], outline[1], outline[2]}, {outline[0], outline[2], outline[3]}};
    }
    for (const Polygon& hole : holes)
      for (const Vec3& v : hole)
        if (std::abs(plane_of(outline).distance_m(v)) > 1e-9 * diameter_m(outline))
          fail(*table.get("holes"), "holes in the plane of their surface", "a vertex off it");
    auto parts = convex_pieces(outline, holes);
    if (parts.empty())
      fail(node, "an outline that does not cross itself and is not all hole", "neither");
    return parts;
  }

  void read_surfaces(const toml::table& root, const char* key, bool opening) {
    const toml::node* list = root.get(key);
    if (!list && opening) return;
    if (!list) fail(root, "[[surfaces]]", "none");
    if (!list->is_array_of_tables())
      fail(*list, std::string("tables [[") + key + "]]", described(*list));
    if (opening) scene_.materials.push_back(void_material());
    for (const auto& item : *list->as_array()) {
      const toml::table& table = *item.as_table();
      allow_keys(table, opening ? std::set<std::string>{"name", "vertices", "holes"}
                                : std::set<std::string>{"name", "material", "vertices", "holes",
                                                        "two_sided"});
      Surface surface;
      surface.name = text(need(table, "name", "name = \"...\""), "a name in quotes");
      if (!names_.insert(surface.name).second)
        fail(*table.get("name"), "a name used once", "\"" + surface.name + "\" again");
      surface.is_opening = opening;
      surface.material = opening ? scene_.materials.size() - 1
                                 : material_index(need(table, "material", "material = \"...\""));
      surface.pieces = pieces(table);
      if (const toml::node* two_sided = table.get("two_sided")) {
        if (!two_sided->is_boolean()) fail(*two_sided, "true or false", described(*two_sided));
        surface.two_sided = *two_sided->value<bool>();
        if (surface.two_sided && scene_.material_of(surface).scattering == Scattering::dielectric)
          fail(*two_sided, "one side: a dielectric has its medium behind it", "two");
        if (surface.two_sided) add_back_sides(surface.pieces);
      }
      scene_.surfaces.push_back(std::move(surface));
    }
  }

  static void add_back_sides(std::vector<Polygon>& pieces) {
    const std::size_t count = pieces.size();
    for (std::size_t i = 0; i < count; ++i)
      pieces.push_back(Polygon(pieces[i].rbegin(), pieces[i].rend()));
  }

  Material void_material() const {
    return {"(opening)", Reflectance(scene_.bands.size(), 0.0),
            RadiantExitance(scene_.bands.size(), 0.0)};
  }

  void read_cameras(const toml::table& root) {
    const toml::node* node = root.get("cameras");
    if (!node) return;
    for (const auto& [key, item] : table_of(*node, "tables [cameras.NAME]")) {
      const toml::table& table = table_of(item, "a table [cameras.NAME]");
      allow_keys(table, {"position", "direction", "up", "focal_length_mm", "film_mm", "pixels",
                         "lens", "sensor"});
      CameraDescription& described_camera = scene_.cameras[std::string(key.str())];
      described_camera = camera(table);
      if (const toml::node* part = table.get("lens"))
        read_lens(table_of(*part, "a table [cameras.NAME.lens]"), described_camera);
      if (const toml::node* part = table.get("sensor"))
        read_sensor(table_of(*part, "a table [cameras.NAME.sensor]"), described_camera);
    }
  }

  CameraDescription camera(const toml::table& table) const {
    CameraDescription camera;
    camera.position_m = scene_.metres_per_unit *
                        vector(need(table, "position", "position = [x, y, z]"), "[x, y, z]");
    camera.direction = vector(need(table, "direction", "direction = [x, y, z]"), "[x, y, z]");
    camera.up = vector(need(table, "up", "up = [x, y, z]"), "[x, y, z]");
    if (camera.direction.cross(camera.up).norm() <
        1e-9 * camera.direction.norm() * camera.up.norm())
      fail(table, "a direction that is not parallel to up", "parallel vectors");
    const toml::node& focal = need(table, "focal_length_mm", "focal_length_mm = number");
    camera.focal_length_m = 1e-3 * number(focal);
    if (camera.focal_length_m <= 0.0) fail(focal, "a positive focal length", described(focal));
    const toml::node& film = need(table, "film_mm", "film_mm = [width, height]");
    const auto size_mm = numbers(film, "film_mm = [width, height]");
    if (size_mm.size() != 2 || size_mm[0] <= 0.0 || size_mm[1] <= 0.0)
      fail(film, "two positive lengths", described(film));
    camera.film_m = {1e-3 * size_mm[0], 1e-3 * size_mm[1]};
    const toml::node& grid = need(table, "pixels", "pixels = [width, height]");
    const auto pixels = numbers(grid, "pixels = [width, height]");
    for (double p : pixels)
      if (p < 1.0 || p > 32768.0 || p != std::floor(p))
        fail(grid, "1 to 32768 pixels", described(grid));
    if (pixels.size() != 2) fail(grid, "pixels = [width, height]", described(grid));
    camera.pixels = {static_cast<int>(pixels[0]), static_cast<int>(pixels[1])};
    return camera;
  }

  double number_in(const toml::table& table, const char* key, double fallback, double low,
                   double high, const char* what) const {
    const toml::node* node = table.get(key);
    if (!node) return fallback;
    const double value = number(*node, what);
    if (value < low || value > high) fail(*node, what, described(*node));
    return value;
  }

  bool flag(const toml::table& table, const char* key, bool fallback) const {
    const toml::node* node = table.get(key);
    if (!node) return fallback;
    if (!node->is_boolean()) fail(*node, "true or false", described(*node));
    return *node->value<bool>();
  }

  // A share of light, [0, 1], known in every band: what no table covers is not invented.
  TabulatedSpectrum efficiency(const toml::node& node, const char* what) const {
    const TabulatedSpectrum curve = tabulated(node, what);
    for (double v : curve.values())
      if (v < 0.0 || v > 1.0) fail(node, "values in [0, 1]", std::to_string(v));
    const auto& nm = scene_.bands.centres_nm();
    if (node.is_table() && !curve.covers(nm.front(), nm.back()))
      fail(node, "a table that covers all bands",
           "one from " + std::to_string(curve.wavelengths_nm().front()) + " to " +
               std::to_string(curve.wavelengths_nm().back()) + " nm");
    return curve;
  }

  LensDistortion distortion(const toml::node& node) const {
    const toml::table& table = table_of(node, "distortion = { k1 = number, ... }");
    LensDistortion d;
    const std::map<std::string, double*> members = {
        {"k1", &d.k1}, {"k2", &d.k2}, {"k3", &d.k3}, {"k4", &d.k4}, {"k5", &d.k5}, {"k6", &d.k6},
        {"p1", &d.p1}, {"p2", &d.p2}, {"s1", &d.s1}, {"s2", &d.s2}, {"s3", &d.s3}, {"s4", &d.s4}};
    std::set<std::string> keys;
    for (const auto& [key, member] : members) keys.insert(key);
    allow_keys(table, keys);
    for (const auto& [key, value] : table) *members.at(std::string(key.str())) = number(value);
    return d;
  }

  // Transmittance at an image height r, both dimensionless, must stay that of a lens.
  void check_vignetting(const toml::node& node, const CameraDescription& camera) const {
    double corner = 0.0;
    for (std::size_t k = 0; k < 2; ++k)
      corner =
          std::hypot(corner, 0.5 * camera.film_m[k] + std::abs(camera.lens.principal_point_m[k]));
    for (int step = 0; step <= 1000; ++step) {
      const double r = step / 1000.0 * corner / camera.focal_length_m;
      const double transmittance = camera.lens.vignetting_at(r);
      if (transmittance < 0.0)
        fail(node, "a polynomial that is not negative on the film",
             std::to_string(transmittance) + " at r = " + std::to_string(r));
    }
  }

  void read_lens(const toml::table& table, CameraDescription& camera) const {
    allow_keys(table, {"distortion", "principal_point_px", "f_number", "vignetting",
                       "point_spread_um", "veiling_glare", "transmittance", "filter"});
    LensDescription& lens = camera.lens;
    if (const toml::node* node = table.get("distortion")) lens.distortion = distortion(*node);
    if (const toml::node* node = table.get("principal_point_px")) {
      const auto centre = numbers(*node, "principal_point_px = [x, y]");
      if (centre.size() != 2) fail(*node, "principal_point_px = [x, y]", described(*node));
      for (std::size_t k = 0; k < 2; ++k)
        lens.principal_point_m[k] =
            (centre[k] - 0.5 * camera.pixels[k]) * camera.pixel_pitch_m()[k];
    }
    if (table.contains("f_number"))
      lens.f_number = number_in(table, "f_number", 0.0, 0.5, 1e4, "an f-number from 0.5 to 10000");
    if (const toml::node* node = table.get("vignetting")) {
      const char* what = "vignetting = { cos4 = true, polynomial = [a1, ...] }";
      const toml::table& vignetting = table_of(*node, what);
      allow_keys(vignetting, {"cos4", "polynomial"});
      lens.cos4 = flag(vignetting, "cos4", false);
      if (const toml::node* list = vignetting.get("polynomial")) {
        lens.vignetting_polynomial = numbers(*list, what);
        check_vignetting(*list, camera);
      }
    }
    lens.point_spread_m =
        1e-6 * number_in(table, "point_spread_um", 0.0, 0.0, 1e4, "0 to 10000 um");
    lens.veiling_glare =
        number_in(table, "veiling_glare", 0.0, 0.0, 0.99, "a share of the light, 0 to 0.99");
    for (const char* key : {"filter", "transmittance"})
      if (const toml::node* node = table.get(key))
        lens.transmittances.push_back(efficiency(*node, "a transmittance"));
  }

  std::vector<SensorChannel> sensor_channels(const toml::node& node) const {
    const char* what = "an efficiency, or a table of them: R = ..., G = ..., B = ...";
    const toml::table* table = node.as_table();
    if (!table || table->contains("nm") || table->contains("file"))
      return {{"Y", efficiency(node, what)}};
    std::vector<SensorChannel> channels;
    for (const char* name : {"R", "G", "B"})  // the order that viewers expect, others after them
      if (const toml::node* curve = table->get(name))
        channels.push_back({name, efficiency(*curve, what)});
    for (const auto& [key, curve] : *table)
      if (key != "R" && key != "G" && key != "B")
        channels.push_back({std::string(key.str()), efficiency(curve, what)});
    if (channels.empty()) fail(node, what, "an empty table");
    return channels;
  }

  void read_sensor(const toml::table& table, CameraDescription& camera) const {
    allow_keys(table, {"quantum_efficiency", "bayer", "exposure_s", "gain_dn", "offset_dn",
                       "read_noise_dn", "dark_current_electrons_per_s", "full_well_electrons",
                       "bits", "shot_noise"});
    if (!camera.lens.f_number)
      fail(table, "f_number in the camera's lens, because a sensor sees through an aperture",
           "none");
    const double most = 1e300;
    SensorDescription sensor;
    sensor.channels = sensor_channels(need(table, "quantum_efficiency", "quantum_efficiency"));
    need(table, "exposure_s", "exposure_s = number");
    sensor.exposure_s = number_in(table, "exposure_s", 0.0, 0.0, most, "an exposure time >= 0 s");
    const toml::node& gain = need(table, "gain_dn", "gain_dn = DN per electron");
    sensor.gain_dn = number_in(table, "gain_dn", 1.0, 0.0, most, "a gain in DN per electron > 0");
    if (sensor.gain_dn == 0.0) fail(gain, "a gain in DN per electron > 0", "0");
    sensor.offset_dn = number_in(table, "offset_dn", 0.0, 0.0, 1e9, "a black level >= 0 DN");
    sensor.read_noise_dn = number_in(table, "read_noise_dn", 0.0, 0.0, most, "a noise >= 0 DN");
    sensor.dark_current_electrons_per_s =
        number_in(table, "dark_current_electrons_per_s", 0.0, 0.0, most, "a dark current >= 0");
    sensor.full_well_electrons = number_in(table, "full_well_electrons", sensor.full_well_electrons,
                                           1.0, most, "a full well of at least 1 electron");
    const double bits = number_in(table, "bits", 0.0, 1.0, 24.0, "1 to 24 bits");
    if (bits != std::floor(bits)) fail(*table.get("bits"), "1 to 24 bits", std::to_string(bits));
    sensor.bits = static_cast<int>(bits);
    sensor.shot_noise = flag(table, "shot_noise", true);
    if (const toml::node* node = table.get("bayer")) {
      const char* what = "\"rggb\", \"bggr\", \"grbg\" or \"gbrg\"";
      try {
        sensor.bayer = BayerPattern(text(*node, what));
      } catch (const std::invalid_argument&) {
        fail(*node, what, described(*node));
      }
      std::string names;
      for (const SensorChannel& channel : sensor.channels) names += channel.name;
      if (names != "RGB") fail(*node, "quantum efficiencies of R, G and B", "those of " + names);
    }
    camera.sensor = std::move(sensor);
  }

  std::filesystem::path path_;
  SceneFileOptions options_;
  Scene scene_;
  std::set<std::string> names_;
  bool grey_ = false;
  TabulatedSpectrum lamp_;  // that weights the bands, if any does
};

}  // namespace

Scene read_scene(const std::filesystem::path& path, const SceneFileOptions& options) {
  return Reader(path, options).read();
}

}  // namespace truebox
