// SPDX-License-Identifier: BSD-3-Clause
// Spectroradiometer readings in a physical box of 0.30 m, where they are at hand:
// TRUEBOX_LOCAL_DATA names the folder that holds iset_cornellbox/ (data of Lyu, Goossens, Wandell
// and Farrell, arXiv 2201.07411; no licence to redistribute).
//
// A sheet is read as the lit box's back wall and again outside the box, beside a white sheet both
// times. The ratio of the two ratios is what interreflection does, whatever the light and the
// meter's scale: one without it. The labels do not say how the sheets were put up; that they took
// the whole back wall's place is read from "redbackwall".
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "fit/scene_model.h"
#include "radiometry/table_file.h"
#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

enum MaterialIndex : std::size_t { kLamp, kWhite, kRed, kGreen, kBack };
// 440 to 700 nm by 20: at 400 nm two readings of the white wall differ by 27 %.
constexpr Index kBands = 14;
double band_nm(Index band) { return 440.0 + 20.0 * static_cast<double>(band); }

/// Means of the readings within 7.5 nm of each band's centre.
VectorXd column(const TableFile& table, const std::string& name) {
  const std::size_t c = table.column_index(name);
  VectorXd mean = VectorXd::Zero(kBands);
  for (Index b = 0; b < kBands; ++b) {
    double count = 0.0;
    for (std::size_t row = 0; row < table.rows.size(); ++row)
      if (std::abs(table.number(row, 0) - band_nm(b)) < 7.6) {
        mean[b] += table.number(row, c);
        count += 1.0;
      }
    mean[b] /= count;
  }
  return mean;
}

VectorXd log_ratio(const VectorXd& a, const VectorXd& b) {
  return (a.array() / b.array()).log().matrix();
}

/// The published model without its clearances of 0.3 mm. The back wall is cut so that a spot of
/// 0.1 m in its middle is a surface of its own; the front is open.
Scene box(bool with_blocks) {
  Scene scene;
  std::vector<double> centres;
  for (Index b = 0; b < kBands; ++b) centres.push_back(band_nm(b));
  scene.bands = WavelengthGrid::from_centres(centres);
  for (const char* name : {"lamp", "white", "red", "green", "back"})
    scene.materials.push_back({name, Reflectance(centres.size(), 0.0),
                               RadiantExitance(centres.size(), name[0] == 'l' ? 1.0 : 0.0)});
  const double a = 0.15, h = 0.3, l = 0.02, low = 0.1, high = 0.2, p = 0.05;
  const auto add = [&](const char* name, std::size_t material, Polygon q, const Vec3& inner,
                       bool is_seen_from_inner) {
    if (((q[1] - q[0]).cross(q[2] - q[0]).dot(inner - q[0]) > 0.0) != is_seen_from_inner)
      q = Polygon(q.rbegin(), q.rend());
    tiny::add_surface(scene, name, std::move(q), material);
  };
  const auto wall = [&](const char* name, std::size_t material, Polygon q) {
    add(name, material, std::move(q), Vec3(0.0, 0.15, 0.0), true);
  };
  wall("floor", kWhite, {{-a, 0, -a}, {a, 0, -a}, {a, 0, a}, {-a, 0, a}});
  wall("left", kRed, {{-a, 0, -a}, {-a, h, -a}, {-a, h, a}, {-a, 0, a}});
  wall("right", kGreen, {{a, 0, -a}, {a, h, -a}, {a, h, a}, {a, 0, a}});
  wall("ceiling right", kWhite, {{l, h, l}, {a, h, a}, {a, h, -a}, {l, h, -l}});
  wall("ceiling front", kWhite, {{l, h, -l}, {a, h, -a}, {-a, h, -a}, {-l, h, -l}});
  wall("ceiling left", kWhite, {{-l, h, -l}, {-a, h, -a}, {-a, h, a}, {-l, h, l}});
  wall("ceiling back", kWhite, {{-l, h, l}, {-a, h, a}, {a, h, a}, {l, h, l}});
  wall("lamp", kLamp, {{-l, h, l}, {-l, h, -l}, {l, h, -l}, {l, h, l}});
  wall("spot", kBack, {{-p, low, a}, {p, low, a}, {p, high, a}, {-p, high, a}});
  wall("back below", kBack, {{-a, 0, a}, {a, 0, a}, {a, low, a}, {-a, low, a}});
  wall("back above", kBack, {{-a, high, a}, {a, high, a}, {a, h, a}, {-a, h, a}});
  wall("back left", kBack, {{-a, low, a}, {-p, low, a}, {-p, high, a}, {-a, high, a}});
  wall("back right", kBack, {{p, low, a}, {a, low, a}, {a, high, a}, {p, high, a}});
  if (!with_blocks) return scene;
  const auto block = [&](const std::array<std::array<double, 2>, 4>& foot, double top) {
    Vec3 inner(0.0, 0.5 * top, 0.0);
    for (const auto& corner : foot) inner += 0.25 * Vec3(corner[0], 0.0, corner[1]);
    const auto at = [&](std::size_t k, double y) {
      return Vec3(foot[k % 4][0], y, foot[k % 4][1]);
    };
    add("block", kWhite, {at(0, top), at(1, top), at(2, top), at(3, top)}, inner, false);
    for (std::size_t k = 0; k < 4; ++k)
      add("block", kWhite, {at(k, 0), at(k + 1, 0), at(k + 1, top), at(k, top)}, inner, false);
  };
  block({{{.049999, -.015001}, {.085707, -.050001}, {.120707, -.014293}, {.084999, .020707}}}, .05);
  block({{{-.095, -.04}, {-.051698, -.015}, {-.076698, .028302}, {-.12, .003302}}}, .15);
  return scene;
}

/// The sheets as read outside: red and green relative to white, and white's level.
struct Sheets {
  VectorXd white, red_of_white, green_of_white;
};

/// The box as a spot meter sees it: one reading a surface.
class Box {
 public:
  explicit Box(bool with_blocks) : scene_(box(with_blocks)), model_(scene_, options()) {
    model_.add_surface_means();
  }
  /// Radiosity of the named surface under the lamp's unit exitance, `back` the back wall's rho.
  VectorXd read(const char* surface, const Sheets& sheets, const VectorXd& back,
                bool interreflection = true) const {
    SceneState state = model_.state();
    state.interreflection = interreflection;
    state.reflectance.row(kWhite) = sheets.white.transpose();
    state.reflectance.row(kRed) = sheets.white.cwiseProduct(sheets.red_of_white).transpose();
    state.reflectance.row(kGreen) = sheets.white.cwiseProduct(sheets.green_of_white).transpose();
    state.reflectance.row(kBack) = back.transpose();
    const BlockRadiosity all = model_.radiosity(state, nullptr);
    for (std::size_t i = 0; i < model_.blocks().size(); ++i)
      if (scene_.surfaces[model_.blocks()[i].surface].name == surface)
        return all.value.row(static_cast<Index>(i)).transpose();
    throw std::invalid_argument(surface);
  }
  /// ln of a sheet's reading as back wall to the white one's, over the ratio of their reflectances:
  /// 0 without interreflection.
  VectorXd effect(const char* surface, const Sheets& sheets, const VectorXd& of_white) const {
    const VectorXd sheet = sheets.white.cwiseProduct(of_white);
    return log_ratio(read(surface, sheets, sheet), read(surface, sheets, sheets.white)) -
           log_ratio(sheet, sheets.white);
  }

 private:
  // Four times as many move no figure of this file by more than 5e-4.
  static SceneModelOptions options() {
    SceneModelOptions options;
    options.elements = 700;
    return options;
  }
  Scene scene_;
  SceneModel model_;
};

double rms(const VectorXd& v) { return std::sqrt(v.squaredNorm() / static_cast<double>(v.size())); }
VectorXd shape(const VectorXd& v) { return v.array() - v.mean(); }

class SpectroradiometerBox : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TRUEBOX_LOCAL_DATA");
    const auto folder = std::filesystem::path(data ? data : "") / "iset_cornellbox";
    if (!data || !std::filesystem::exists(folder)) GTEST_SKIP() << "needs TRUEBOX_LOCAL_DATA";
    readings_ = read_table(folder / "spectroradiometer_raw_2020-12-11.csv");
    const TableFile reflectance = read_table(folder / "surface_reflectance.csv");
    const TableFile light = read_table(folder / "light_spd.csv");
    lamp_ = column(light, "BoxLampSPD_2020_11");
    october_ = column(light, "cboxIlluminant_2020_10");
    high_ = column(reflectance, "white");
    low_ = column(reflectance, "white_CBWhiteSurface");
  }
  VectorXd twice(const std::string& name) const {
    return 0.5 * (column(readings_, name + "-1") + column(readings_, name + "-2"));
  }
  /// Variance of ln(mean of two readings), by their difference.
  VectorXd repeat_variance(const std::string& name) const {
    const VectorXd a = column(readings_, name + "-1"), b = column(readings_, name + "-2");
    // One difference a band says little: pooled, relative to the root, as shot noise is.
    const VectorXd mean = 0.5 * (a + b);
    const double k = ((a - b).array().square() / (4.0 * mean.array())).mean();
    return (k / mean.array()).matrix();
  }
  Sheets sheets(const VectorXd& white) const {
    const VectorXd outside = twice("white-bothlights");
    return {white, twice("red-bothlights").cwiseQuotient(outside),
            twice("green-bothlights").cwiseQuotient(outside)};
  }

  TableFile readings_;
  VectorXd lamp_, october_, high_, low_;
};

/// ln of a sheet's ratio to white inside over that outside; what interreflection makes of it.
struct SheetReading {
  std::string name;
  VectorXd Sheets::*of_white;
  VectorXd seen, predicted;
  VectorXd u;            ///< standard uncertainty of seen - predicted
  MatrixXd covariance;   ///< of the same
  VectorXd fitted_over;  ///< ln of the ratio fitted inside over that outside
};

double chi2(const VectorXd& d, const MatrixXd& c) { return d.dot(c.ldlt().solve(d)); }

TEST_F(SpectroradiometerBox, ASheetAsBackWallAgainstTheSameOutside) {
  const Box empty(false), furnished(true);
  const Sheets middle = sheets(0.5 * (high_ + low_)), bright = sheets(high_), dim = sheets(low_);
  const VectorXd white = twice("cbox-whitebackwall");
  // Two lamp readings outside, at places that the record does not tell apart, differ by this; it
  // does not say at which of the two a sheet was read.
  const VectorXd place = log_ratio(column(readings_, "spd-11-Dec-2020-13-29-32"),
                                   column(readings_, "spd-11-Dec-2020-13-29-03"));
  const auto compared = [&](const std::string& name, const std::string& inside,
                            VectorXd Sheets::*of_white) {
    const VectorXd& q = middle.*of_white;
    SheetReading r{name, of_white, {}, {}, {}, {}, {}};
    r.seen = log_ratio(twice(inside), white) - q.array().log().matrix();
    r.predicted = empty.effect("spot", middle, q);
    r.covariance = (repeat_variance(inside) + repeat_variance("cbox-whitebackwall") +
                    repeat_variance(name + "-bothlights") + repeat_variance("white-bothlights"))
                       .asDiagonal();
    const auto common = [&](const VectorXd& v) { r.covariance += v * v.transpose(); };
    // White's level, anywhere between the two on record: rectangular.
    common((empty.effect("spot", bright, q) - empty.effect("spot", dim, q)) / std::sqrt(12.0));
    // Blocks in the box or not, and what the meter was aimed at: the same.
    common((furnished.effect("spot", middle, q) - r.predicted) / std::sqrt(3.0));
    common((empty.effect("back below", middle, q) - r.predicted) / std::sqrt(3.0));
    // Two sheets at one place in two cases of four, else apart either way: variance 1/2.
    common(std::sqrt(0.5) * place);
    // Gloss and stray light differ between the two set-ups: 0.005 of reflectance, assumed; the
    // first reflection of paper is 0.04.
    common(0.005 * (q.cwiseProduct(middle.white).cwiseInverse() - middle.white.cwiseInverse()));
    r.u = r.covariance.diagonal().cwiseSqrt();
    return r;
  };
  std::array<SheetReading, 2> all = {
      compared("red", "cbox-redbackwall", &Sheets::red_of_white),
      compared("green", "cbox-green-backwall", &Sheets::green_of_white)};

  // Red and green from the inside readings alone, walls and sheets of the same paint: the effect is
  // a weak function of them, so that substitution gains a factor of five a step.
  Sheets fit = middle;
  for (int step = 0; step < 8; ++step) {
    const Sheets last = fit;
    for (const SheetReading& r : all)
      (fit.*r.of_white).array() =
          (middle.*r.of_white).array() *
          (r.seen - empty.effect("spot", last, last.*r.of_white)).array().exp();
  }
  for (SheetReading& r : all) r.fitted_over = log_ratio(fit.*r.of_white, middle.*r.of_white);

  for (const SheetReading& r : all) {
    const VectorXd left = r.seen - r.predicted;
    const auto say = [&](const std::string& what, const VectorXd& v) {
      std::string text;
      for (const double x : v) text += std::to_string(x) + " ";
      RecordProperty(r.name + "_" + what, text);
    };
    // To first order the fitted E_n is the same: difference and u shrink alike, by how much the
    // effect itself follows the reflectance.
    const auto largest_en = [&](const VectorXd& d) {
      return (d.array().abs() / (2.0 * r.u.array())).maxCoeff();
    };
    say("seen", r.seen);
    say("predicted", r.predicted);
    // Another way to read the labels: the box's own side wall instead of a sheet in its back.
    const VectorXd as_side_wall =
        log_ratio(empty.read(r.name == "red" ? "left" : "right", middle, middle.white),
                  empty.read("spot", middle, middle.white)) -
        (middle.*r.of_white).array().log().matrix();
    RecordProperty(r.name + "_shape_left_as_side_wall",
                   std::to_string(rms(shape(r.seen - as_side_wall))));
    say("u", r.u);
    say("fitted_over_outside", r.fitted_over);
    RecordProperty(r.name + "_shape_left_with", std::to_string(rms(shape(left))));
    RecordProperty(r.name + "_shape_left_without", std::to_string(rms(shape(r.seen))));
    RecordProperty(r.name + "_level_left_with", std::to_string(left.mean()));
    RecordProperty(r.name + "_level_left_without", std::to_string(r.seen.mean()));
    RecordProperty(r.name + "_chi2_with", std::to_string(chi2(left, r.covariance)));
    RecordProperty(r.name + "_chi2_without", std::to_string(chi2(r.seen, r.covariance)));
    RecordProperty(r.name + "_largest_en_with", std::to_string(largest_en(left)));
    RecordProperty(r.name + "_largest_en_without", std::to_string(largest_en(r.seen)));
    EXPECT_LT(rms(shape(left)), rms(shape(r.seen))) << r.name;
    // No proof of interreflection: the place's uncertainty is wide enough for direct light too.
    EXPECT_LE(largest_en(left), 1.0) << r.name;
  }
}

TEST_F(SpectroradiometerBox, TheWhiteWallIsRedderThanItsLamp) {
  const Box empty(false);
  const auto reddening = [](const VectorXd& v) { return std::exp(v[kBands - 1] - v[3]); };
  const VectorXd wall = twice("cbox-whitebackwall");
  const VectorXd seen = log_ratio(wall, lamp_);
  RecordProperty("seen_november", std::to_string(reddening(seen)));
  // White targets in a lit box: they hold interreflection of their own, and show less than all.
  const double by_october = reddening(log_ratio(wall, october_));
  const double by_target = reddening(log_ratio(wall, twice("cbox-lights")));
  RecordProperty("seen_october", std::to_string(by_october));
  RecordProperty("seen_target", std::to_string(by_target));
  for (const auto& [name, white] : {std::pair{std::string("high"), high_}, {"low", low_}}) {
    const Sheets known = sheets(white);
    const VectorXd with = empty.read("spot", known, white).array().log();
    const VectorXd without = empty.read("spot", known, white, false).array().log();
    RecordProperty(name + "_with", std::to_string(reddening(with)));
    RecordProperty(name + "_without", std::to_string(reddening(without)));
    RecordProperty(name + "_left_with", std::to_string(rms(shape(seen - with))));
    RecordProperty(name + "_left_without", std::to_string(rms(shape(seen - without))));
    EXPECT_LT(rms(shape(seen - with)), rms(shape(seen - without))) << name;
    EXPECT_GT(std::min({reddening(seen), by_october, by_target}), reddening(without)) << name;
  }
}

}  // namespace
}  // namespace truebox
