// SPDX-License-Identifier: BSD-3-Clause
#include "walkthrough/walkthrough.h"

#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "document/codecs.h"
#include "export/solution_surface.h"
#include "figures/colour_map.h"
#include "figures/text.h"

namespace truebox {

namespace embedded {
extern const char* const kWalkthroughPage;
extern const char* const kWalkthroughStyle;
extern const char* const kWalkthroughScript;
extern const char* const kThree;
extern const char* const kOrbitControls;
}  // namespace embedded

namespace {

using nlohmann::json;

template <class T>
std::string base64_of(const std::vector<T>& values) {
  std::vector<std::uint8_t> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return detail::base64_encode(bytes);
}

std::vector<double> numbers(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

json cameras_json(const Scene& scene) {
  json cameras = json::array();
  for (const auto& [name, c] : scene.cameras)
    cameras.push_back({{"name", name},
                       {"position", numbers(c.position_m)},
                       {"direction", numbers(c.direction.normalized())},
                       {"up", numbers(c.up.normalized())},
                       {"tangentX", 0.5 * c.film_m[0] / c.focal_length_m},
                       {"tangentY", 0.5 * c.film_m[1] / c.focal_length_m}});
  return cameras;
}

// Linear BT.709 of one unit of radiosity in each band, by way of L = B / pi.
json colour_weights(const WavelengthGrid& bands, const Observer& observer) {
  json weights = json::array();
  for (const Tristimulus& xyz : band_weights(bands, observer)) {
    const LinearRgb rgb = linear_bt709(xyz);
    for (const double v : rgb) weights.push_back(v / std::numbers::pi);
  }
  return weights;
}

// All bands of the radiosity, then all bands of its bound, each band as its difference to the one
// before; the exponents of the halves go into `data`.
std::string packed_bands(const SolutionSurface& surface, json& data) {
  std::vector<detail::PackedPlane> planes;
  for (const BandMatrix* matrix : {&surface.radiosity, &surface.error_bound})
    for (Eigen::Index b = 0; b < matrix->cols(); ++b) {
      const Eigen::VectorXf column = matrix->col(b).cast<float>();
      planes.push_back(detail::half_plane({column.data(), column.data() + column.size()},
                                          matrix == &surface.error_bound));
      data["exponents"].push_back(planes.back().exponent);
    }
  return detail::base64_encode(
      detail::deflate_planes(planes, 1, static_cast<std::size_t>(surface.radiosity.cols())));
}

json solution_json(const Prediction& prediction, const Observer& observer,
                   const std::string& source) {
  const Scene& scene = prediction.scene();
  const SolutionSurface surface = solution_surface(prediction);
  if (surface.positions_m.size() * scene.bands.size() > std::size_t{1} << 30)
    throw std::length_error("too many elements and bands for one page");
  json data = {{"source", valid_text(source)},
               {"unit", unit_text(scene.exitance_unit())},
               {"bands", scene.bands.centres_nm()},
               {"vertices", surface.positions_m.size()},
               {"cameras", cameras_json(scene)},
               {"boundIsReliable", prediction.bound_is_reliable()},
               {"colourWeights", colour_weights(scene.bands, observer)}};
  for (const Surface& s : scene.surfaces) {
    data["surfaces"].push_back(valid_text(s.name));
    data["shines"].push_back(!s.is_opening && scene.material_of(s).emits());
  }
  std::vector<float> positions;
  for (const Vec3& p : surface.positions_m)
    for (int c = 0; c < 3; ++c) positions.push_back(static_cast<float>(p[c]));
  data["positions"] = base64_of(positions);
  data["triangles"] = base64_of(surface.triangles);
  data["outlines"] = base64_of(surface.outlines);
  data["surfaceOfTriangle"] = base64_of(surface.surface);
  data["values"] = packed_bands(surface, data);
  std::vector<std::uint8_t> map;
  for (int k = 0; k < 256; ++k)
    for (const std::uint8_t v : sequential_colour(k / 255.0)) map.push_back(v);
  data["colourMap"] = detail::base64_encode(map);
  return data;
}

void fill_in(std::string& page, const std::string& place, const std::string& text) {
  const std::size_t at = page.find(place);
  if (at == std::string::npos) throw std::logic_error("the template lacks " + place);
  page.replace(at, place.size(), text);
}

// "</script>" in a string would end the script that holds it.
std::string in_script(std::string text) {
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3)
    text.replace(at, 2, "<\\/");
  return text;
}

}  // namespace

std::string walkthrough_html(const Prediction& prediction, const Observer& observer,
                             const std::string& source) {
  const json data = solution_json(prediction, observer, source);
  std::string page = embedded::kWalkthroughPage;
  fill_in(page, "{{source}}", xml_escape(source));
  fill_in(page, "{{style}}", embedded::kWalkthroughStyle);
  fill_in(page, "{{data}}", in_script(data.dump(-1, ' ', true, json::error_handler_t::replace)));
  fill_in(page, "{{three}}", in_script(embedded::kThree));
  fill_in(page, "{{controls}}", in_script(embedded::kOrbitControls));
  fill_in(page, "{{script}}", in_script(embedded::kWalkthroughScript));
  return page;
}

}  // namespace truebox
