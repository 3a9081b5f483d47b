// SPDX-License-Identifier: BSD-3-Clause
#include "document/image_set_json.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "document/codecs.h"
#include "figures/text.h"

namespace truebox::detail {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kKinds[] = {"none", "standard", "bound"};

UncertaintyKind kind(const Json& json) {
  for (int k = 0; k < 3; ++k)
    if (json == kKinds[k]) return static_cast<UncertaintyKind>(k);
  throw std::invalid_argument("no kind of uncertainty is called " + json.dump());
}

double finite(const Json& json) {
  const auto value = json.get<double>();
  if (!std::isfinite(value)) throw std::invalid_argument("an image set with an infinite number");
  return value;
}

int exponent(const Json& json) {
  const int value = json.get<int>();
  if (std::abs(value) > 200) throw std::invalid_argument("a scale no float has");
  return value;
}

}  // namespace

std::string image_set_text(const ImageSet& set) {
  Json bands = Json::array(), surfaces = Json::array();
  for (const auto& b : set.bands)
    bands.push_back({{"name", valid_text(b.name)},
                     {"wavelength_nm", b.wavelength_nm},
                     {"linear_rgb", b.linear_rgb}});
  for (const auto& s : set.surfaces) surfaces.push_back(valid_text(s));
  const Json json = {{"width_px", set.width_px},
                     {"height_px", set.height_px},
                     {"stride", set.stride},
                     {"quantity", valid_text(set.quantity)},
                     {"unit", valid_text(set.unit)},
                     {"test_name", valid_text(set.test_name)},
                     {"reference_name", valid_text(set.reference_name)},
                     {"test_uncertainty", kKinds[static_cast<int>(set.test_uncertainty)]},
                     {"reference_uncertainty", kKinds[static_cast<int>(set.reference_uncertainty)]},
                     {"exposure", set.exposure},
                     {"bands", bands},
                     {"scale_exponents", set.scale_exponents},
                     {"surfaces", surfaces},
                     {"packed_base64", base64_encode(set.packed)}};
  return json.dump();
}

ImageSet image_set_from_text(const std::string& text) {
  const Json json = Json::parse(text);
  const auto string = [&](const char* key) { return json.at(key).get<std::string>(); };
  ImageSet set;
  set.width_px = json.at("width_px").get<int>();
  set.height_px = json.at("height_px").get<int>();
  set.stride = json.at("stride").get<int>();
  set.quantity = string("quantity");
  set.unit = string("unit");
  set.test_name = string("test_name");
  set.reference_name = string("reference_name");
  set.test_uncertainty = kind(json.at("test_uncertainty"));
  set.reference_uncertainty = kind(json.at("reference_uncertainty"));
  set.exposure = finite(json.at("exposure"));
  if (set.exposure <= 0.0) throw std::invalid_argument("an exposure that is not positive");
  for (const auto& b : json.at("bands")) {
    ImageBand band{b.at("name").get<std::string>(), finite(b.at("wavelength_nm"))};
    const Json& rgb = b.at("linear_rgb");
    for (std::size_t c = 0; c < 3; ++c) band.linear_rgb[c] = finite(rgb.at(c));
    set.bands.push_back(std::move(band));
  }
  for (const auto& e : json.at("scale_exponents")) set.scale_exponents.push_back(exponent(e));
  for (const auto& s : json.at("surfaces")) set.surfaces.push_back(s.get<std::string>());
  auto packed = base64_decode(string("packed_base64"));
  if (!packed) throw std::invalid_argument("packed_base64 is no base64");
  set.packed = std::move(*packed);
  if (const std::string objection = image_set_objection(set); !objection.empty())
    throw std::invalid_argument(objection);
  return set;
}

}  // namespace truebox::detail
