// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/identifiability.h"
#include "fit/response_curve.h"
#include "fit/scene_model.h"

namespace truebox {

/// Each unknown is held at its value, left free, or free with a known value and its u.
enum class Hold { fixed, free, prior };

/// What is known of a spectrum before: the mean and the covariance of spectra of its kind.
struct SpectralPrior {
  Eigen::VectorXd mean;        ///< one a band
  Eigen::MatrixXd covariance;  ///< bands x bands, positive definite
};

/// Mean and covariance of measured spectra (rows: spectra, columns: bands), `floor_u`^2 added to
/// the diagonal for what so few spectra cannot tell. The same as fitting their principal components
/// with their variances, and no number of components to choose.
SpectralPrior prior_of_spectra(const Eigen::MatrixXd& spectra, double floor_u);

/// How a reflectance spectrum is made of its coefficients, each in [0, 1): they are partitions of
/// unity, so that the spectrum stays in [0, 1) too.
enum class SpectralBasis { bands, constant, linear, bspline };

/// bands x coefficients. `count`: knots of `linear`, at least 2; coefficients of the cubic
/// `bspline`, at least 4. Source: de Boor (1978), A Practical Guide to Splines, ch. IX.
Eigen::MatrixXd spectral_basis(SpectralBasis basis, int count, const WavelengthGrid& bands);

struct ReflectanceChoice {
  Hold hold = Hold::fixed;
  double standard_uncertainty = 0.0;  ///< of the scene's values, if `prior`
  SpectralBasis basis = SpectralBasis::bands;
  int count = 0;
  double curvature_u = 0.0;  ///< standard deviation of second differences; 0: no such prior
  std::optional<SpectralPrior> spectra;
  std::optional<std::size_t> same_as;  ///< takes another material's reflectance
};

struct EmissionChoice {
  Hold hold = Hold::fixed;
  bool each_band = false;  ///< a factor for each band instead of one for all
  double relative_u = 0.0;
};

struct ResponseChoice {
  Hold hold = Hold::free;
  int segments = 1;
  double decades = 2.0;
  double white = 1.0;    ///< reading and exposure at which the curve is anchored
  double gamma_u = 0.0;  ///< of each local gamma about 1, if `prior`
};

/// The strength of a material's gloss (see GlossLobe), one for all bands, 0 <= k < 1.
struct GlossChoice {
  Hold hold = Hold::fixed;
  double value = 0.0;
  double standard_uncertainty = 0.0;
};

/// An unknown that moves cameras or surfaces, linear about where the model was built:
///   B = B(at) (1 + relative (value - at)), block by block and band by band.
struct ShapeTerm {
  ParameterName name;
  std::string unit;
  Hold hold = Hold::free;
  double at = 0.0;
  double known = 0.0, standard_uncertainty = 0.0;  ///< if `prior`
  double low = 0.0, high = 0.0;                    ///< how far the straight line is trusted
  double size = 1.0;                               ///< a large change of it
  BandMatrix relative;                             ///< blocks x bands
};

/// The mean reading of a block of pixels; u of that mean, errors of its own only.
struct BlockReading {
  std::size_t block = 0;  ///< into SceneModel::blocks()
  double value = 0.0;
  double standard_uncertainty = 0.0;
};

/// One plane of one photograph: reading = response(gain * sum_b w_b L_b), L = B / pi.
struct PlaneReadings {
  std::string name;
  std::size_t view = 0;
  Eigen::VectorXd band_weights;  ///< one a band of the scene
  Hold gain = Hold::fixed;
  double gain_value = 1.0;
  double gain_relative_u = 0.0;  ///< of the exposure: common to all pixels of the plane
  std::vector<BlockReading> readings;
};

struct SceneFitProblem {
  const SceneModel* model = nullptr;
  std::vector<ReflectanceChoice> reflectances;  ///< one a material of the scene
  std::vector<EmissionChoice> emissions;        ///< one a luminaire of the model
  std::vector<PlaneReadings> planes;
  std::optional<ResponseChoice> response;  ///< one curve for all planes
  std::vector<GlossChoice> gloss;          ///< one a material, or empty: none
  std::vector<ShapeTerm> shape;
  /// Relative standard uncertainty that all readings of a surface in a plane share (what the model
  /// is wrong by); surfaces x planes, or empty.
  BandMatrix region_relative_u;
  bool interreflection = true;

  std::size_t readings() const;
  /// Why this cannot be fitted; empty if it can.
  std::string invalid() const;
};

}  // namespace truebox
