// SPDX-License-Identifier: BSD-3-Clause
// Error of irradiance against the number of elements: uniform, adapted, and elements that follow
// lines of light. The measure: root mean square error at random points of all lit surfaces, by
// area, over the mean irradiance; three bands of the Cornell Box. Truth: gathered irradiance (every
// point anew, to its bound) from one finer solution.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <random>

#include "adaptive/adaptive_solution.h"
#include "figures/line_plot.h"
#include "scene/scene_file.h"

namespace truebox::benchmark {
namespace {

using Eigen::Index;

struct Place {
  std::uint32_t piece = 0;
  Vec3 position_m = Vec3::Zero();
  BoundedIrradiance truth;
};

double processor_s() {
  std::timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Vec3 random_point(const Polygon& p, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  double rest_m2 = uniform(random) * area_vector(p).norm();
  std::size_t k = 2;
  for (; k + 1 < p.size(); ++k) {
    rest_m2 -= 0.5 * (p[k - 1] - p[0]).cross(p[k] - p[0]).norm();
    if (rest_m2 <= 0.0) break;
  }
  const double u = std::sqrt(uniform(random)), v = uniform(random);
  return (1.0 - u) * p[0] + u * (1.0 - v) * p[k - 1] + u * v * p[k];
}

std::vector<Place> random_places(const Prediction& fine, std::size_t count) {
  const PatchMesh& mesh = fine.fine().mesh;
  std::vector<double> area_m2;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const bool counts = fine.fine().usable[i] &&
                        !fine.scene().surfaces[mesh.surface_of(mesh.patches[i])].is_opening;
    area_m2.push_back(counts ? mesh.patches[i].area_m2 : 0.0);
  }
  std::mt19937_64 random(42);
  std::discrete_distribution<std::size_t> element(area_m2.begin(), area_m2.end());
  std::vector<Place> places(count);
  Polygon polygon;
  for (Place& place : places) {
    const Patch& patch = mesh.patches[element(random)];
    mesh.polygon_of(patch, polygon);
    place.piece = patch.piece;
    place.position_m = random_point(polygon, random);
  }
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    places[i].truth =
        fine.irradiance_at(places[i].position_m, mesh.pieces[places[i].piece].plane.normal);
  });
  return places;
}

struct FieldError {
  double to_mean = 0.0, relative = 0.0, percentile_95 = 0.0;
};

FieldError field_error(const Prediction& prediction, const std::vector<Place>& places) {
  const auto bands = static_cast<Index>(prediction.scene().bands.size());
  const auto count = static_cast<double>(places.size());
  Eigen::VectorXd square = Eigen::VectorXd::Zero(bands), mean = square, relative = square;
  std::vector<double> each;
  Gather::Scratch scratch;
  for (const Place& place : places) {
    const Eigen::VectorXd& exact = place.truth.value;
    const Eigen::VectorXd off =
        prediction.irradiance_on(place.piece, place.position_m, scratch).value - exact;
    square += off.cwiseAbs2();
    mean += exact;
    relative += off.cwiseQuotient(exact).cwiseAbs2();
    for (Index b = 0; b < bands; ++b) each.push_back(std::abs(off[b] / exact[b]));
  }
  std::sort(each.begin(), each.end());
  return {std::sqrt((square / count).cwiseQuotient((mean / count).cwiseAbs2()).mean()),
          std::sqrt((relative / count).mean()), each[each.size() * 95 / 100]};
}

using Predict = std::function<std::unique_ptr<Prediction>(const Scene&, const PredictOptions&)>;

void run(std::size_t points, std::size_t truth_elements, const std::string& svg) {
  const Scene scene =
      in_bands_at(read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml"),
                  {452.0, 552.0, 652.0});
  PredictOptions options;
  options.form_factors.method = FormFactorMethod::exact_visibility;
  options.elements = truth_elements;
  const auto places = random_places(*predict_adaptively(scene, options, {}), points);
  const auto adapted = [](const char* goal, bool lines) -> Predict {
    return [goal, lines](const Scene& s, const PredictOptions& o) {
      return predict_adaptively(s, o, goal_of_name(goal, s), nullptr, lines);
    };
  };
  const std::vector<std::pair<std::string, Predict>> meshes = {
      {"uniform",
       [](const Scene& s, const PredictOptions& o) { return std::make_unique<Prediction>(s, o); }},
      {"lines of light",
       [](const Scene& s, const PredictOptions& o) { return predict_along_discontinuities(s, o); }},
      {"adapted everywhere", adapted("everywhere", false)},
      {"adapted to irradiance", adapted("irradiance", false)},
      {"adapted to irradiance, lines", adapted("irradiance", true)}};
  LinePlot plot{"rms error of irradiance against elements",
                {"elements", "1", true, {}},
                {"rms error : mean irradiance", "1", true, {}},
                {}};
  fmt::print("| mesh | elements | processor time / s | rms : mean | rms relative | 95th |\n");
  for (const auto& [name, predict] : meshes) {
    PlotSeries& line = plot.series.emplace_back();
    line.name = name;
    line.markers = true;
    for (const std::size_t elements : {800u, 1600u, 3200u}) {
      options.elements = elements;
      const double start_s = processor_s();
      const auto prediction = predict(scene, options);
      const double solve_s = processor_s() - start_s;
      const FieldError e = field_error(*prediction, places);
      fmt::print("| {} | {} | {:.1f} | {:.3f} % | {:.2f} % | {:.2f} % |\n", name,
                 prediction->fine().mesh.size(), solve_s, 100.0 * e.to_mean, 100.0 * e.relative,
                 100.0 * e.percentile_95);
      std::fflush(stdout);
      line.x.push_back(static_cast<double>(prediction->fine().mesh.size()));
      line.y.push_back(e.to_mean);
    }
  }
  if (!svg.empty()) std::ofstream(svg) << to_svg(plot);
}

}  // namespace
}  // namespace truebox::benchmark

// truebox_mesh_benchmark [POINTS [ELEMENTS OF THE TRUTH [PLOT.svg]]]
int main(int count, char** argument) {
  const auto number = [&](int k, std::size_t otherwise) {
    return count > k ? static_cast<std::size_t>(std::strtoul(argument[k], nullptr, 10)) : otherwise;
  };
  truebox::benchmark::run(number(1, 1000), number(2, 9600), count > 3 ? argument[3] : "");
}
