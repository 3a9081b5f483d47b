// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "image/bayer.h"
#include "provenance/provenance.h"

namespace truebox {

/// What is said of one unknown: held as the scene has it, free, or free about a known value.
struct UnknownChoice {
  std::string fit = "fixed";          ///< "fixed", "free" or "prior"
  double standard_uncertainty = 0.0;  ///< of the known value, if "prior"
};

/// gloss = { ... } of a material: its strength, and how rough the lobe is.
struct GlossChoiceText : UnknownChoice {
  double value = 0.0;
  double roughness = 0.3;  ///< GGX alpha
};

/// [reflectances.NAME]: one material of the scene.
struct MaterialChoice : UnknownChoice {
  std::string basis = "bands";  ///< "bands", "constant", "linear" or "bspline"
  int count = 0;                ///< knots of "linear", coefficients of "bspline"
  double curvature_u = 0.0;
  std::string same_as;       ///< another material, or empty
  std::string spectra_path;  ///< table of measured reflectances as a prior, or empty
  double spectra_floor_u = 0.01;
  std::optional<double> start;  ///< where the search begins, instead of the scene's values
  std::optional<GlossChoiceText> gloss;
  int line = 0;
};

/// [cameras.NAME]: what of a camera of the scene is not known exactly; the known values are the
/// scene's.
struct CameraUnknowns {
  UnknownChoice pose;                        ///< six numbers
  double pose_u_rad = 0.0, pose_u_mm = 0.0;  ///< of each turn and each move, if "prior"
  UnknownChoice focal_length;                ///< u in mm
  UnknownChoice principal_point;             ///< u in px of the scene's camera
  UnknownChoice distortion;
  std::vector<std::string> distortion_terms;  ///< of k1, k2, p1, p2, k3
  int line = 0;
};

/// [[offsets]]: surfaces that stand elsewhere, or are larger, than the scene says, by an unknown
/// amount about 0.
struct OffsetChoice : UnknownChoice {  ///< u in mm of a move, relative of a stretch
  std::string name;
  std::vector<std::string> surfaces;  ///< names, with * and ? (fnmatch)
  std::vector<double> move, stretch;  ///< one of them has three numbers
  std::vector<double> about;          ///< of a stretch, in the scene's unit; empty: their middle
  int line = 0;
};

/// [emissions.NAME]: one luminous material; the known value is the scene's, u relative to it.
struct LampChoice : UnknownChoice {
  bool each_band = false;
  int line = 0;
};

/// One plane of a photograph: a linear reading of a band, or of all bands through a responsivity.
struct PlaneSource {
  std::string name;
  std::string channel;            ///< of the image file
  std::string variance_channel;   ///< of the same file, or empty
  std::optional<double> band_nm;  ///< a band of the scene
  std::string responsivity_path;  ///< or a table: wavelength in nm, then curves
  std::string responsivity_column;
  char photosites = 0;  ///< 'R', 'G' or 'B' of a mosaic; 0: all pixels
  int line = 0;
};

/// [[photographs]]: one image file, seen by one of the scene's cameras.
struct PhotographSource {
  std::string path, camera, mask_path;
  std::string variance_path, standard_error_path;  ///< of each pixel, channels named alike
  std::vector<PlaneSource> planes;  ///< empty: one for each band of the scene, by channel name
  UnknownChoice gain;               ///< one a plane; u relative: the exposure's
  double gain_value = 1.0;          ///< reading per radiance (W m^-2 sr^-1 nm^-1)
  double scale = 1.0;               ///< readings are multiplied by it
  double saturation = 0.0;          ///< readings at or above it are not used; 0: none is
  double relative_u = 0.0, absolute_u = 0.0;  ///< of a pixel, independent; beside any variance
  std::optional<BayerPattern> bayer;          ///< the image is a mosaic: nothing is interpolated
  double edge_relative_u = 0.01;  ///< of the mean of a square with an edge in it: light close to
                                  ///< edges, blur
  double block_relative_u = 0.0;  ///< of the mean of an element's pixels: texture, what the model
                                  ///< misses there; not averaged away
  int line = 0;
};

struct CameraResponseChoice : UnknownChoice {
  int segments = 1;
  double decades = 2.0;
};

/// A measurement of a scene as its author wrote it down (TOML). Paths are resolved against the
/// file.
struct SceneMeasurementFile {
  std::string path;
  std::string title;
  bool simulated = false;  ///< the photographs come from a program
  Provenance provenance;
  std::string scene_path;
  std::vector<PhotographSource> photographs;
  std::map<std::string, MaterialChoice> reflectances;
  std::map<std::string, LampChoice> emissions;
  std::map<std::string, CameraUnknowns> cameras;
  std::vector<OffsetChoice> offsets;
  std::optional<CameraResponseChoice> response;
  std::map<std::string, double> surface_weights;  ///< 0: not used; others scale 1 / u^2
  // [model]
  std::vector<int> bands_nm;  ///< centres of the scene's bands to use; empty: all
  std::size_t elements = 1500;
  int margin_px = 1;
  int tile_px = 0;              ///< side of squares that hold edges; 0: edges are left out
  bool consider_gloss = false;  ///< of every fitted material, for model selection
  bool interreflection = true;
  bool model_bound = true;  ///< the prediction's error bound enters the covariance
  double robust_sigma = 0.0;
  double held_out_share = 0.0;  ///< of the readings, predicted and not fitted
};

/// Whether the file measures a scene (key `photographs`), not a chart.
bool is_scene_measurement(const std::filesystem::path& path);

/// Reads and checks such a file; the files that it names are not opened, but must exist.
/// InputError names file and line, what was expected and what stands there; unknown keys are
/// errors.
SceneMeasurementFile read_scene_measurement(const std::filesystem::path& path);

}  // namespace truebox
