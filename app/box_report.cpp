// SPDX-License-Identifier: BSD-3-Clause
#include "box_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "colour/colour_pipeline.h"
#include "figures/line_plot.h"
#include "figures/score_plot.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "sensor/visible_surfaces.h"

namespace truebox::app {
namespace {

constexpr double kShownBand_nm = 552.0;

// A normal distribution leaves 0.27 % beyond three standard errors. Those of the path tracer are
// estimated from 1024 paths themselves: in dark pixels they come out too small when a rare bright
// path was missed, so twice the normal share is allowed.
constexpr double kAllowedOutside = 0.006;

const std::vector<float>& band(const Image& image, double nm) {
  const SpectralChannels bands = spectral_channels(image);
  std::size_t best = 0;
  for (std::size_t k = 0; k < bands.indices.size(); ++k)
    if (std::abs(bands.wavelengths_nm[k] - nm) < std::abs(bands.wavelengths_nm[best] - nm))
      best = k;
  return image.channels[bands.indices[best]].samples;
}

struct IndependentRender {
  Image radiance, standard_error;
};

Image with_colour(Image image, const Observer& observer) {
  std::erase_if(image.channels,
                [](const Channel& c) { return spectral_channel_wavelength_nm(c.name) < 0.0; });
  add_display_channels(image, WavelengthGrid::from_centres(spectral_channels(image).wavelengths_nm),
                       observer);
  return image;
}

/// The numbers behind the pictures: the prediction with its bound, the path tracer with its
/// standard error, and which surface each pixel shows.
ImageSet numbers_behind(const Predicted& predicted, const RenderedImage& image,
                        const IndependentRender& other, const Observer& observer, double exposure) {
  CameraDescription camera = predicted.scene.cameras.at("front");
  camera.pixels = {image.radiance.width, image.radiance.height};
  const std::vector<int> surfaces = visible_surfaces(*predicted.prediction, Camera(camera));
  const Image prediction = matching_bands(image.radiance, other.radiance);
  const Image bound = matching_bands(image.error_bound, other.radiance);
  ImageSetOptions options;
  options.exposure = exposure;
  options.observer = &observer;
  options.surface_of_pixel = surfaces;
  for (const Surface& s : predicted.scene.surfaces) options.surfaces.push_back(s.name);
  return make_image_set({"Prediction (simulated)", &prediction, &bound, UncertaintyKind::bound},
                        {"Path tracer (simulated)", &other.radiance, &other.standard_error},
                        options);
}

PictureRow comparison_row(const Predicted& predicted, const RenderedImage& image,
                          const IndependentRender& other, const Observer& observer,
                          const ColourPipeline& colour, std::vector<float>& z) {
  const Image reference = with_colour(other.radiance, observer);
  const Image prediction = with_colour(matching_bands(image.radiance, other.radiance), observer);
  const double exposure = exposure_for_quantile(reference.find("R")->samples, 0.95);  // warm lamp
  const auto a = colour.picture(reference, exposure), b = colour.picture(prediction, exposure);
  const auto &value = band(prediction, kShownBand_nm), &truth = band(reference, kShownBand_nm),
             &error = band(other.standard_error, kShownBand_nm);
  z.clear();
  std::vector<float> map(value.size(), 0.0f);
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!(error[i] > 0.0f)) continue;
    map[i] = (value[i] - truth[i]) / error[i];
    z.push_back(map[i]);
  }
  PictureRow row;
  row.panels.push_back({"Independent path tracer (simulated)",
                        plain_picture(a.width, a.height, a.rgb, a.note),
                        "path-traced picture of the Cornell Box, noisy"});
  row.panels.push_back({"Prediction (simulated)", plain_picture(b.width, b.height, b.rgb, b.note),
                        "radiosity picture of the Cornell Box, free of noise"});
  row.panels.push_back({fmt::format("Signed difference, {:.0f} nm", kShownBand_nm),
                        signed_false_colour(prediction.width, prediction.height, map, 4.0,
                                            "prediction - path tracer, in standard errors", "1"),
                        "difference in standard errors of the path tracer"});
  row.caption =
      "The published Cornell Box, both simulated, by programs that share no code: seven bands, one "
      "exposure. Grain in the difference is the path tracer's noise. Structure is error: at the "
      "feet of "
      "the blocks indirect light falls off faster than the elements resolve, and the bound below "
      "is "
      "largest there.";
  row.image_set = numbers_behind(predicted, image, other, observer, exposure);
  return row;
}

PictureRow bound_row(const RenderedImage& image) {
  const auto& value = band(image.radiance, kShownBand_nm);
  const auto& bound = band(image.error_bound, kShownBand_nm);
  std::vector<float> percent(value.size(), 0.0f);
  for (std::size_t i = 0; i < value.size(); ++i)
    if (value[i] > 0.0f) percent[i] = 100.0f * bound[i] / value[i];
  PictureRow row;
  row.panels.push_back(
      {fmt::format("Radiance, {:.0f} nm", kShownBand_nm),
       false_colour(image.radiance.width, image.radiance.height, value,
                    {0.0, value_range(value, 0.05).high}, "radiance", "W m^-2 sr^-1 nm^-1"),
       "false colour picture of the radiance"});
  row.panels.push_back({"Its error bound",
                        false_colour(image.radiance.width, image.radiance.height, percent,
                                     {0.0, 5.0}, "bound / radiance", "%"),
                        "error bound of each pixel in percent of its radiance"});
  row.caption =
      "The bound is largest where indirect light changes fastest: along contact lines, in deep "
      "shadow, and in pixels that an edge crosses.";
  return row;
}

Table group_table(const std::vector<AccuracyCheck>& checks) {
  struct Group {
    std::size_t count = 0, failed = 0;
    std::vector<double> digits;
  };
  std::map<std::string, Group> groups;
  for (const AccuracyCheck& c : checks) {
    Group& g = groups[c.group];
    ++g.count;
    g.failed += !c.passed();
    g.digits.push_back(matching_digits(c.computed, c.certified));
  }
  Table table{"The program against closed forms and certified values, in matching digits",
              {{"Group"},
               {"Checks"},
               {"Failed"},
               {"Fewest digits", "1", 1, true},
               {"Median digits", "1", 1, true},
               {"Outcome"}},
              {}};
  for (auto& [name, g] : groups) {
    std::sort(g.digits.begin(), g.digits.end());
    table.rows.push_back({name, std::to_string(g.count), std::to_string(g.failed), g.digits.front(),
                          g.digits[g.digits.size() / 2],
                          Cell(g.failed ? Agreement::fails : Agreement::agrees)});
  }
  return table;
}

Table probe_table(const std::vector<AccuracyCheck>& checks) {
  Table table{fmt::format("Irradiance at 34 points, {:.0f} nm: prediction against path tracing",
                          kShownBand_nm),
              {{"Point"},
               {"Prediction", "W m^-2 nm^-1", 5},
               {"Path tracer", "W m^-2 nm^-1", 5},
               {"Difference", "%", 3, true},
               {"Allowed", "%", 3, true},
               {"Outcome"}},
              {}};
  const std::string mark = fmt::format(", {:.0f} nm", kShownBand_nm);
  for (const AccuracyCheck& c : checks) {
    if (c.group != "cornellbox" || !c.name.ends_with(mark)) continue;
    table.rows.push_back({c.name.substr(0, c.name.size() - mark.size()), c.computed, c.certified,
                          100.0 * (c.computed / c.certified - 1.0), 100.0 * c.allowed / c.certified,
                          Cell(c.passed() ? Agreement::agrees : Agreement::fails)});
  }
  return table;
}

// Lines "topic: what" of the solve's own description as rows.
Table plan_table(const Predicted& predicted) {
  Table table{"Decisions and what the solve did", {{"Topic"}, {"What"}}, {}};
  std::istringstream text(describe(predicted));
  for (std::string line; std::getline(text, line);) {
    const std::size_t begin = line.find_first_not_of(' '), colon = line.find(": ");
    if (begin == std::string::npos) continue;
    if (colon == std::string::npos)
      table.rows.push_back({"grid", line.substr(begin)});
    else
      table.rows.push_back({line.substr(begin, colon - begin), line.substr(colon + 2)});
  }
  return table;
}

Figure wall_spectra(const Predicted& predicted) {
  LinePlot plot{
      "Mean radiosity of surfaces", {"wavelength", "nm"}, {"radiosity", "W m^-2 nm^-1"}, {}};
  for (const SurfaceMean& mean : surface_means(*predicted.prediction)) {
    if (mean.surface != "floor" && mean.surface != "back_wall" && mean.surface != "left_wall" &&
        mean.surface != "right_wall")
      continue;
    PlotSeries series{mean.surface, {}, {}};
    for (std::size_t b = 0; b < predicted.scene.bands.size(); ++b) {
      series.x.push_back(predicted.scene.bands.centre_nm(b));
      series.y.push_back(mean.radiosity[static_cast<Eigen::Index>(b)]);
      series.u_y.push_back(mean.radiosity_bound[static_cast<Eigen::Index>(b)]);
    }
    plot.series.push_back(std::move(series));
  }
  return {
      "Mean radiosity", to_svg(plot),
      "76 bands solved in one pass; the ribbon is the error bound. The lamp's table has no unit: "
      "its numbers are taken as W m^-2 nm^-1."};
}

}  // namespace

ReportPart box_report(const Predicted& predicted, const RenderedImage& image,
                      const std::vector<AccuracyCheck>& accuracy,
                      const std::filesystem::path& reference_dir) {
  const auto folder = reference_dir / "independent_renders";
  const IndependentRender other{read_image(folder / "cornell_box_front_256_7bands.exr"),
                                read_image(folder / "cornell_box_front_256_7bands_stderr.exr")};
  const Observer observer =
      read_observer(reference_dir / "colour" / "cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
  const ColourPipeline colour;
  const RenderAgreement agreement =
      render_agreement(image.radiance, image.error_bound, other.radiance, other.standard_error);

  ReportPart report;
  std::size_t failed = 0;
  for (const AccuracyCheck& c : accuracy) failed += !c.passed();
  report.checks.push_back(
      {"closed forms and certified values: failed checks",
       failed == 0 ? Agreement::agrees : Agreement::fails, static_cast<double>(failed), 0.0, "",
       fmt::format("of {}; `truebox validate --details` lists them", accuracy.size())});
  report.checks.push_back(
      {"Cornell Box render: samples outside own bound + 3 standard errors",
       agreement.share_outside() <= kAllowedOutside ? Agreement::agrees : Agreement::fails,
       100.0 * agreement.share_outside(), 100.0 * kAllowedOutside, "%",
       fmt::format("{} of {} pixel-bands; mean z {:.2f}, rms z {:.2f}", agreement.outside,
                   agreement.samples, agreement.mean_z, agreement.rms_z)});
  report.checks.push_back({"Cornell Box render: mean error bound / mean radiance",
                           agreement.mean_bound < 0.01 ? Agreement::agrees : Agreement::fails,
                           100.0 * agreement.mean_bound, 1.0, "%",
                           fmt::format("solved in {:.1f} s", predicted.seconds)});

  std::vector<float> z;
  Section box{"The Cornell Box as measured, predicted", {}};
  box.blocks.push_back(comparison_row(predicted, image, other, observer, colour, z));
  box.blocks.push_back(bound_row(image));
  const std::vector<double> scores(z.begin(), z.end());
  box.blocks.push_back(Figure{
      "z of every pixel", z_histogram_svg("(prediction - path tracer) / standard error", scores),
      fmt::format("{:.0f} nm; a normal distribution is what pure noise would leave.",
                  kShownBand_nm)});
  box.blocks.push_back(wall_spectra(predicted));
  Section plan{"What was modelled, and how", {plan_table(predicted)}};
  report.sections = {
      std::move(box),
      std::move(plan),
      {"Is the equation solved right?", {group_table(accuracy), probe_table(accuracy)}}};
  report.sentence = fmt::format(
      "the predicted Cornell Box agrees with independent path tracing (bias {:+.2f} %, bound "
      "{:.2f} %)",
      100.0 * agreement.bias, 100.0 * agreement.mean_bound);
  if (worst_outcome(report.checks) == Agreement::fails)
    report.sentence = fmt::format(
        "the prediction of the Cornell Box fails: {} of {} certified checks, {:.2f} % of "
        "pixel-bands "
        "outside the bound",
        failed, accuracy.size(), 100.0 * agreement.share_outside());
  report.provenance = {
      {"Scene", predicted.scene.path},
      {"Cornell Box data",
       "Cornell University Program of Computer Graphics, Cornell Box data page"},
      {"Independent render",
       "brute-force path tracing, 1024 paths a pixel, no shared code (simulated)"}};
  return report;
}

}  // namespace truebox::app
