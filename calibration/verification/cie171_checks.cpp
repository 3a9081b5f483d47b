// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>
#include <sstream>

#include "provenance/provenance.h"
#include "radiometry/table_file.h"
#include "transport/prediction.h"
#include "verification/accuracy_check.h"
#include "verification/box_scene.h"

namespace truebox {
namespace {

Vec3 position(const std::string& text) {
  std::istringstream stream(text);
  Vec3 v;
  stream >> v[0] >> v[1] >> v[2];
  return v;
}

double direct_at(const Scene& scene, const Vec3& point, const Vec3& normal) {
  const PatchMesh mesh = uniform_mesh(scene, 1e3);
  const Gather gather(mesh, scene, false);
  Gather::Scratch scratch;
  Eigen::VectorXd e = Eigen::VectorXd::Zero(1);
  gather.add_direct(point, normal, e, scratch);
  return e[0];
}

// A point of the 4 m room's floor, ceiling or wall y = 0 and the inward normal there.
Vec3 room_normal(const Vec3& p, double ceiling_m) {
  if (p.z() == 0.0) return Vec3::UnitZ();
  return p.z() == ceiling_m ? Vec3(-Vec3::UnitZ()) : Vec3::UnitY();
}

// Solid angle of a triangle from the origin. Source: Van Oosterom & Strackee (1983).
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2.0 * std::atan2(std::abs(a.dot(b.cross(c))),
                          la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la);
}

// Case 5.8: cube of 4 m, an isotropic source of 10000 lm at its centre; mean indirect illuminance.
double internal_reflected_component(double rho) {
  constexpr double kFlux_lm = 10000.0;
  const Scene cube = box_scene({4.0, 4.0, 4.0});
  const PatchMesh mesh = uniform_mesh(cube, 0.5);
  FormFactorOptions exact;
  exact.relative_tolerance = 1e-13;
  exact.occlusion = false;
  const FormFactors factors = form_factors(mesh, cube, Visibility(mesh, cube), exact);
  const auto n = static_cast<Eigen::Index>(mesh.size());
  BandMatrix source(n, 1), b;
  Polygon p;
  for (Eigen::Index i = 0; i < n; ++i) {
    mesh.polygon_of(mesh.patches[i], p);
    for (Vec3& v : p) v -= Vec3(2.0, 2.0, 2.0);
    const double omega = solid_angle(p[0], p[1], p[2]) + solid_angle(p[0], p[2], p[3]);
    source(i, 0) = rho * kFlux_lm * omega / (4.0 * std::numbers::pi) / factors.area_m2[i];
  }
  SolveOptions options;
  options.relative_bound = 1e-13;
  solve_radiosity(factors, BandMatrix::Constant(n, 1, rho), source, options, b);
  double sum = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) sum += factors.area_m2[i] * (b(i, 0) - source(i, 0)) / rho;
  return sum / factors.area_m2.sum();
}

}  // namespace

std::vector<AccuracyCheck> check_cie171(const std::filesystem::path& reference_dir) {
  const TableFile table = read_table(reference_dir / "analytic" / "cie171_exact.csv");
  require_provenance(table);
  const std::size_t exact = table.column_index("exact"), unit = table.column_index("unit");
  // 5.2: intensity 1000 cd cos(theta) at 3 m: a Lambertian square of 10 um stands for the point.
  constexpr double kPointEdge_m = 1e-5;
  const Scene point_source =
      downlight_scene({-0.5 * kPointEdge_m, -0.5 * kPointEdge_m, 3.0}, kPointEdge_m,
                      std::numbers::pi * 1000.0 / (kPointEdge_m * kPointEdge_m));
  // 5.3: a luminous square of 1 m, 1000 cd m^-2, in the middle of the ceiling of a 4 x 4 x 3 m
  // room.
  const Scene area_source = downlight_scene({1.5, 1.5, 3.0}, 1.0, std::numbers::pi * 1000.0);
  // 5.6: the floor of that room sends E_hz rho, of which 100 %.
  const Scene floor = bright_floor_scene(4.0, 100.0);
  std::vector<AccuracyCheck> checks;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::string& name = table.rows[row][0];
    AccuracyCheck check{"cie171",
                        name + ", " + table.rows[row][1],
                        0.0,
                        table.number(row, exact),
                        0.0,
                        table.rows[row][unit],
                        "closed form, 1e-9 relative"};
    if (name.starts_with("5.2")) {
      check.computed = direct_at(point_source, position(table.rows[row][2]), Vec3::UnitZ());
    } else if (name.starts_with("5.3")) {
      const Vec3 p = position(table.rows[row][2]);
      check.computed = direct_at(area_source, p, room_normal(p, 3.0));
    } else if (name.starts_with("5.6")) {
      const Vec3 p = position(table.rows[row][2]);
      check.computed = direct_at(floor, p, room_normal(p, 3.0));
    } else if (name.starts_with("5.8")) {
      check.computed = internal_reflected_component(
          std::strtod(table.rows[row][1].c_str() + std::string("rho=").size(), nullptr));
    } else {
      continue;  // 5.7 needs an obstruction; it comes with the occluded view factors
    }
    check.allowed = 1e-9 * check.certified;
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace truebox
