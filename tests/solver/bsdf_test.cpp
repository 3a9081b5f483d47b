// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/bsdf.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "path_tracer/fresnel.h"

namespace truebox {
namespace {

using Eigen::ArrayXd;
using std::numbers::pi;

constexpr double kChance = 5.0;  // standard errors: 6e-7 a comparison, a few dozen in this file

Material lambertian(double rho) { return {"matte", Reflectance(1, rho), RadiantExitance(1, 0.0)}; }

// An index that is all absorption reflects everything: what is missing then, the facets lost.
Material conductor(double alpha, double n = 1e-12, double k = 1.0) {
  Material m = lambertian(0.0);
  m.scattering = Scattering::rough_conductor;
  m.refractive_index = RefractiveIndex(1, n);
  m.absorption_index = RefractiveIndex(1, k);
  m.roughness = alpha;
  return m;
}

Material glass(std::vector<double> n) {
  Material m{"glass", Reflectance(n.size(), 0.0), RadiantExitance(n.size(), 0.0)};
  m.scattering = Scattering::dielectric;
  m.refractive_index = RefractiveIndex(std::move(n));
  return m;
}

Vec3 at_angle(double degrees) {
  const double t = degrees * pi / 180.0;
  return {std::sin(t), 0.0, std::cos(t)};
}

// Midpoint rule over the hemisphere in (cos theta, phi).
template <class F>
double over_hemisphere(const F& f, int rows = 800, int columns = 800) {
  double sum = 0.0;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const double z = (r + 0.5) / rows, phi = 2.0 * pi * (c + 0.5) / columns;
      const double s = std::sqrt(1.0 - z * z);
      sum += f(Vec3(s * std::cos(phi), s * std::sin(phi), z));
    }
  return sum * 2.0 * pi / (rows * columns);
}

double quadrature_albedo(const Bsdf& bsdf, const Vec3& outgoing) {
  ArrayXd value(1);
  return over_hemisphere([&](const Vec3& i) {
    bsdf.evaluate(outgoing, i, value);
    return value[0];
  });
}

struct Sampled {
  double mean = 0.0, standard_error = 0.0;
};

Sampled sampled_albedo(const Bsdf& bsdf, const Vec3& outgoing, int count = 40000) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform;
  ArrayXd weight(1);
  double sum = 0.0, squares = 0.0;
  for (int k = 0; k < count; ++k) {
    int band = -1;
    const UnitPair a{uniform(random), uniform(random)}, b{uniform(random), uniform(random)};
    const double w = bsdf.sample(outgoing, false, a, b, band, weight) ? weight[0] : 0.0;
    sum += w;
    squares += w * w;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean) / count)};
}

TEST(Bsdf, SamplingReturnsTheFurnaceAlbedoAtEveryAngle) {
  for (const Material& m :
       {lambertian(0.7), conductor(0.3), conductor(0.5), conductor(1.0), conductor(0.4, 0.2, 3.0)})
    for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
      const Bsdf bsdf(m);
      const double expected = quadrature_albedo(bsdf, at_angle(degrees));
      const Sampled got = sampled_albedo(bsdf, at_angle(degrees));
      // 1e-3: of the midpoint rule at grazing lobes.
      EXPECT_NEAR(got.mean, expected, kChance * got.standard_error + 1e-3)
          << m.roughness << ", " << degrees << " deg";
      EXPECT_LE(expected, 1.0 + 1e-3);
    }
}

TEST(Bsdf, ALambertianSurfaceReflectsItsReflectance) {
  const Material m = lambertian(0.7);
  for (const double degrees : {0.0, 45.0, 89.0})
    EXPECT_NEAR(quadrature_albedo(Bsdf(m), at_angle(degrees)), 0.7, 1e-12) << degrees;
}

// What single scattering off the facets loses, as bsdf.h and solver/README.md state it.
TEST(Bsdf, LosesTheEnergyItSaysItLoses) {
  const struct {
    double alpha, degrees, lost;
  } kStated[] = {{0.1, 0, 0.01175},
                 {0.5, 0, 0.31215},
                 {1.0, 0, std::numbers::ln2},
                 {0.5, 60, 0.30175},
                 {1.0, 60, 0.54931}};
  for (const auto& s : kStated) {
    const Material m = conductor(s.alpha);
    EXPECT_NEAR(1.0 - quadrature_albedo(Bsdf(m), at_angle(s.degrees)), s.lost, 0.001)
        << "alpha " << s.alpha << ", " << s.degrees << " deg";
  }
}

TEST(Bsdf, IsReciprocal) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    Vec3 v(normal(random), normal(random), normal(random));
    v.z() = std::abs(v.z());
    return Vec3(v.normalized());
  };
  for (const Material& m : {lambertian(0.4), conductor(0.1, 0.2, 3.0), conductor(0.8, 1.5, 2.0)})
    for (int k = 0; k < 200; ++k) {
      const Vec3 o = direction(), i = direction();
      ArrayXd there(1), back(1);
      Bsdf(m).evaluate(o, i, there);
      Bsdf(m).evaluate(i, o, back);
      EXPECT_NEAR(there[0] / i.z() / (back[0] / o.z()), 1.0,
                  1e-10);  // rounding of tan^2 at grazing
    }
}

TEST(Bsdf, DrawsDirectionsAsItsDensitySays) {
  constexpr int kRows = 10, kColumns = 12, kFine = 40, kCount = 60000;
  for (const Material& m : {lambertian(0.5), conductor(0.2), conductor(0.6)})
    for (const double degrees : {20.0, 65.0}) {
      const Vec3 o = at_angle(degrees);
      std::vector<double> expected(kRows * kColumns, 0.0), drawn = expected;
      const auto cell = [&](const Vec3& i) {
        const double phi = std::atan2(i.y(), i.x()) / (2.0 * pi) + 0.5;
        return std::min(kRows - 1, static_cast<int>(i.z() * kRows)) * kColumns +
               std::min(kColumns - 1, static_cast<int>(phi * kColumns));
      };
      const int rows = kRows * kFine, columns = kColumns * kFine;
      over_hemisphere(
          [&](const Vec3& i) {
            expected[cell(i)] += kCount * Bsdf(m).density(o, i) * 2.0 * pi / (rows * columns);
            return 0.0;
          },
          rows, columns);
      std::mt19937_64 random(11);
      std::uniform_real_distribution<double> uniform;
      ArrayXd weight(1);
      for (int k = 0; k < kCount; ++k) {
        int band = -1;
        const UnitPair p{uniform(random), uniform(random)};
        if (const auto s = Bsdf(m).sample(o, false, p, {}, band, weight)) {
          ++drawn[cell(s->incoming)];
          EXPECT_NEAR(s->density / Bsdf(m).density(o, s->incoming), 1.0, 1e-9);
        }
      }
      double chi2 = 0.0, degrees_of_freedom = 0.0;
      for (std::size_t c = 0; c < expected.size(); ++c) {
        if (expected[c] < 20.0) continue;  // too few for chi^2
        chi2 += std::pow(drawn[c] - expected[c], 2) / expected[c];
        degrees_of_freedom += 1.0;
      }
      EXPECT_LT(chi2, degrees_of_freedom + kChance * std::sqrt(2.0 * degrees_of_freedom))
          << m.roughness << ", " << degrees << " deg";
    }
}

TEST(Fresnel, ReproducesItsClosedForms) {
  for (const double n : {1.0, 1.33, 1.5, 2.4, 1.0 / 1.5}) {
    EXPECT_NEAR(fresnel_dielectric(1.0, n), std::pow((n - 1) / (n + 1), 2), 1e-15);
    EXPECT_NEAR(fresnel_dielectric(0.0, n), 1.0, n == 1.0 ? 1.0 : 1e-15);
    // Brewster: nothing parallel is reflected.
    const double brewster = std::cos(std::atan(n));
    EXPECT_NEAR(fresnel_dielectric(brewster, n), 0.5 * std::pow((n * n - 1) / (n * n + 1), 2),
                1e-15);
  }
  const double critical = std::asin(1.0 / 1.5);
  EXPECT_EQ(fresnel_dielectric(std::cos(critical + 1e-6), 1.0 / 1.5), 1.0);
  EXPECT_LT(fresnel_dielectric(std::cos(critical - 1e-6), 1.0 / 1.5), 1.0);
}

TEST(Fresnel, IsTheSameFromBothSides) {  // Stokes (1849)
  for (const double degrees : {5.0, 40.0, 70.0, 85.0}) {
    // 1e-13: a few roundings of 1 - sine^2, enlarged where F is steep.
    const double sine = std::sin(degrees * pi / 180.0) / 1.7;
    EXPECT_NEAR(fresnel_dielectric(std::cos(degrees * pi / 180.0), 1.7),
                fresnel_dielectric(std::sqrt(1.0 - sine * sine), 1.0 / 1.7), 1e-13);
  }
}

TEST(Fresnel, OfAConductorIsBornAndWolfs) {
  // Normal incidence; without absorption it is the dielectric; squared amplitudes written out with
  // a and b, a^2 - b^2 = n^2 - k^2 - sin^2, a b = n k (their eqs. 14.2.13 to 15).
  EXPECT_NEAR(fresnel_conductor(1.0, 0.2, 3.4), (0.64 + 3.4 * 3.4) / (1.44 + 3.4 * 3.4), 1e-15);
  EXPECT_NEAR(fresnel_conductor(0.3, 1.5, 0.0), fresnel_dielectric(0.3, 1.5), 1e-15);
  const double n = 1.1, k = 6.6, c = 0.4, s2 = 1 - c * c;
  const double t = n * n - k * k - s2, root = std::hypot(t, 2 * n * k);
  const double a = std::sqrt(0.5 * (root + t)), b2 = 0.5 * (root - t);
  const double s = ((a - c) * (a - c) + b2) / ((a + c) * (a + c) + b2);
  const double q = s2 / c;
  const double p = s * ((a - q) * (a - q) + b2) / ((a + q) * (a + q) + b2);
  EXPECT_NEAR(fresnel_conductor(c, n, k), 0.5 * (s + p), 1e-14);
}

TEST(Dielectric, FollowsSnellAndSharesTheLightAsFresnelSays) {
  const Material m = glass({1.5});
  for (const bool inside : {false, true})
    for (const double degrees : {0.0, 30.0, 41.0, 60.0}) {
      const Vec3 o = at_angle(degrees);
      const double eta = inside ? 1.0 / 1.5 : 1.5;
      const double expected = fresnel_dielectric(o.z(), eta);
      int reflected = 0;
      constexpr int kCount = 4096;
      for (int k = 0; k < kCount; ++k) {
        ArrayXd weight(1);
        int band = -1;
        const auto s = Bsdf(m).sample(o, inside, {}, {(k + 0.5) / kCount, 0.5}, band, weight);
        ASSERT_TRUE(s);
        reflected += !s->passed;
        if (!s->passed) {
          EXPECT_EQ(weight[0], 1.0);
          EXPECT_NEAR((s->incoming - Vec3(-o.x(), 0, o.z())).norm(), 0.0, 1e-15);
        } else {
          EXPECT_NEAR(weight[0], 1.0 / (eta * eta), 1e-14) << "basic radiance L / n^2 is kept";
          EXPECT_NEAR(-s->incoming.x(), o.x() / eta, 1e-14);
          EXPECT_LT(s->incoming.z(), 0.0);
          EXPECT_NEAR(s->incoming.norm(), 1.0, 1e-14);
        }
      }
      EXPECT_NEAR(double(reflected) / kCount, expected, 1.0 / kCount) << degrees;
    }
}

TEST(Dielectric, KeepsTheWeightOfEveryBandWhenItDisperses) {
  const Material m = glass({1.50, 1.52, 1.56});
  const Vec3 o = at_angle(50.0);
  constexpr int kCount = 60;
  ArrayXd total = ArrayXd::Zero(3);
  for (int u = 0; u < kCount; ++u)
    for (int v = 0; v < kCount; ++v) {
      ArrayXd weight(3);
      int band = -1;
      const auto s =
          Bsdf(m).sample(o, false, {}, {(u + 0.5) / kCount, (v + 0.5) / kCount}, band, weight);
      ASSERT_GE(band, 0);
      EXPECT_EQ((weight > 0.0).count(), 1);
      total += weight * s->relative_index * s->relative_index;
      const int followed = band;
      Bsdf(m).sample(o, false, {}, {0.9, 0.1}, band, weight);
      EXPECT_EQ(band, followed) << "a path that has split stays with its band";
    }
  for (int b = 0; b < 3; ++b) EXPECT_NEAR(total[b] / (kCount * kCount), 1.0, 1e-12);
}

TEST(Mirror, ReflectsItsReflectanceOrFresnels) {
  Material m = lambertian(0.9);
  m.scattering = Scattering::mirror;
  ArrayXd weight(1);
  int band = -1;
  const auto s = Bsdf(m).sample(Vec3(0.6, 0.0, 0.8), false, {}, {}, band, weight);
  EXPECT_EQ(weight[0], 0.9);
  EXPECT_EQ(s->incoming, Vec3(-0.6, 0.0, 0.8));
  EXPECT_EQ(Bsdf(m).density(Vec3(0.6, 0, 0.8), s->incoming), 0.0);
  m.refractive_index = RefractiveIndex(1, 0.2);
  m.absorption_index = RefractiveIndex(1, 3.4);
  Bsdf(m).sample(Vec3(0.6, 0.0, 0.8), false, {}, {}, band, weight);
  EXPECT_EQ(weight[0], fresnel_conductor(0.8, 0.2, 3.4));
}

}  // namespace
}  // namespace truebox
