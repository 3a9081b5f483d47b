// SPDX-License-Identifier: BSD-3-Clause
// Links against elements, and against the full matrix of the same mesh.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cmath>
#include <fstream>
#include <memory>

#include "benchmark.h"
#include "figures/line_plot.h"
#include "hierarchy/hierarchical_exchange.h"
#include "hierarchy/link_refinement.h"
#include "scene/generated_scene.h"
#include "scene/requirements.h"
#include "scene/scene_file.h"
#include "transport/direct_light.h"
#include "transport/solve_radiosity.h"

namespace truebox::benchmark {
namespace {

using Eigen::Index;

// One mesh with what every method asks for, lit by the scene's own lamps.
struct Lit {
  Scene scene;
  PatchMesh mesh;
  Visibility visibility;
  ShaftCulling culling;
  FormFactorOptions options;
  BandMatrix rho, source;

  Lit(const Scene& all_bands, std::size_t elements)
      : scene(in_bands(all_bands, requirements(all_bands).distinct_bands)),
        mesh(uniform_mesh(scene, edge_for_count(scene, elements))),
        visibility(mesh, scene),
        culling(mesh, scene, requirements(scene).occlusion) {
    options.occlusion = requirements(scene).occlusion;
    options.method = FormFactorMethod::exact_visibility;
    const Gather gather(mesh, scene, options.occlusion);
    source = mean_direct(mesh, scene, gather, element_tree(mesh), culling);
    rho.resize(source.rows(), source.cols());
    for (Index i = 0; i < rho.rows(); ++i) {
      const std::size_t surface = mesh.surface_of(mesh.patches[static_cast<std::size_t>(i)]);
      const auto& values = scene.material_of(scene.surfaces[surface]).reflectance.values;
      rho.row(i) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), rho.cols());
    }
    source = source.cwiseProduct(rho).eval();
  }

  BandMatrix irradiance(const ExchangeOperator& exchange) const {
    BandMatrix radiosity, result;
    solve_radiosity(exchange, rho, source, {}, radiosity, {}, &result);
    return result;
  }
};

// Root mean square over the area, relative to the mean; worst band.
double difference(const PatchMesh& mesh, const BandMatrix& a, const BandMatrix& b) {
  double worst = 0.0;
  for (Index k = 0; k < a.cols(); ++k) {
    double squares = 0.0, mean = 0.0, area = 0.0;
    for (Index i = 0; i < a.rows(); ++i) {
      const double weight = mesh.patches[static_cast<std::size_t>(i)].area_m2;
      squares += weight * std::pow(a(i, k) - b(i, k), 2);
      mean += weight * b(i, k);
      area += weight;
    }
    if (mean > 0.0) worst = std::max(worst, std::sqrt(squares * area) / mean);
  }
  return worst;
}

Scene facing_squares() {
  Scene scene;
  scene.bands = WavelengthGrid::from_centres({550.0});
  scene.materials = {{"grey", Reflectance(1, 0.5), RadiantExitance(1, 0.0)}};
  scene.surfaces = {{"below", 0, {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}}, false},
                    {"above", 0, {{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}}, false}};
  return scene;
}

}  // namespace

LinkGrowth measure_links(const std::string& name, const Scene& scene, std::size_t elements,
                         double tolerance, bool with_matrix) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Lit lit(scene, elements);
  LinkGrowth result{name, tolerance, lit.mesh.size()};
  HierarchyOptions options;
  options.relative_tolerance = tolerance;
  BandMatrix linked;
  result.links_s = processor_seconds([&] {
    const FoundExchange found = hierarchical_exchange(options)(
        {lit.mesh, lit.scene, lit.visibility, lit.culling, lit.rho, lit.source, lit.options});
    linked = lit.irradiance(*found.exchange);
    result.links = found.links->links;
    result.links_bytes = found.links->bytes;
    result.estimate = found.links->relative_error;
  });
  if (!with_matrix) return result;
  BandMatrix full;
  result.matrix_bytes = lit.mesh.size() * lit.mesh.size() * sizeof(double);
  result.matrix_s = processor_seconds([&] {
    full = lit.irradiance(DenseExchange(std::make_unique<FormFactors>(
        form_factors(lit.mesh, lit.scene, lit.visibility, lit.options))));
  });
  result.error = difference(lit.mesh, linked, full);
  return result;
}

LinkGrowth measure_facing_squares(std::size_t elements) {
  const Scene scene = facing_squares();
  const PatchMesh mesh = uniform_mesh(scene, edge_for_count(scene, elements));
  const Visibility visibility(mesh, scene);
  const ShaftCulling culling(mesh, scene, false);
  const GroupBasis groups(mesh, element_tree(mesh));
  LinkOptions options;
  options.error_of_a_link = 1e-15;
  const NodeLight light{std::vector<double>(groups.tree.nodes.size(), 1.0),
                        std::vector<double>(groups.tree.nodes.size(), 0.0)};
  LinkGrowth result{"two facing squares, nothing left out", 0.0, mesh.size()};
  result.links =
      LinkRefinement(mesh, visibility, groups, culling, 1e-4, 1).refine(light, options).size();
  return result;
}

Scene museum_of(std::size_t patches) {
  const auto path = std::filesystem::temp_directory_path() / "truebox_benchmark_museum.toml";
  std::ofstream(path) << generated_scene({"museum", patches, 1});
  const Scene scene = read_scene(path);
  std::filesystem::remove(path);
  return scene;
}

std::string links_svg(const std::vector<LinkGrowth>& rows) {
  LinePlot plot;
  plot.title = "Links against elements";
  plot.x = {"elements", "", true};
  plot.y = {"links", "", true};
  PlotSeries pairs{"all pairs", {}, {}};
  pairs.dashed = true;
  for (const LinkGrowth& row : rows) {
    const std::string name = row.tolerance > 0.0
                                 ? fmt::format("{}, tolerance {:g}", row.scene, row.tolerance)
                                 : row.scene;
    if (plot.series.empty() || plot.series.back().name != name) {
      plot.series.push_back({name, {}, {}});
      plot.series.back().markers = true;
    }
    const auto n = static_cast<double>(row.elements);
    plot.series.back().x.push_back(n);
    plot.series.back().y.push_back(static_cast<double>(row.links));
    pairs.x.push_back(n);
  }
  std::sort(pairs.x.begin(), pairs.x.end());
  for (double n : pairs.x) pairs.y.push_back(0.5 * n * n);
  plot.series.push_back(pairs);
  return to_svg(plot);
}

}  // namespace truebox::benchmark
