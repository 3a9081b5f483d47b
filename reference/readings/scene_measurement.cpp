// SPDX-License-Identifier: BSD-3-Clause
#include "readings/scene_measurement.h"

#include <algorithm>
#include <stdexcept>

#include "readings/toml_reader.h"

namespace truebox {
namespace {

using detail::TomlTable;

constexpr double kLargest = 1e12;
constexpr int kTile_px = 8;

std::string one_of(TomlTable& table, const std::string& key, const std::string& fallback,
                   const std::vector<std::string>& words) {
  const std::string word = table.text_or(key, fallback);
  if (std::find(words.begin(), words.end(), word) != words.end()) return word;
  std::string expected;
  for (const auto& w : words) expected += (expected.empty() ? "\"" : ", \"") + w + "\"";
  table.fail(key, "one of " + expected, "\"" + word + "\"");
}

/// `fit` and, with "prior", `u`.
void read_choice(TomlTable& table, UnknownChoice& choice, double largest_u) {
  choice.fit = one_of(table, "fit", "free", {"fixed", "free", "prior"});
  if (choice.fit != "prior") return;
  choice.standard_uncertainty = table.number("u", 0.0, largest_u);
  if (!(choice.standard_uncertainty > 0.0))
    table.fail("u", "a standard uncertainty above 0 beside fit = \"prior\"", "0");
}

bool read_flag(TomlTable& table, const std::string& key, bool fallback) {
  return one_of(table, key, fallback ? "yes" : "no", {"yes", "no"}) == "yes";
}

/// `fit` and, with "prior", the named uncertainties.
void read_unknown(TomlTable& table, UnknownChoice& choice, const std::string& u_key) {
  choice.fit = one_of(table, "fit", "free", {"fixed", "free", "prior"});
  if (choice.fit == "prior") choice.standard_uncertainty = table.number(u_key, 1e-12, kLargest);
}

GlossChoiceText read_gloss(TomlTable table) {
  GlossChoiceText gloss;
  read_choice(table, gloss, 1.0);
  gloss.value = table.number_or("value", 0.0, 0.0, 0.999999);
  gloss.roughness = table.number_or("roughness", gloss.roughness, 0.05, 1.0);
  table.finish();
  return gloss;
}

CameraUnknowns read_camera(TomlTable table) {
  CameraUnknowns camera;
  camera.line = table.line();
  if (table.has("pose")) {
    TomlTable pose = table.table("pose");
    read_unknown(pose, camera.pose, "u_rad");
    camera.pose_u_rad = camera.pose.standard_uncertainty;
    if (camera.pose.fit == "prior") camera.pose_u_mm = pose.number("u_mm", 1e-12, kLargest);
    pose.finish();
  }
  const auto read = [&](const char* key, UnknownChoice& choice, const char* u_key) {
    if (!table.has(key)) return;
    TomlTable item = table.table(key);
    read_unknown(item, choice, u_key);
    item.finish();
  };
  read("focal_length", camera.focal_length, "u_mm");
  read("principal_point", camera.principal_point, "u_px");
  if (table.has("distortion")) {
    TomlTable distortion = table.table("distortion");
    read_unknown(distortion, camera.distortion, "u");
    camera.distortion_terms =
        distortion.has("terms") ? distortion.texts("terms") : std::vector<std::string>{"k1", "k2"};
    for (const std::string& term : camera.distortion_terms)
      if (term != "k1" && term != "k2" && term != "p1" && term != "p2" && term != "k3")
        distortion.fail("terms", "of \"k1\", \"k2\", \"p1\", \"p2\", \"k3\"", "\"" + term + "\"");
    distortion.finish();
  }
  table.finish();
  return camera;
}

OffsetChoice read_offset(TomlTable table) {
  OffsetChoice offset;
  offset.line = table.line();
  offset.name = table.text("name");
  offset.surfaces = table.texts("surfaces");
  if (table.has("move") == table.has("stretch"))
    table.fail("move", "either move or stretch", table.has("move") ? "both" : "neither");
  if (table.has("move")) offset.move = table.numbers("move", 3);
  if (table.has("stretch")) offset.stretch = table.numbers("stretch", 3);
  if (table.has("about")) offset.about = table.numbers("about", 3);
  read_unknown(table, offset, offset.move.empty() ? "u" : "u_mm");
  table.finish();
  return offset;
}

MaterialChoice read_material(TomlTable table) {
  MaterialChoice choice;
  choice.line = table.line();
  if (table.has("same_as")) {
    choice.same_as = table.text("same_as");
    table.finish();
    return choice;
  }
  read_choice(table, choice, 1.0);
  if (table.has("gloss")) choice.gloss = read_gloss(table.table("gloss"));
  choice.basis = one_of(table, "basis", "bands", {"bands", "constant", "linear", "bspline"});
  if (choice.basis == "linear") choice.count = table.integer("count", 2, 1000);
  if (choice.basis == "bspline") choice.count = table.integer("count", 4, 1000);
  choice.curvature_u = table.number_or("curvature_u", 0.0, 0.0, 1.0);
  if (table.has("start")) choice.start = table.number("start", 0.0, 0.999999);
  if (table.has("spectra")) {
    choice.spectra_path = table.existing_file("spectra");
    choice.spectra_floor_u = table.number_or("spectra_floor_u", 0.01, 1e-6, 1.0);
  }
  table.finish();
  return choice;
}

LampChoice read_lamp(TomlTable table) {
  LampChoice choice;
  choice.line = table.line();
  read_choice(table, choice, 10.0);
  choice.each_band = read_flag(table, "each_band", false);
  table.finish();
  return choice;
}

PlaneSource read_plane(TomlTable table, bool is_mosaic) {
  PlaneSource plane;
  plane.line = table.line();
  plane.channel = table.text("channel");
  plane.name = table.text_or("name", plane.channel);
  plane.variance_channel = table.text_or("variance_channel", "");
  if (is_mosaic) plane.photosites = one_of(table, "photosites", "", {"R", "G", "B"})[0];
  if (table.has("band_nm") == table.has("responsivity"))
    table.fail("band_nm", "either band_nm or responsivity",
               table.has("band_nm") ? "both" : "neither");
  if (table.has("band_nm")) plane.band_nm = table.number("band_nm", 1.0, 1e6);
  if (table.has("responsivity")) {
    TomlTable curve = table.table("responsivity");
    plane.responsivity_path = curve.existing_file("file");
    plane.responsivity_column = curve.text("column");
    curve.finish();
  }
  table.finish();
  return plane;
}

PhotographSource read_photograph(TomlTable table) {
  PhotographSource photo;
  photo.line = table.line();
  photo.path = table.existing_file("file");
  photo.camera = table.text("camera");
  if (table.has("mask")) photo.mask_path = table.existing_file("mask");
  if (table.has("variance")) photo.variance_path = table.existing_file("variance");
  if (table.has("standard_error"))
    photo.standard_error_path = table.existing_file("standard_error");
  photo.gain_value = table.number_or("gain", 1.0, 1e-12, kLargest);
  photo.gain.fit = one_of(table, "gain_fit", "free", {"fixed", "free", "prior"});
  if (photo.gain.fit == "prior")
    photo.gain.standard_uncertainty = table.number("exposure_u", 1e-9, 10.0);
  photo.scale = table.number_or("scale", 1.0, 1e-12, kLargest);
  photo.saturation = table.number_or("saturation", 0.0, 0.0, kLargest);
  photo.relative_u = table.number_or("relative_u", 0.0, 0.0, 10.0);
  photo.absolute_u = table.number_or("absolute_u", 0.0, 0.0, kLargest);
  photo.block_relative_u = table.number_or("block_relative_u", 0.0, 0.0, 10.0);
  photo.edge_relative_u = table.number_or("edge_relative_u", photo.edge_relative_u, 0.0, 10.0);
  if (table.has("bayer")) {
    const std::string pattern = table.text("bayer");
    try {
      photo.bayer.emplace(pattern);
    } catch (const std::invalid_argument&) {
      table.fail("bayer", "four of r, g, b with all three present", "\"" + pattern + "\"");
    }
    if (!table.has("planes"))
      table.fail("planes", "planes with photosites = \"R\", \"G\" or \"B\" beside bayer", "none");
  }
  bool has_variances = !photo.variance_path.empty() || !photo.standard_error_path.empty();
  if (table.has("planes")) {
    for (TomlTable& plane : table.tables("planes"))
      photo.planes.push_back(read_plane(std::move(plane), photo.bayer.has_value()));
    has_variances = has_variances ||
                    std::all_of(photo.planes.begin(), photo.planes.end(),
                                [](const auto& plane) { return !plane.variance_channel.empty(); });
  }
  if (!(photo.relative_u + photo.absolute_u + photo.block_relative_u > 0.0) && !has_variances)
    table.fail("relative_u",
               "an uncertainty of the readings: relative_u, absolute_u, block_relative_u or a "
               "file of variances or standard errors",
               "none");
  table.finish();
  return photo;
}

void read_model(TomlTable table, SceneMeasurementFile& m) {
  m.elements =
      static_cast<std::size_t>(table.has("elements") ? table.integer("elements", 6, 30000) : 1500);
  if (table.has("bands_nm")) m.bands_nm = table.integers("bands_nm", 1, 1000000);
  m.margin_px = table.has("margin_px") ? table.integer("margin_px", 0, 100) : 1;
  if (table.has("tile_px")) m.tile_px = table.integer("tile_px", 0, 100);
  m.interreflection = read_flag(table, "interreflection", true);
  m.model_bound = read_flag(table, "model_bound", true);
  m.robust_sigma = table.number_or("robust_sigma", 0.0, 0.0, 1e6);
  m.held_out_share = table.number_or("held_out_share", 0.0, 0.0, 0.9);
  table.finish();
}

}  // namespace

bool is_scene_measurement(const std::filesystem::path& path) {
  return TomlTable::parse(path).has("photographs");
}

SceneMeasurementFile read_scene_measurement(const std::filesystem::path& path) {
  TomlTable root = TomlTable::parse(path);
  SceneMeasurementFile m;
  m.path = path.string();
  m.title = root.text("title");
  m.simulated = read_flag(root, "simulated", false);
  m.provenance = {.source = root.text("source"),
                  .licence = root.text_or("licence", ""),
                  .unit = root.text_or("unit", "1"),
                  .uncertainty = "as stated for each photograph",
                  .use = Use::input};
  m.scene_path = root.existing_file("scene");
  if (root.has("cameras")) {
    TomlTable all = root.table("cameras");
    for (const std::string& name : all.keys())
      m.cameras.emplace(name, read_camera(all.table(name)));
  }
  if (root.has("offsets"))
    for (TomlTable& table : root.tables("offsets"))
      m.offsets.push_back(read_offset(std::move(table)));
  // What moves is known by its edges.
  if (!m.cameras.empty() || !m.offsets.empty()) m.tile_px = kTile_px;
  if (root.has("model")) read_model(root.table("model"), m);
  for (TomlTable& table : root.tables("photographs"))
    m.photographs.push_back(read_photograph(std::move(table)));
  if (root.has("reflectances")) {
    TomlTable all = root.table("reflectances");
    for (const std::string& name : all.keys())
      m.reflectances.emplace(name, read_material(all.table(name)));
  }
  if (root.has("emissions")) {
    TomlTable all = root.table("emissions");
    for (const std::string& name : all.keys())
      m.emissions.emplace(name, read_lamp(all.table(name)));
  }
  if (root.has("response")) {
    TomlTable table = root.table("response");
    m.response.emplace();
    read_choice(table, *m.response, 10.0);
    m.response->segments = table.has("segments") ? table.integer("segments", 1, 20) : 1;
    m.response->decades = table.number_or("decades", 2.0, 0.1, 6.0);
    table.finish();
  }
  if (root.has("surface_weights")) {
    TomlTable all = root.table("surface_weights");
    for (const std::string& name : all.keys())
      m.surface_weights.emplace(name, all.number(name, 0.0, 1e6));
  }
  root.finish();
  return m;
}

}  // namespace truebox
