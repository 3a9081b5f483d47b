// SPDX-License-Identifier: BSD-3-Clause
// Enclosures with curved walls and known radiosity, their walls cut into flat facets. Three nested
// tessellations give the error bound, geometry included, by the same rule as everywhere.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include "radiometry/table_file.h"
#include "support/tiny_scenes.h"
#include "transport/grid_difference.h"
#include "transport/solve_radiosity.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kOneFacet = 1e3;  // element edge, m: each facet is one element

double parameter(const std::string& text, const std::string& key) {
  const std::size_t at = text.find(key + "=");
  return at == std::string::npos ? std::nan("")
                                 : std::strtod(text.c_str() + at + key.size() + 1, nullptr);
}

// Icosahedron of circumradius 1, each facet cut in four `level` times and pushed out to the sphere.
std::vector<Polygon> sphere_facets(int level) {
  const double t = std::numbers::phi;
  const Vec3 v[12] = {{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                      {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
  const int f[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                        {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                        {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                        {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  std::vector<Polygon> facets;
  for (const auto& k : f)
    facets.push_back({v[k[0]].normalized(), v[k[1]].normalized(), v[k[2]].normalized()});
  for (int l = 0; l < level; ++l) {
    std::vector<Polygon> finer;
    for (const Polygon& p : facets) {
      const Vec3 a = (p[0] + p[1]).normalized(), b = (p[1] + p[2]).normalized(),
                 c = (p[2] + p[0]).normalized();
      for (const Polygon& q : {Polygon{p[0], a, c}, {p[1], b, a}, {p[2], c, b}, {a, b, c}})
        finer.push_back(q);
    }
    facets = std::move(finer);
  }
  return facets;
}

void add_sphere(Scene& scene, const std::string& name, double radius_m, int level, bool inwards) {
  for (Polygon facet : sphere_facets(level)) {
    for (Vec3& v : facet) v *= radius_m;
    if (inwards) std::reverse(facet.begin(), facet.end());
    tiny::add_surface(scene, name + std::to_string(scene.surfaces.size()), std::move(facet));
  }
}

struct Solved {
  PatchMesh mesh;
  BandMatrix radiosity;
};

// Column k of rho and source: case k.
Solved solve(const Scene& scene, bool occlusion,
             const std::function<void(std::size_t, Eigen::RowVectorXd&, Eigen::RowVectorXd&)>& set,
             Index cases) {
  Solved solved{uniform_mesh(scene, kOneFacet), {}};
  const Visibility visibility(solved.mesh, scene);
  FormFactorOptions options;
  options.occlusion = occlusion;
  options.rays = 128;
  const FormFactors factors = form_factors(solved.mesh, scene, visibility, options);
  BandMatrix rho(factors.size(), cases), source(factors.size(), cases);
  Eigen::RowVectorXd r(cases), m(cases);
  for (Index i = 0; i < rho.rows(); ++i) {
    set(static_cast<std::size_t>(i), r, m);
    rho.row(i) = r;
    source.row(i) = m;
  }
  SolveOptions tight;
  tight.relative_bound = 1e-10;
  EXPECT_EQ(solve_radiosity(factors, rho, source, tight, solved.radiosity).outcome,
            SolveOutcome::converged);
  return solved;
}

// Area-weighted means of the elements before `inner` and of the others.
std::array<Eigen::RowVectorXd, 2> means(const Solved& s, std::size_t inner) {
  std::array<Eigen::RowVectorXd, 2> mean;
  double area[2] = {0.0, 0.0};
  for (auto& m : mean) m = Eigen::RowVectorXd::Zero(s.radiosity.cols());
  for (std::size_t i = 0; i < s.mesh.size(); ++i) {
    const int side = i < inner ? 0 : 1;
    mean[side] += s.mesh.patches[i].area_m2 * s.radiosity.row(static_cast<Index>(i));
    area[side] += s.mesh.patches[i].area_m2;
  }
  for (int k = 0; k < 2; ++k)
    if (area[k] > 0.0) mean[k] /= area[k];
  return mean;
}

TEST(CurvedEnclosures, ConcentricSpheresAreWithinTheirBound) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/radiosity.csv");
  std::map<double, std::vector<std::size_t>> rows_of_ratio;
  for (std::size_t row = 0; row < table.rows.size(); ++row)
    if (table.rows[row][0] == "concentric_spheres")
      rows_of_ratio[parameter(table.rows[row][1], "r1/r2")].push_back(row);
  int compared = 0;
  std::printf("concentric spheres, 20/80/320 facets each\n");
  for (const auto& [ratio, rows] : rows_of_ratio) {
    // The inner sphere must fit into the coarsest outer one, an icosahedron of inradius 0.795.
    if (ratio > 0.75) continue;
    std::array<std::array<Eigen::RowVectorXd, 2>, 3> mean;  // coarsest first
    for (int level = 0; level < 3; ++level) {
      Scene scene = tiny::grey_scene(0.5);
      add_sphere(scene, "inner", ratio, level, false);
      const std::size_t inner = scene.surfaces.size();
      add_sphere(scene, "outer", 1.0, level, true);
      const Solved solved = solve(
          scene, true,
          [&](std::size_t i, Eigen::RowVectorXd& rho, Eigen::RowVectorXd& source) {
            for (std::size_t k = 0; k < rows.size(); ++k) {
              const std::string& text = table.rows[rows[k]][1];
              rho[static_cast<Index>(k)] = parameter(text, i < inner ? "rho1" : "rho2");
              source[static_cast<Index>(k)] = parameter(text, i < inner ? "E1" : "E2");
            }
          },
          static_cast<Index>(rows.size()));
      mean[level] = means(solved, inner);
    }
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const int side = table.rows[rows[k]][2] == "B1" ? 0 : 1;
      const auto at = [&](int level) {
        return mean[level][side].segment(static_cast<Index>(k), 1);
      };
      const double bound = guarded_difference(at(2), at(1), at(0), kGatheredOrder)[0];
      const double exact = table.number(rows[k], table.column_index("value"));
      std::printf("  r1/r2 %g  %s %-3s %.6f, exact %.6f, error %.1e, bound %.1e\n", ratio,
                  table.rows[rows[k]][1].substr(10, 20).c_str(), side == 0 ? "B1" : "B2", at(2)[0],
                  exact, std::abs(at(2)[0] - exact), bound);
      // What the kernels are off by on all grids alike is no part of a difference of grids.
      constexpr double kKernels = 1e-7;  // of the radiosity: "The error bound", solver/README.md
      EXPECT_LE(std::abs(at(2)[0] - exact), bound + kKernels * exact);
      EXPECT_LT(bound, 0.1 * exact) << "a bound so wide says nothing";
      ++compared;
    }
  }
  EXPECT_EQ(compared, 8);
}

// The cap of a sphere of radius 1 with half-angle beta, seen from inside, opening upwards: planar
// quads between parallels, triangles at the bottom.
Scene crater(double beta, int rings) {
  Scene scene = tiny::grey_scene(0.5);
  const int sectors = 4 * rings;
  const auto at = [&](int ring, int sector) -> Vec3 {
    const double polar = beta * ring / rings;
    const double around = 2.0 * std::numbers::pi * sector / sectors;
    return {std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
            -std::cos(polar)};
  };
  for (int ring = 0; ring < rings; ++ring)
    for (int s = 0; s < sectors; ++s) {
      Polygon facet = {at(ring, s), at(ring + 1, s), at(ring + 1, s + 1), at(ring, s + 1)};
      if (ring == 0) facet.erase(facet.begin() + 3);
      tiny::add_surface(scene, "facet " + std::to_string(scene.surfaces.size()), std::move(facet));
    }
  return scene;
}

// Mean sunlight on a facet: cosine where the sun is not behind the rim.
double sunlight(const Polygon& facet, const Vec3& sun, const Visibility& visibility) {
  const Plane plane = plane_of(facet);
  const double cosine = plane.normal.dot(sun);
  if (cosine <= 0.0) return 0.0;
  constexpr int kSide = 24;
  double lit = 0.0, total = 0.0;
  for (std::size_t k = 2; k < facet.size(); ++k) {
    const Vec3 &a = facet[0], u = (facet[k - 1] - a) / kSide, v = (facet[k] - a) / kSide;
    const double weight = u.cross(v).norm();
    for (int i = 0; i < kSide; ++i)
      for (int j = 0; i + j < kSide; ++j) {
        const Vec3 x = a + (i + 1.0 / 3.0) * u + (j + 1.0 / 3.0) * v;
        total += weight;
        if (!visibility.first_hit(x + visibility.offset_m() * plane.normal, sun)) lit += weight;
      }
  }
  return cosine * lit / total;
}

TEST(CurvedEnclosures, SunlitCraterWithItsShadowIsWithinItsBound) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/radiosity.csv");
  std::map<double, std::vector<std::size_t>> rows_of_beta;
  for (std::size_t row = 0; row < table.rows.size(); ++row)
    if (table.rows[row][0] == "spherical_crater")
      rows_of_beta[parameter(table.rows[row][1], "beta")].push_back(row);
  constexpr double kDegree = std::numbers::pi / 180.0;
  int compared = 0;
  std::printf("sunlit crater, 16/64/256 facets: mean indirect irradiance\n");
  for (const auto& [beta, rows] : rows_of_beta) {
    std::array<Eigen::RowVectorXd, 3> indirect;
    for (int level = 0; level < 3; ++level) {
      const Scene scene = crater(beta * kDegree, 2 << level);
      const PatchMesh mesh = uniform_mesh(scene, kOneFacet);
      const Visibility visibility(mesh, scene);
      std::map<double, std::vector<double>> sun_of;  // elevation -> sunlight on each facet
      for (const std::size_t row : rows) {
        const double elevation = parameter(table.rows[row][1], "sun_elevation");
        if (sun_of.contains(elevation)) continue;
        const Vec3 sun(std::cos(elevation * kDegree), 0.0, std::sin(elevation * kDegree));
        for (const Surface& surface : scene.surfaces)
          sun_of[elevation].push_back(sunlight(surface.pieces[0], sun, visibility));
      }
      const Solved solved = solve(
          scene, false,  // concave: a facet hides no other from a third
          [&](std::size_t i, Eigen::RowVectorXd& rho, Eigen::RowVectorXd& source) {
            for (std::size_t k = 0; k < rows.size(); ++k) {
              const std::string& text = table.rows[rows[k]][1];
              rho[static_cast<Index>(k)] = parameter(text, "rho");
              source[static_cast<Index>(k)] =
                  parameter(text, "rho") * sun_of[parameter(text, "sun_elevation")][i];
            }
          },
          static_cast<Index>(rows.size()));
      // H = B / rho - sunlight, over all facets.
      const Eigen::RowVectorXd mean = means(solved, solved.mesh.size())[0];
      indirect[level] = mean;
      double area = 0.0;
      for (const Patch& patch : solved.mesh.patches) area += patch.area_m2;
      for (std::size_t k = 0; k < rows.size(); ++k) {
        const std::string& text = table.rows[rows[k]][1];
        double sun = 0.0;
        for (std::size_t i = 0; i < solved.mesh.size(); ++i)
          sun += solved.mesh.patches[i].area_m2 * sun_of[parameter(text, "sun_elevation")][i];
        const auto at = static_cast<Index>(k);
        indirect[level][at] = mean[at] / parameter(text, "rho") - sun / area;
      }
    }
    const Eigen::RowVectorXd bound =
        guarded_difference(indirect[2], indirect[1], indirect[0], kGatheredOrder);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const auto at = static_cast<Index>(k);
      const double exact = table.number(rows[k], table.column_index("value"));
      std::printf("  %-40s %.6f, exact %.6f, error %.1e, bound %.1e\n",
                  table.rows[rows[k]][1].c_str(), indirect[2][at], exact,
                  std::abs(indirect[2][at] - exact), bound[at]);
      EXPECT_LE(std::abs(indirect[2][at] - exact), bound[at]) << table.rows[rows[k]][1];
      EXPECT_LT(bound[at], 0.2 * exact) << "a bound so wide says nothing";
      ++compared;
    }
  }
  EXPECT_EQ(compared, 27);
}

}  // namespace
}  // namespace truebox
