// SPDX-License-Identifier: BSD-3-Clause
#include "planning/full_model.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "hierarchy/hierarchical_exchange.h"
#include "radiometry/processor_time.h"
#include "transport/closure_repair.h"
#include "transport/direct_light.h"
#include "transport/enclosure.h"
#include "transport/form_factor.h"
#include "transport/polynomial_means.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr unsigned kRays = 16;
constexpr double kKernelTolerance = 1e-5;
constexpr double kRounding = 1e-12;
constexpr std::size_t kLeastConstants = 2400;
constexpr double kLinksAtMost = 3.0;  // of their estimate, as in bounds

struct Element {
  PlanarPolygon polygon;
  std::vector<Vec3> points;  // one a ray
};

std::vector<Element> elements_of(const PatchMesh& mesh) {
  std::vector<Element> elements;
  Polygon polygon;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    mesh.polygon_of(mesh.patches[i], polygon);
    elements.push_back({PlanarPolygon(polygon), {}});
    for (std::uint64_t k = 0; k < kRays; ++k)
      elements.back().points.push_back(
          sample_polygon(polygon, unit_interval(hash(2 * (i * kRays + k) + 1)),
                         unit_interval(hash(2 * (i * kRays + k) + 2))));
  }
  return elements;
}

// Rays between all elements that face each other, and the kernel times the visible share.
FormFactors rays_for_every_pair(const PatchMesh& mesh, const Scene& scene,
                                const Visibility& visibility, ModelSolution& counts) {
  const std::vector<Element> elements = elements_of(mesh);
  const auto n = static_cast<Index>(elements.size());
  FormFactors factors;
  factors.exchange_area_m2 = Eigen::MatrixXd::Zero(n, n);
  factors.area_m2.resize(n);
  factors.usable = usable_patches(mesh, scene, visibility, 1);
  std::vector<std::vector<std::uint32_t>> sampled(elements.size());
  std::atomic<std::size_t> rays{0}, pairs{0};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, elements.size(), 4), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Element& a = elements[i];
      factors.area_m2[static_cast<Index>(i)] = a.polygon.area_m2;
      std::size_t traced = 0;
      for (std::size_t j = i + 1; j < elements.size(); ++j) {
        const Element& b = elements[j];
        if (!factors.usable[i] || !factors.usable[j]) continue;
        double seen = 0.0, total = 0.0;
        for (unsigned k = 0; k < kRays; ++k) {
          const Vec3 from = a.points[k], to = b.points[(7 * k + 3) % kRays], r = to - from;
          const double cos_a = a.polygon.plane.normal.dot(r);
          const double cos_b = -b.polygon.plane.normal.dot(r);
          if (cos_a <= 0.0 || cos_b <= 0.0) continue;
          const double weight = cos_a * cos_b / (r.squaredNorm() * r.squaredNorm());
          total += weight;
          ++traced;
          if (!visibility.occluded(from, a.polygon.plane.normal, to, b.polygon.plane.normal))
            seen += weight;
        }
        if (total == 0.0) continue;
        ++pairs;
        if (seen == 0.0) continue;
        const double kernel = exchange_area_m2(a.polygon, b.polygon, kKernelTolerance);
        factors.exchange_area_m2(static_cast<Index>(j), static_cast<Index>(i)) =
            seen < total ? kernel * seen / total : kernel;
        if (seen < total) sampled[i].push_back(static_cast<std::uint32_t>(j));
      }
      rays += traced;
    }
  });
  for (Index i = 0; i < n; ++i)
    for (Index j = i + 1; j < n; ++j)
      factors.exchange_area_m2(i, j) = factors.exchange_area_m2(j, i);
  if (test_closure(mesh, scene, visibility, factors.usable, 1).closed)
    repair_closure(factors.exchange_area_m2, factors.area_m2, factors.usable, sampled,
                   ClosureRepair::scaling);
  for (Index i = 0; i < n; ++i)
    factors.summary.row_sum_max = std::max(
        factors.summary.row_sum_max, factors.exchange_area_m2.col(i).sum() / factors.area_m2[i]);
  counts.rays = rays;
  counts.pairs_tested = pairs;
  return factors;
}

FormFactors factors_of(const PatchMesh& mesh, const Scene& scene, const Model& model,
                       ModelSolution& counts) {
  const Visibility visibility(mesh, scene);
  if (model.occlusion && model.every_pair)
    return rays_for_every_pair(mesh, scene, visibility, counts);
  FormFactorOptions options;
  options.method = FormFactorMethod::exact_visibility;
  options.occlusion = model.occlusion;
  options.relative_tolerance = kKernelTolerance;
  FormFactors factors = form_factors(mesh, scene, visibility, options);
  counts.pairs_tested = factors.summary.pairs_sampled;
  return factors;
}

// A value of each element's material, elements x bands.
BandMatrix of_materials(const PatchMesh& mesh, const Scene& scene,
                        const std::vector<double>& (*values)(const Material&)) {
  BandMatrix all(static_cast<Index>(mesh.size()), static_cast<Index>(scene.bands.size()));
  for (Index i = 0; i < all.rows(); ++i) {
    const Surface& surface =
        scene.surfaces[mesh.surface_of(mesh.patches[static_cast<std::size_t>(i)])];
    all.row(i) =
        Eigen::Map<const Eigen::RowVectorXd>(values(scene.material_of(surface)).data(), all.cols());
  }
  return all;
}

// Radiosity in the bands of `scene`, all of which are solved.
BandMatrix solve_bands(const Scene& scene, const PatchMesh& mesh, const Model& model,
                       ModelSolution& counts) {
  const Gather gather(mesh, scene, model.occlusion);
  const ElementTree tree = element_tree(mesh);
  const ShaftCulling culling(mesh, scene, model.occlusion);
  const BandMatrix direct = mean_direct(mesh, scene, gather, tree, culling);
  const BandMatrix rho = of_materials(
      mesh, scene,
      [](const Material& m) -> const std::vector<double>& { return m.reflectance.values; });
  const BandMatrix own = of_materials(
      mesh, scene,
      [](const Material& m) -> const std::vector<double>& { return m.exitance.values; });
  const BandMatrix source = rho.cwiseProduct(direct);
  counts.bands_solved = model.interreflection ? scene.bands.size() : 0;
  if (!model.interreflection) return own + source;
  const FormFactors factors = factors_of(mesh, scene, model, counts);
  counts.form_factors = mesh.size() * (mesh.size() - 1) / 2;
  SolveOptions options;
  options.relative_bound = model.solver_bound;
  options.share_bands = model.share_bands;
  BandMatrix reflected;
  const SolveSummary summary = solve_radiosity(factors, rho, source, options, reflected);
  counts.matrix_passes = summary.matrix_passes;
  counts.bands_solved -= static_cast<std::size_t>(summary.bands_reduced);
  return own + reflected;
}

double difference_of(const BandMatrix& a, const BandMatrix& b) {
  double largest = 0.0;
  for (Index k = 0; k < a.cols(); ++k)
    if (const double scale = b.col(k).cwiseAbs().maxCoeff(); scale > 0.0)
      largest = std::max(largest, (a.col(k) - b.col(k)).cwiseAbs().maxCoeff() / scale);
  return largest;
}

double brightest_reflectance(const Scene& scene) {
  double rho = 0.0;
  for (const Surface& surface : scene.surfaces)
    for (double r : scene.material_of(surface).reflectance.values) rho = std::max(rho, r);
  return rho;
}

// Mean irradiance, surfaces x bands.
BandMatrix means_of_surfaces(const Prediction& prediction) {
  const GridSolution& grid = prediction.fine();
  const BandMatrix irradiance = prediction.irradiance();
  BandMatrix sum =
      BandMatrix::Zero(static_cast<Index>(prediction.scene().surfaces.size()), irradiance.cols());
  Eigen::VectorXd area_m2 = Eigen::VectorXd::Zero(sum.rows());
  for (std::size_t i = 0; i < grid.mesh.size(); ++i) {
    const auto s = static_cast<Index>(grid.mesh.surface_of(grid.mesh.patches[i]));
    const double free_m2 = grid.free_area_m2[static_cast<Index>(i)];
    sum.row(s) += free_m2 * irradiance.row(static_cast<Index>(i));
    area_m2[s] += free_m2;
  }
  return area_m2.cwiseMax(1e-300).cwiseInverse().asDiagonal() * sum;
}

// Root mean square over the area, relative to the mean; the worst band.
double rms_difference(const Prediction& a, const Prediction& b) {
  const BandMatrix of_a = a.irradiance(), of_b = b.irradiance();
  const Eigen::VectorXd& area_m2 = b.fine().free_area_m2;
  double worst = 0.0;
  for (Index k = 0; k < of_b.cols(); ++k)
    if (const double mean = area_m2.dot(of_b.col(k)) / area_m2.sum(); mean > 0.0)
      worst = std::max(
          worst,
          std::sqrt(area_m2.dot((of_a.col(k) - of_b.col(k)).cwiseAbs2()) / area_m2.sum()) / mean);
  return worst;
}

class Checks {
 public:
  Checks(const Scene& scene, const Plan& plan, std::size_t elements)
      : scene_(scene),
        mesh_(uniform_mesh(scene, edge_for_count(scene, elements))),
        needed_(needed_model(plan)),
        planned_(solve_model(scene, mesh_, needed_)) {}

  // Means by polynomials against those of constants on three grids: the mean and band whose
  // difference comes nearest to what both bounds together allow.
  void hold_polynomials(const Plan& plan, double target, std::size_t elements) {
    ClaimCheck check;
    check.claim = "polynomials, not constants";
    check.work = "unknowns";
    PolynomialOptions few;
    few.degree = plan.degree;
    few.elements = plan.elements;
    few.kernel_tolerance = kernel_tolerance_for(target);
    double start = process_cpu_s();
    const PolynomialMeans means = polynomial_means(scene_, few);
    check.planned_s = process_cpu_s() - start;
    PredictOptions many;
    many.elements = std::max(elements, kLeastConstants);
    start = process_cpu_s();
    const Prediction constants(scene_, many);
    check.full_s = process_cpu_s() - start;
    check.planned_work = static_cast<double>(means.unknowns);
    check.full_work = static_cast<double>(constants.fine().mesh.size());
    check.allowed_why = "both bounds";
    const BandMatrix of_constants = means_of_surfaces(constants);
    const BandMatrix bound = constants.surface_irradiance_bound() + means.irradiance_bound;
    double worst = -1.0;
    for (Index s = 0; s < bound.rows(); ++s)
      for (Index k = 0; k < bound.cols(); ++k) {
        if (!(means.irradiance(s, k) > 0.0)) continue;
        const double off = std::abs(means.irradiance(s, k) - of_constants(s, k));
        if (off / bound(s, k) <= worst) continue;
        worst = off / bound(s, k);
        check.difference = off / of_constants(s, k);
        check.allowed = bound(s, k) / of_constants(s, k);
      }
    checks_.push_back(std::move(check));
  }

  // Irradiance by links against that of the matrix, rms over the area relative to the mean.
  void hold_links(double tolerance) {
    PredictOptions options;
    // The finest grid alone counts.
    options.mesh_of_grid = [this](int grid) {
      return grid < 2 ? uniform_mesh(scene_, scene_.diameter_m()) : mesh_;
    };
    options.near_sources = false;
    const auto solve = [&](double& processor_s) {
      const double start = process_cpu_s();
      auto prediction = std::make_unique<Prediction>(scene_, options);
      processor_s = process_cpu_s() - start;
      return prediction;
    };
    ClaimCheck check;
    check.claim = "links instead of a matrix";
    check.work = "numbers";
    const auto matrix = solve(check.full_s);
    options.find_exchange = hierarchical_exchange({.relative_tolerance = tolerance});
    const auto links = solve(check.planned_s);
    const auto n = static_cast<double>(mesh_.size());
    check.full_work = 0.5 * n * n;
    check.planned_work = static_cast<double>(links->fine().links->links);
    check.difference = rms_difference(*links, *matrix);
    check.allowed = kLinksAtMost * tolerance;
    check.allowed_why = "three times the tolerance, which is an estimate";
    checks_.push_back(std::move(check));
  }

  // The planned answer against that of `model`, which makes one claim less.
  void hold(const std::string& claim, const Model& model, const char* work,
            double (*count)(const ModelSolution&), double allowed, const std::string& why) {
    const ModelSolution full = solve_model(scene_, mesh_, model);
    checks_.push_back({claim, work, count(planned_), count(full), planned_.processor_s,
                       full.processor_s, difference_of(planned_.radiosity, full.radiosity), allowed,
                       why});
  }

  const Model& needed() const { return needed_; }
  std::vector<ClaimCheck> take() { return std::move(checks_); }

 private:
  const Scene& scene_;
  PatchMesh mesh_;
  Model needed_;
  ModelSolution planned_;
  std::vector<ClaimCheck> checks_;
};

double rays_of(const ModelSolution& s) { return static_cast<double>(s.rays); }
double bands_of(const ModelSolution& s) { return static_cast<double>(s.bands_solved); }
double factors_of(const ModelSolution& s) { return static_cast<double>(s.form_factors); }
double passes_of(const ModelSolution& s) { return s.matrix_passes; }

}  // namespace

Model needed_model(const Plan& plan) {
  Model model;
  model.occlusion = plan.needs.occlusion;
  model.every_pair = false;
  model.interreflection = plan.needs.interreflection;
  model.every_band = false;
  model.share_bands = true;
  model.solver_bound = plan.solver_bound;
  return model;
}

ModelSolution solve_model(const Scene& scene, const PatchMesh& mesh, const Model& model) {
  ModelSolution solution;
  const double start = process_cpu_s();
  if (model.every_band) {
    solution.radiosity = solve_bands(scene, mesh, model, solution);
  } else {
    const Requirements needs = requirements(scene);
    const BandMatrix some =
        solve_bands(in_bands(scene, needs.distinct_bands), mesh, model, solution);
    solution.radiosity.resize(some.rows(), static_cast<Index>(scene.bands.size()));
    for (Index b = 0; b < solution.radiosity.cols(); ++b) {
      const auto band = static_cast<std::size_t>(b);
      solution.radiosity.col(b) =
          needs.band_scale[band] * some.col(static_cast<Index>(needs.band_source[band]));
    }
  }
  solution.processor_s = process_cpu_s() - start;
  return solution;
}

std::vector<ClaimCheck> check_claims(const Scene& scene, const Plan& plan, std::size_t elements) {
  if (plan.needs.path_tracing) return {};
  Checks checks(scene, plan, elements);
  const double amplified = 1.0 / (1.0 - brightest_reflectance(scene));
  const double kernel = kKernelTolerance * amplified;
  const double stop = 2.0 * plan.solver_bound;
  if (!plan.needs.occlusion && plan.needs.interreflection) {
    Model model = checks.needed();
    model.occlusion = model.every_pair = true;
    checks.hold("no occlusion", model, "rays", rays_of, kernel + stop,
                "tolerance of the kernel / (1 - largest reflectance), and both solvers' bounds");
  }
  if (!plan.needs.interreflection) {
    Model model = checks.needed();
    model.interreflection = true;
    checks.hold("no interreflection", model, "form factors", factors_of, kRounding, "rounding");
  }
  if (plan.needs.distinct_bands.size() < scene.bands.size()) {
    Model model = checks.needed();
    model.every_band = true;
    model.share_bands = false;
    checks.hold("bands that are multiples", model, "bands", bands_of, stop + kRounding,
                "both solvers' bounds");
  } else if (plan.bands_solved < plan.needs.distinct_bands.size()) {
    Model model = checks.needed();
    model.share_bands = false;
    checks.hold("bands on the basis of others", model, "bands", bands_of, stop,
                "both solvers' bounds");
  }
  if (plan.needs.interreflection) {
    Model model = checks.needed();
    model.solver_bound = 1e-13;
    checks.hold("solver stops early", model, "passes", passes_of, plan.solver_bound + 1e-13,
                "the solver's bound");
  }
  if (plan.degree > 0) checks.hold_polynomials(plan, plan.target_error, elements);
  if (plan.exchange == PlannedExchange::hierarchical) checks.hold_links(plan.link_tolerance);
  if (!plan.needs.occlusion) {
    const bool exact = !plan.needs.interreflection;
    checks.hold("all of it", full_model(), "rays", rays_of, exact ? kRounding : kernel + stop,
                "sum of the above");
  }
  return checks.take();
}

}  // namespace truebox
