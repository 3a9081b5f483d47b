// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/path_tracer.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "path_tracer/fresnel.h"
#include "radiometry/table_file.h"
#include "support/path_rays.h"
#include "support/tiny_scenes.h"
#include "uncertainty/significance.h"

namespace truebox {
namespace {

using std::numbers::pi;

// Of one comparison; some forty of them in this file, so that chance fails the file once in 2500.
constexpr double kLeastP = 1e-5;

struct Measured {
  double mean = 0.0, standard_error = 0.0;
  int degrees = 15;

  double p(double truth) const {
    if (standard_error == 0.0) return std::abs(mean - truth) <= 1e-6 * truth ? 1.0 : 0.0;  // float
    return two_sided_p((mean - truth) / standard_error, degrees);
  }
};

Measured measure(const Scene& scene, const RayOfPixel& ray, int samples = 4096,
                 std::uint64_t seed = 1, std::size_t band = 0) {
  PathTraceOptions options;
  options.samples = samples;
  options.seed = seed;
  const PathTracedImage image = trace_paths(scene, 1, 1, ray, options);
  return {image.radiance.channels[band].samples[0],
          std::sqrt(image.variance.channels[band].samples[0]), image.randomisations - 1};
}

#define EXPECT_AGREES(measured, truth)                                       \
  do {                                                                       \
    const Measured m_ = (measured);                                          \
    EXPECT_GT(m_.p(truth), kLeastP)                                          \
        << m_.mean << " +- " << m_.standard_error << " against " << (truth); \
  } while (false)

Scene with_block(Scene scene, Material material) {
  scene.materials.push_back(std::move(material));
  tiny::add_box(scene, "block", {0.3, 0.35, 0.2}, {0.6, 0.7, 0.5}, false,
                scene.materials.size() - 1);
  return scene;
}

Material glass(double n) {
  Material m{"glass", Reflectance(1, 0.0), RadiantExitance(1, 0.0)};
  m.scattering = Scattering::dielectric;
  m.refractive_index = RefractiveIndex(1, n);
  return m;
}

const Vec3 kEye(0.1, 0.15, 0.8), kToBlock = Vec3(0.45, 0.5, 0.4) - kEye;

TEST(PathTracer, AFurnaceIsEquallyBrightEverywhere) {
  // E = 1, rho = 1/2: B = 2.
  EXPECT_AGREES(measure(tiny::cube(1.0, 0.5, 1.0), along(kEye, kToBlock)), 2.0 / pi);
  EXPECT_AGREES(measure(tiny::cube(1e-6, 0.5, 1.0), along(1e-6 * kEye, kToBlock)), 2.0 / pi);
  EXPECT_AGREES(measure(tiny::cube(1e6, 0.5, 1.0), along(1e6 * kEye, kToBlock)), 2.0 / pi);
}

TEST(PathTracer, ClearGlassInAFurnaceCannotBeSeen) {
  for (const double n : {1.0, 1.33, 1.5, 2.4})
    EXPECT_AGREES(measure(with_block(tiny::cube(1.0, 0.5, 1.0), glass(n)), along(kEye, kToBlock)),
                  2.0 / pi);
}

TEST(PathTracer, ABlockOfTheFurnacesOwnMaterialCannotBeSeen) {
  Scene scene = tiny::cube(1.0, 0.5, 1.0);
  tiny::add_box(scene, "block", {0.3, 0.35, 0.2}, {0.6, 0.7, 0.5}, false);
  EXPECT_AGREES(measure(scene, along(kEye, kToBlock)), 2.0 / pi);
}

TEST(PathTracer, ReproducesTheCeilingLitCube) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/ceiling_lit_cube.csv");
  int rows = 0;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    if (table.rows[row][0] != "cube_ceiling_light") continue;
    const bool dark = table.rows[row][1].find("rho=0.5") != std::string::npos;
    if (!dark && table.rows[row][1].find("rho=0.8") == std::string::npos) continue;
    Scene cube = tiny::cube(1.0, dark ? 0.5 : 0.8);
    cube.materials.push_back(cube.materials[0]);
    cube.materials[1].exitance = RadiantExitance(1, 1.0);
    cube.surfaces[1].material = 1;
    const std::string& what = table.rows[row][2];
    RayOfPixel ray;
    if (what == "mean B floor") ray = looking_down_on({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.5);
    if (what == "mean B ceiling") ray = looking_down_on({0, 0, 1}, {0, 1, 0}, {1, 0, 0}, 0.5);
    if (what == "mean B wall") ray = looking_down_on({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5);
    if (!ray) continue;
    ++rows;
    const Measured m = measure(cube, ray, 1 << 16);
    EXPECT_AGREES(m, table.number(row, 3) / pi);
    EXPECT_LT(m.standard_error, 0.004 * m.mean) << what << ": too noisy to say anything";
  }
  EXPECT_EQ(rows, 6);
}

TEST(PathTracer, ReproducesTheAreaSourceOfCie171) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/cie171_exact.csv");
  int rows = 0;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    if (!table.rows[row][0].starts_with("5.3")) continue;
    Vec3 p;
    ASSERT_EQ(std::sscanf(table.rows[row][2].c_str(), "%lf %lf %lf", &p.x(), &p.y(), &p.z()), 3);
    const bool on_floor = p.z() == 0.0;
    if (!on_floor && p.y() != 0.0) continue;
    ++rows;
    Scene room = tiny::grey_scene(0.0, 1000.0 * pi);
    tiny::add_surface(room, "lamp", {{1.5, 1.5, 3}, {1.5, 2.5, 3}, {2.5, 2.5, 3}, {2.5, 1.5, 3}});
    room.materials.push_back({"card", Reflectance(1, 0.5), RadiantExitance(1, 0.0)});
    const Vec3 u = 0.01 * Vec3::UnitX(), v = 0.01 * (on_floor ? Vec3::UnitY() : Vec3::UnitZ());
    const Vec3 n = on_floor ? Vec3::UnitZ() : Vec3::UnitY();
    Polygon card{p - u - v, p + u - v, p + u + v, p - u + v};
    if (area_vector(card).dot(n) < 0.0) std::reverse(card.begin(), card.end());
    tiny::add_surface(room, "card", card, 1);
    EXPECT_AGREES(
        measure(room, along(p + 0.2 * n + 0.1 * Vec3::UnitX(), -0.2 * n - 0.1 * Vec3::UnitX()),
                16384),
        0.5 / pi * table.number(row, 3));
  }
  EXPECT_GT(rows, 8);
}

TEST(PathTracer, SeesTheVirtualImageInAMirror) {
  Scene scene = tiny::grey_scene(0.0, 5.0);
  tiny::add_surface(scene, "lamp", {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  scene.materials.push_back({"mirror", Reflectance(1, 0.8), RadiantExitance(1, 0.0)});
  scene.materials[1].scattering = Scattering::mirror;
  tiny::add_surface(scene, "mirror", {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}}, 1);
  const Vec3 eye(3.0, 0.5, 0.7);
  // The image of the lamp is at z = -1; inside it the radiance is rho M / pi without any noise.
  for (const auto& [x, is_lit] :
       {std::pair{0.01, true}, {0.99, true}, {1.01, false}, {-0.01, false}}) {
    const Measured m = measure(scene, along(eye, Vec3(x, 0.5, -1.0) - eye), 64);
    EXPECT_NEAR(m.mean, is_lit ? 0.8 * 5.0 / pi : 0.0, 1e-6) << x;
    EXPECT_EQ(m.standard_error, 0.0);
  }
}

// E at a point of an upward horizontal element below a rectangle: Lambert's contour formula.
double factor_below(double x0, double x1, double y0, double y1, double height) {
  const auto corner = [&](double x, double y) {
    const double a = std::hypot(x, height), b = std::hypot(y, height);
    return 0.5 / pi * (x / a * std::atan2(y, a) + y / b * std::atan2(x, b));
  };
  return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
}

TEST(PathTracer, LightsAFloorBetweenMirrorsAsTheirVirtualLampsDo) {
  // Walls x = 0 and x = 1 are mirrors: lamp images at every whole number, weight rho^|k|.
  constexpr double kRho = 0.6;
  Scene scene = tiny::grey_scene(0.0, 1.0);
  tiny::add_surface(scene, "lamp", {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  scene.materials.push_back({"mirror", Reflectance(1, kRho), RadiantExitance(1, 0.0)});
  scene.materials[1].scattering = Scattering::mirror;
  scene.materials.push_back({"card", Reflectance(1, 0.5), RadiantExitance(1, 0.0)});
  tiny::add_surface(scene, "low", {{0, -9, 0}, {0, 9, 0}, {0, 9, 1}, {0, -9, 1}}, 1);
  tiny::add_surface(scene, "high", {{1, -9, 0}, {1, -9, 1}, {1, 9, 1}, {1, 9, 0}}, 1);
  tiny::add_surface(scene, "card", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 2);
  const double x = 0.3, y = 0.4;
  double e = 0.0;
  for (int k = -60; k <= 60; ++k)
    e += std::pow(kRho, std::abs(k)) * factor_below(k - x, k + 1 - x, -y, 1 - y, 1.0);
  EXPECT_AGREES(measure(scene, along({x, y, 0.5}, -Vec3::UnitZ()), 1 << 15), 0.5 / pi * e);
}

TEST(PathTracer, SeesALampThroughAPaneAsFresnelSays) {
  // Rays between the faces without end: T = (1 - F)^2 (1 + F^2 + ...) = (1 - F) / (1 + F).
  Scene scene = tiny::grey_scene(0.0, 1.0);
  tiny::add_surface(scene, "lamp", {{-50, -50, 1}, {-50, 50, 1}, {50, 50, 1}, {50, -50, 1}});
  scene.materials.push_back(glass(1.5));
  tiny::add_box(scene, "pane", {-90, -90, 0}, {90, 90, 0.1}, false, 1);
  for (const double degrees : {0.0, 45.0, 70.0}) {
    const double t = degrees * pi / 180.0, f = fresnel_dielectric(std::cos(t), 1.5);
    EXPECT_AGREES(measure(scene, along({0, 0, -0.5}, {std::sin(t), 0, std::cos(t)}), 1 << 14, 5),
                  (1 - f) / (1 + f) / pi);
  }
}

TEST(PathTracer, RefractsEachBandByItself) {
  // A lamp strip that one band's refracted ray hits and the other's misses.
  Scene scene = tiny::grey_scene(0.0, 1.0);
  scene.bands = WavelengthGrid::from_centres({450.0, 650.0});
  scene.materials[0] = {"lamp", Reflectance(2, 0.0), RadiantExitance(2, 1.0)};
  Material m{"glass", Reflectance(2, 0.0), RadiantExitance(2, 0.0)};
  m.scattering = Scattering::dielectric;
  m.refractive_index = RefractiveIndex(std::vector<double>{1.7, 1.5});
  scene.materials.push_back(m);
  tiny::add_surface(scene, "surface", {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, 1);
  const double sine = std::sin(pi / 3);  // air above, glass below; the lamp within the glass
  const double hit = sine / 1.7 / std::sqrt(1 - std::pow(sine / 1.7, 2));
  tiny::add_surface(
      scene, "strip",
      {{hit - 0.01, -1, -1}, {hit + 0.01, -1, -1}, {hit + 0.01, 1, -1}, {hit - 0.01, 1, -1}});
  const RayOfPixel ray = along({-sine, 0, 0.5}, {sine, 0, -0.5});
  const double f = fresnel_dielectric(0.5, 1.7);
  EXPECT_AGREES(measure(scene, ray, 1 << 13, 3, 0), (1 - f) / (1.7 * 1.7) / pi);
  EXPECT_EQ(measure(scene, ray, 1 << 13, 3, 1).mean, 0.0);
}

TEST(PathTracer, ARoughConductorReflectsAnEvenSkyByItsAlbedo) {
  // F = 1, alpha = 1, normal incidence: 1 - ln 2 of the radiance comes back (see bsdf_test).
  Scene scene = tiny::cube(1.0, 0.0, 1.0);
  Material m{"metal", Reflectance(1, 0.0), RadiantExitance(1, 0.0)};
  m.scattering = Scattering::rough_conductor;
  m.refractive_index = RefractiveIndex(1, 1e-12);
  m.absorption_index = RefractiveIndex(1, 1.0);
  m.roughness = 1.0;
  scene.materials.push_back(m);
  tiny::add_surface(scene, "metal",
                    {{0.4, 0.4, 0.1}, {0.6, 0.4, 0.1}, {0.6, 0.6, 0.1}, {0.4, 0.6, 0.1}}, 1);
  EXPECT_AGREES(measure(scene, along({0.5, 0.5, 0.9}, -Vec3::UnitZ()), 1 << 14),
                (1.0 - std::numbers::ln2) / pi);
}

TEST(PathTracer, KeepsTheRulesOfBacksOpeningsAndSheets) {
  Scene scene = tiny::grey_scene(0.0, 1.0);
  const Polygon up{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  tiny::add_surface(scene, "lamp", up);
  EXPECT_NEAR(measure(scene, along({0.5, 0.4, 1}, -Vec3::UnitZ()), 16).mean, 1 / pi, 1e-7);
  EXPECT_EQ(measure(scene, along({0.5, 0.4, -1}, Vec3::UnitZ()), 16).mean, 0.0) << "black back";
  Scene sheet = tiny::grey_scene(0.0, 1.0);
  sheet.surfaces.push_back({"lamp", 0, {up, Polygon(up.rbegin(), up.rend())}, false, true});
  EXPECT_NEAR(measure(sheet, along({0.5, 0.4, -1}, Vec3::UnitZ()), 16).mean, 1 / pi, 1e-7);
  // A card lit by the lower side of a sheet, then through an opening, then behind a back.
  sheet.materials.push_back({"card", Reflectance(1, 0.5), RadiantExitance(1, 0.0)});
  tiny::add_surface(sheet, "card", {{0, 0, -1}, {1, 0, -1}, {1, 1, -1}, {0, 1, -1}}, 1);
  const RayOfPixel ray = along({0.5, 0.5, -0.5}, -Vec3::UnitZ());
  const double e = factor_below(-0.5, 0.5, -0.5, 0.5, 1.0);
  EXPECT_AGREES(measure(sheet, ray, 8192), 0.5 / pi * e);
  Scene open = sheet;
  tiny::add_surface(open, "window", {{-1, -1, -0.2}, {2, -1, -0.2}, {2, 2, -0.2}, {-1, 2, -0.2}}, 1,
                    true);
  EXPECT_AGREES(measure(open, ray, 8192), 0.5 / pi * e);
  Scene hidden = sheet;  // its lit side is up: to the card it is a black lid
  tiny::add_surface(hidden, "lid", {{-1, -1, -0.2}, {2, -1, -0.2}, {2, 2, -0.2}, {-1, 2, -0.2}}, 1);
  EXPECT_EQ(measure(hidden, ray, 1024).mean, 0.0);
}

RayOfPixel pinhole(int width, int height) {
  return [=](int x, int y, UnitPair p) {
    const Vec3 d((x + p.u) / width - 0.5, 0.8, 0.5 - (y + p.v) / height);
    return PixelRay{{0.5, 0.02, 0.5}, d.normalized()};
  };
}

Scene lit_block() {
  Scene scene = tiny::cube_with_block(1.0, 0.6);
  scene.materials.push_back({"lamp", Reflectance(1, 0.6), RadiantExitance(1, 1.0)});
  tiny::add_surface(scene, "lamp",
                    {{0.2, 0.2, 0.99}, {0.2, 0.5, 0.99}, {0.5, 0.5, 0.99}, {0.5, 0.2, 0.99}}, 1);
  return scene;
}

TEST(PathTracer, TheSeedDecidesAndTheThreadsDoNot) {
  const Scene scene = lit_block();
  PathTraceOptions options;
  options.samples = 32;
  const auto picture = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    return trace_paths(scene, 16, 12, pinhole(16, 12), options);
  };
  const PathTracedImage one = picture(1), two = picture(2);
  EXPECT_EQ(one.radiance.channels[0].samples, two.radiance.channels[0].samples);
  EXPECT_EQ(one.variance.channels[0].samples, two.variance.channels[0].samples);
  options.seed = 2;
  EXPECT_NE(picture(2).radiance.channels[0].samples, one.radiance.channels[0].samples);
}

TEST(PathTracer, ItsVarianceIsThatOfRepeatedPictures) {
  constexpr int kRepeats = 48, kSide = 10;
  const Scene scene = lit_block();
  PathTraceOptions options;
  options.samples = 256;
  std::vector<PathTracedImage> pictures;
  for (int k = 0; k < kRepeats; ++k) {
    options.seed = 100 + k;
    pictures.push_back(trace_paths(scene, kSide, kSide, pinhole(kSide, kSide), options));
  }
  std::vector<double> scores;
  double claimed = 0.0, seen = 0.0;
  for (std::size_t i = 0; i < kSide * kSide; ++i) {
    double mean = 0.0;
    for (const auto& p : pictures) mean += p.radiance.channels[0].samples[i] / kRepeats;
    double variance = 0.0, stated = 0.0;
    for (const auto& p : pictures) {
      const double d = p.radiance.channels[0].samples[i] - mean;
      const double u2 = p.variance.channels[0].samples[i];
      variance += d * d / (kRepeats - 1);
      stated += u2 / kRepeats;
      // The mean contains the picture itself: the difference is smaller by 1 - 1/n in variance.
      const double t = d / std::sqrt(u2 * (1.0 - 1.0 / kRepeats));
      scores.push_back((d < 0 ? -1 : 1) * normal_score(two_sided_p(t, p.randomisations - 1)));
    }
    claimed += stated / (mean * mean);
    seen += variance / (mean * mean);
  }
  // 100 pixels of 47 degrees: the ratio of the sums is known to about sqrt(2 / 4700) = 2 %, more
  // where few pixels carry the sum.
  EXPECT_NEAR(seen / claimed, 1.0, 0.12);
  std::sort(scores.begin(), scores.end());
  double distance = 0.0;
  for (std::size_t k = 0; k < scores.size(); ++k) {
    const double below = 0.5 * std::erfc(-scores[k] / std::numbers::sqrt2);
    distance = std::max({distance, std::abs(below - double(k) / scores.size()),
                         std::abs(below - double(k + 1) / scores.size())});
  }
  // Kolmogorov-Smirnov at 1e-5 is 2.47 / sqrt(4800) = 0.036; pixels whose sets are not quite normal
  // add some.
  EXPECT_LT(distance, 0.036);
  double squares = 0.0;
  for (double z : scores) squares += z * z / static_cast<double>(scores.size());
  EXPECT_NEAR(squares, 1.0, 0.1);
}

TEST(PathTracer, RefusesWhatHasNoVariance) {
  PathTraceOptions options;
  options.randomisations = 1;
  EXPECT_THROW(trace_paths(lit_block(), 1, 1, pinhole(1, 1), options), std::invalid_argument);
}

}  // namespace
}  // namespace truebox
