// SPDX-License-Identifier: BSD-3-Clause
#include "chart_colour.h"

#include <cmath>

#include "difference/ciede2000.h"
#include "image/spectral_image.h"
#include "radiometry/table_file.h"

namespace truebox::app {

ChartColour::ChartColour(const ChartMeasurement& m, const std::filesystem::path& colour_dir)
    : measurement_(m) {
  std::vector<double> centres;
  for (const BandMeasurement& band : m.bands) centres.push_back(band.band.centre_nm.value);
  const auto grid = WavelengthGrid::from_centres(std::move(centres));
  const Observer observer = read_observer(colour_dir / "cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
  const auto light = spectrum_from_table(read_table(colour_dir / "cie_illuminants.csv"), "D65");
  weights_ = band_weights(grid, observer);
  double white = 0.0;
  for (std::size_t b = 0; b < weights_.size(); ++b) {
    const double power = light.band_mean(grid.centre_nm(b), grid.width_nm(b));
    weights_[b] = {power * weights_[b].X, power * weights_[b].Y, power * weights_[b].Z};
    white += weights_[b].Y;
  }
  for (Tristimulus& w : weights_) w = {w.X / white, w.Y / white, w.Z / white};
}

Tristimulus ChartColour::colour_of(const std::vector<double>& reflectance) const {
  Tristimulus sum;
  for (std::size_t b = 0; b < weights_.size(); ++b) {
    sum.X += reflectance[b] * weights_[b].X;
    sum.Y += reflectance[b] * weights_[b].Y;
    sum.Z += reflectance[b] * weights_[b].Z;
  }
  return sum;
}

Image ChartColour::composite(std::vector<float> ChartPlanes::*plane) const {
  const ChartPlanes& first = measurement_.bands.front().planes;
  Image image(first.width, first.height);
  for (const char* name : {"R", "G", "B"}) image.add_channel(name);
  std::vector<double> value(weights_.size());
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    for (std::size_t b = 0; b < value.size(); ++b)
      value[b] = (measurement_.bands[b].planes.*plane)[i];
    const LinearRgb rgb = linear_bt709(colour_of(value));
    for (std::size_t c = 0; c < 3; ++c) image.channels[c].samples[i] = static_cast<float>(rgb[c]);
  }
  return image;
}

/// All bands of photograph and prediction with their uncertainties, black outside the patches:
/// nothing is predicted there.
ImageSet ChartColour::numbers_behind(double exposure) const {
  const ChartPlanes& first = measurement_.bands.front().planes;
  Image sides[4];  // photograph, its u, prediction, its u
  for (Image& side : sides) side = Image(first.width, first.height);
  for (const BandMeasurement& band : measurement_.bands) {
    const ChartPlanes& p = band.planes;
    Channel* planes[4];
    const std::string name = spectral_channel_name(band.band.centre_nm.value);
    for (int k = 0; k < 4; ++k) planes[k] = &sides[k].add_channel(name);
    for (std::size_t i = 0; i < p.photograph.size(); ++i) {
      if (p.patch[i] == 0) continue;
      planes[0]->samples[i] = p.photograph[i];
      planes[1]->samples[i] = std::sqrt(p.photograph_variance[i]);
      planes[2]->samples[i] = p.prediction[i];
      planes[3]->samples[i] = std::sqrt(p.prediction_variance[i]);
    }
  }
  ImageSetOptions options;
  options.quantity = "reflectance x relative illumination";
  options.exposure = exposure;
  options.surfaces = measurement_.chart.patches;
  std::vector<int> patch_of_pixel;
  for (const int n : first.patch) patch_of_pixel.push_back(n - 1);
  options.surface_of_pixel = patch_of_pixel;
  ImageSet set = make_image_set({"Photograph", &sides[0], &sides[1]},
                                {"Prediction", &sides[2], &sides[3]}, options);
  for (std::size_t b = 0; b < set.bands.size(); ++b)
    set.bands[b].linear_rgb = linear_bt709(weights_[b]);
  return set;
}

PictureRow ChartColour::pictures(const ColourPipeline& pipeline) const {
  const Image photograph = composite(&ChartPlanes::photograph);
  const Image prediction = composite(&ChartPlanes::prediction);
  const double exposure = exposure_for_quantile(prediction.find("G")->samples, 0.99);
  const auto a = pipeline.picture(photograph, exposure), b = pipeline.picture(prediction, exposure);
  const BandMeasurement* middle = &measurement_.bands[measurement_.bands.size() / 2];
  std::vector<float> difference(photograph.pixel_count(), 0.0f);
  for (std::size_t i = 0; i < difference.size(); ++i)
    if (middle->planes.patch[i] != 0)
      difference[i] = middle->planes.photograph[i] - middle->planes.prediction[i];
  PictureRow row;
  row.panels.push_back({"Photograph", plain_picture(a.width, a.height, a.rgb, a.note),
                        "the chart, seven narrow-band photographs combined under D65"});
  row.panels.push_back({"Prediction", plain_picture(b.width, b.height, b.rgb, b.note),
                        "the patches as spectrometer and fitted illumination predict them"});
  row.panels.push_back({"Photograph - prediction, " + middle->name,
                        signed_false_colour(photograph.width, photograph.height, difference, 0.05,
                                            "reflectance x relative illumination", "1"),
                        "signed difference inside the patches"});
  row.caption =
      "Colour from seven bands under CIE D65 for the CIE 1931 observer; one exposure for both. The "
      "colours are those of seven samples of a spectrum, not of the whole spectrum. Bottom row: "
      "the "
      "six grey standards, inputs of the fit.";
  row.image_set = numbers_behind(exposure);
  return row;
}

Table ChartColour::table() const {
  Table table{"Colour difference of the held-out patches, fitted against certified bands",
              {{"Patch"},
               {"L*", "1", 1, true},
               {"a*", "1", 1, true},
               {"b*", "1", 1, true},
               {"CIEDE2000", "1", 2, true}},
              {}};
  const Tristimulus white = colour_of(std::vector<double>(weights_.size(), 1.0));
  const auto& first = measurement_.bands.front().readings;
  for (std::size_t p = 0; p < first.size(); ++p) {
    if (first[p].standard) continue;
    std::vector<double> fitted, certified, u;
    for (const BandMeasurement& band : measurement_.bands) {
      fitted.push_back(band.readings[p].measured.value);
      certified.push_back(band.readings[p].reference.value);
      u.push_back(std::hypot(band.readings[p].measured.standard_uncertainty,
                             band.readings[p].reference.standard_uncertainty));
    }
    const Lab target = cielab(colour_of(certified), white);
    const auto difference_of = [&](const std::vector<double>& values) {
      return ciede2000(cielab(colour_of(values), white), target);
    };
    const double difference = difference_of(fitted);
    // Bands taken as independent, one standard uncertainty each (GUM 5.1.3, finite differences).
    double variance = 0.0;
    for (std::size_t b = 0; b < fitted.size(); ++b) {
      auto moved = fitted;
      moved[b] += u[b];
      variance += std::pow(difference_of(moved) - difference, 2);
    }
    const Lab lab = cielab(colour_of(fitted), white);
    table.rows.push_back(
        {first[p].patch, lab.L, lab.a, lab.b, Cell(difference, std::sqrt(variance))});
  }
  return table;
}

}  // namespace truebox::app
