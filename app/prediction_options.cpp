// SPDX-License-Identifier: BSD-3-Clause
#include "prediction_options.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <stdexcept>

#include "plan_settings.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "transport/streamed_exchange.h"

namespace truebox::app {
namespace {

constexpr std::size_t kMostGathered = 20000;  // elements: minutes of gathering
// Of a target error, unless --elements says where to start: its bound foretells the rest.
constexpr std::size_t kFirstElements = 1000;

// Of the finest of three grids, cut in four twice from a sixteenth of them, as Prediction does.
std::size_t finest_elements(const Scene& scene, std::size_t asked_for) {
  const double edge_m = edge_for_count(scene, std::max<std::size_t>(1, asked_for / 16));
  return uniform_mesh(scene, edge_m, 2).size();
}

Goal goal_of(const PredictionArguments& a, const Scene& scene) {
  try {
    return goal_of_name(a.adaptive == kDefaultGoal ? "everywhere" : a.adaptive, scene);
  } catch (const std::invalid_argument& error) {
    throw InputError("--adaptive", 0, "a goal that this scene has", error.what());
  }
}

}  // namespace

std::optional<double> share_of(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  const std::string rest = end;
  const double share = rest == "%" ? 0.01 * value : value;
  if (end == text.c_str() || !(rest.empty() || rest == "%") || !(share > 0.0 && share < 1.0))
    return std::nullopt;
  return share;
}

std::string check_share(const std::string& text) {
  return share_of(text) ? "" : "a share such as 0.5% or 0.005 expected, not " + text;
}

Scene read_scene_of(const PredictionArguments& a) {
  return read_scene(a.scene, {.lamp_weighted_bands = a.bands});
}

namespace {

const std::map<std::string, Reconstruction>& reconstructions() {
  static const std::map<std::string, Reconstruction> kNames = {
      {"smooth", Reconstruction::smooth},
      {"constant", Reconstruction::constant},
      {"averaged", Reconstruction::averaged},
      {"least-squares", Reconstruction::least_squares}};
  return kNames;
}

ClosureRepair repair_of(const PredictionArguments& a) {
  if (a.repair == "scaling") return ClosureRepair::scaling;
  if (a.form_factors == "streamed" || a.form_factors == "hierarchical" || a.solve_grid)
    throw InputError("--repair", 0, "scaling where no matrix is kept in this process", a.repair);
  return a.repair == "none" ? ClosureRepair::none : ClosureRepair::least_squares;
}

}  // namespace

void add_prediction_options(CLI::App& command, PredictionArguments& a,
                            const std::vector<std::string>& more_methods) {
  std::vector<std::string> methods = method_names();
  methods.insert(methods.begin(), more_methods.begin(), more_methods.end());
  command.add_option("SCENE", a.scene, "scene file (TOML)")->required();
  command.add_option("--elements", a.elements, "elements of the fine grid, about")
      ->capture_default_str()
      ->check(CLI::Range(4, 200000));
  command
      .add_option("--rays", a.rays,
                  "of ray-casting: rays of a pair that something may stand between")
      ->capture_default_str()
      ->check(CLI::Range(4, 4096));
  command.add_option("--method", a.method, "how the radiosity system is solved; see truebox sweep")
      ->capture_default_str()
      ->check(CLI::IsMember(methods));
  command
      .add_option(
          "--form-factors", a.form_factors,
          "exact-visibility (shadow outlines, no noise) or ray-casting: a matrix of all "
          "pairs; streamed: the same as exact-visibility without keeping it, for little "
          "memory and forty to seventy times the time; hierarchical: links between groups of "
          "elements, for many elements")
      ->capture_default_str()
      ->check(CLI::IsMember({"exact-visibility", "ray-casting", "streamed", "hierarchical"}));
  command
      .add_option("--repair", a.repair,
                  "of closed scenes: how partly hidden factors are changed until rows sum to one: "
                  "scaling (Sinkhorn), least-squares (the least relative changes) or none")
      ->capture_default_str()
      ->check(CLI::IsMember({"scaling", "least-squares", "none"}));
  command
      .add_option("--link-tolerance", a.link_tolerance,
                  "hierarchical: share of the mean irradiance that links may leave out, rms")
      ->capture_default_str()
      ->check(CLI::Range(1e-6, 0.5));
  command.add_option("--memory", a.memory_MiB, "MiB that form factors or links may take")
      ->capture_default_str()
      ->check(CLI::Range(16, 1 << 24));
  command.add_option("--solver-bound", a.relative_bound, "stop at this relative error bound")
      ->capture_default_str()
      ->check(CLI::Range(1e-13, 0.5));
  command
      .add_option(
          "--target-error", a.target_error,
          "choose elements and solver bound so that the error bound of what is asked for is "
          "this share (\"0.5%\" or 0.005) of its irradiance or less: of each place of probe, "
          "else of each surface's mean; in every band")
      ->check(check_share);
  command.add_flag(std::string("--adaptive{") + kDefaultGoal + "}", a.adaptive,
                   "refine where the error comes from instead of everywhere; =everywhere, "
                   "=irradiance (rms, relative to its mean), =camera:NAME, =surface:NAME or "
                   "=parameter:MATERIAL[@CAMERA] (its reflectance in a fit) says whose error");
  command.add_flag("--discontinuities", a.discontinuities,
                   "elements follow the lines along which light and its derivatives jump: contacts "
                   "and outlines of shadows, e.g. solve box.toml --discontinuities -o box.glb");
  command
      .add_option("--reconstruction", a.reconstruction,
                  "how element means become values at points of surfaces: smooth (quadratics, what "
                  "else is done), constant, or radiosities of vertices: averaged (extrapolated to "
                  "the edges, Cohen & Greenberg) or least-squares; e.g. solve box.toml "
                  "--reconstruction averaged -o box.glb")
      ->check(CLI::IsMember(reconstructions()));
  command
      .add_option("--bands", a.bands,
                  "so many bands, weighted by the lamps' light, instead of the scene's: 16 for "
                  "colours (see truebox plan --target-colour)")
      ->check(CLI::Range(1, 1000));
  auto* automatic = command.add_flag(
      std::string("--auto{") + kDefaultGoal + "}", a.automatic,
      "as truebox plan decides for --target-error (1%); =camera:NAME or =surface:NAME as for "
      "--adaptive; =irradiance: the rms error of irradiance over all surfaces");
  for (const char* decided :
       {"--elements", "--rays", "--method", "--form-factors", "--link-tolerance", "--solver-bound",
        "--adaptive", "--discontinuities"})
    automatic->excludes(command.get_option(decided));
  command.add_option("--threads", a.threads, "threads, 0 for all")->check(CLI::Range(0, 1024));
  command.add_flag("--quiet", a.quiet, "no progress");
}

const CameraDescription& find_camera(const Scene& scene, const std::string& name) {
  std::string known;
  for (const auto& [key, camera] : scene.cameras) {
    if (key == name || (name.empty() && scene.cameras.size() == 1)) return camera;
    known += (known.empty() ? "" : ", ") + key;
  }
  throw InputError(scene.path, 0, "one of the cameras: " + (known.empty() ? "(none)" : known),
                   name.empty() ? "no --camera" : "\"" + name + "\"");
}

Progress terminal_progress(bool quiet) {
  if (quiet || !::isatty(STDERR_FILENO)) return {};
  auto last = std::make_shared<std::pair<std::string, int>>("", -1);
  return [last](const std::string& stage, double share) {
    const std::pair<std::string, int> now(stage, static_cast<int>(100.0 * share));
    if (now == *last) return;
    *last = now;
    // The rest of the line may be that of a longer stage.
    if (now.second == 100)
      fmt::print(stderr, "\r\033[K");
    else
      fmt::print(stderr, "\r{:<24} {:3d} %\033[K", stage, now.second);
    std::fflush(stderr);
  };
}

std::unique_ptr<Predicted> predict(const PredictionArguments& wished) {
  auto predicted = std::make_unique<Predicted>();
  predicted->scene = read_scene_of(wished);
  predicted->plan = wished.as_planned;
  const PredictionArguments a =
      wished.automatic.empty() ? wished : planned(predicted->scene, wished, predicted->plan);
  std::unique_ptr<tbb::global_control> limit;
  if (a.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(a.threads));
  PredictOptions options;
  options.progress = terminal_progress(a.quiet);
  options.elements = a.elements;
  options.form_factors.rays = a.rays;
  if (a.form_factors == "ray-casting") options.form_factors.method = FormFactorMethod::ray_casting;
  options.form_factors.repair = repair_of(a);
  if (a.form_factors == "streamed") {
    options.find_exchange = streamed_exchange;
    options.solve.share_bands = false;  // every pass makes the matrix anew, for one band or for all
  }
  if (a.gather_edges) options.gathered_up_to = kMostGathered;
  if (a.gather_edges && !a.reconstruction.empty())
    throw InputError("--reconstruction", 0, "the smooth field with --gather-edges",
                     a.reconstruction);
  if (!a.reconstruction.empty()) options.reconstruction = reconstructions().at(a.reconstruction);
  options.solve_grid = a.solve_grid;
  options.watch_finest = a.watch_finest;
  options.form_factors.memory_limit_bytes = a.memory_MiB << 20;
  if (a.form_factors == "hierarchical") {
    if (!a.target_error.empty())
      throw InputError("--target-error", 0,
                       "form factors with a bound (exact-visibility or streamed): links have an "
                       "estimate",
                       "--form-factors hierarchical");
    const HierarchyOptions hierarchy{a.link_tolerance, a.memory_MiB << 20};
    const std::size_t finest = finest_elements(predicted->scene, a.elements);
    try {
      require_memory(finest, hierarchy);
    } catch (const std::length_error& error) {
      throw std::length_error(fmt::format(
          "{}; of them --elements {} asked for {:.0f} %, the rest are what small surfaces need",
          error.what(), a.elements,
          100.0 * static_cast<double>(a.elements) / static_cast<double>(finest)));
    }
    if (options.progress)
      fmt::print(stderr, "memory: about {} MiB for {} elements\n",
                 estimated_bytes(finest, hierarchy) >> 20, finest);
    options.find_exchange = hierarchical_exchange(hierarchy);
  }
  options.solve.method = method_of_name(a.method);
  options.solve.relative_bound = a.relative_bound;
  options.error_shares = a.error_shares;
  options.sensitivities = a.sensitivities;
  Predictor solve = [&](const PredictOptions& attempt) {
    return std::make_unique<Prediction>(predicted->scene, attempt);
  };
  if (!a.adaptive.empty()) {
    if (a.solve_grid || a.form_factors == "streamed")
      throw InputError("--adaptive", 0, "form factors that are kept, in one process",
                       a.solve_grid ? "--distributed" : "--form-factors " + a.form_factors);
    const Goal goal = goal_of(a, predicted->scene);
    solve = [&predicted, goal, &a](const PredictOptions& attempt) {
      AdaptReport report;
      auto prediction =
          predict_adaptively(predicted->scene, attempt, goal, &report, a.discontinuities);
      predicted->adapt_steps = std::move(report.steps);
      if (a.discontinuities) predicted->lines = report.lines;
      return prediction;
    };
  } else if (a.discontinuities) {
    solve = [&predicted](const PredictOptions& attempt) {
      return predict_along_discontinuities(predicted->scene, attempt, &predicted->lines.emplace());
    };
  }
  const auto start = std::chrono::steady_clock::now();
  if (a.target_error.empty()) {
    predicted->prediction = solve(options);
  } else {
    if (options.elements == PredictOptions{}.elements)
      options.elements = std::max(kFirstElements, least_reliable_elements(predicted->scene));
    predicted->target = predict_to_target(options, *share_of(a.target_error), solve,
                                          a.judge ? a.judge : relative_bound_of_surfaces);
    predicted->prediction = std::move(predicted->target.prediction);
    predicted->misses_target = !predicted->target.is_reached;
  }
  predicted->seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return predicted;
}

namespace {

// The exponent p of cost ~ n^p by least squares over the three grids.
double fitted_exponent(const Prediction& prediction, double (*cost)(const LinkSummary&)) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const GridSolution* grid :
       {&prediction.fine(), &prediction.coarse(), &prediction.coarsest()}) {
    const double u = std::log(static_cast<double>(grid->mesh.size()));
    const double v = std::log(std::max(1e-9, cost(*grid->links)));
    n += 1.0, x += u, y += v, xx += u * u, xy += u * v;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

std::string describe_repair(const FormFactorSummary& f) {
  switch (f.repair) {
    case ClosureRepair::none: return "left as they are";
    case ClosureRepair::scaling:
      return fmt::format("partly hidden factors scaled by at most {:.1e}", f.repair_max);
    case ClosureRepair::least_squares: break;
  }
  return fmt::format(
      "partly hidden factors changed by {:.1e} rms and {:.1e} at most, the least that will do "
      "({} came out below 0 and were set to 0)",
      f.repair_rms, f.repair_max, f.repair_negative);
}

// "4900000": what is foretold to two digits.
std::string two_digits(double x) {
  const double unit = std::pow(10.0, std::floor(std::log10(x)) - 1.0);
  return fmt::format("{:.0f}", x < 10.0 ? x : unit * std::round(x / unit));
}

// Lamps that nothing sees and scenes without any: why it is dark.
std::string describe_darkness(const Predicted& p) {
  const PatchMesh& mesh = p.prediction->fine().mesh;
  std::vector<char> sees(p.scene.surfaces.size(), 0);
  for (std::size_t i = 0; i < mesh.size(); ++i)
    sees[mesh.surface_of(mesh.patches[i])] |= p.prediction->fine().usable[i];
  bool is_lit = false;
  std::string text;
  for (std::size_t s = 0; s < sees.size(); ++s) {
    const Surface& surface = p.scene.surfaces[s];
    if (surface.is_opening || !p.scene.material_of(surface).emits()) continue;
    is_lit = true;
    if (!sees[s])
      text +=
          fmt::format("  {} emits and faces no surface of the scene: its light reaches nothing\n",
                      surface.name);
  }
  return is_lit ? text : text + "  no surface emits: all of the scene is dark\n";
}

std::string describe_links(const Prediction& prediction) {
  const LinkSummary& links = *prediction.fine().links;
  return fmt::format(
             "  links: {} between {} elements ({:.1f} an element), {} groups hidden, {} rays; "
             "{:.0f} "
             "MiB; they leave out {:.1e} rms (estimated)\n",
             links.links, links.elements,
             static_cast<double>(links.links) / static_cast<double>(links.elements), links.hidden,
             prediction.fine().form_factors.rays, static_cast<double>(links.bytes) / (1 << 20),
             links.relative_error) +
         fmt::format(
             "  cost over the three grids: links ~ n^{:.2f}, processor time ~ n^{:.2f} ({:.3g} s "
             "here)\n",
             fitted_exponent(prediction,
                             [](const LinkSummary& l) { return static_cast<double>(l.links); }),
             fitted_exponent(prediction, [](const LinkSummary& l) { return l.processor_s; }),
             links.processor_s);
}

}  // namespace

std::string name_of_band(const Scene& scene, std::size_t band) {
  return scene.is_total ? "all wavelengths" : fmt::format("{:.0f} nm", scene.bands.centre_nm(band));
}

std::string describe_target(const Predicted& p) {
  std::string text;
  for (const TargetStep& step : p.target.steps)
    text += fmt::format("  {} elements: largest bound {:.3g} % ({})\n", step.elements,
                        100.0 * step.relative_bound, step.where);
  if (!p.misses_target) return text;
  if (p.target.elements_needed == 0.0)
    return text + "  the target error is not reached: " + p.prediction->fine().solve.brief() + "\n";
  const double fits = p.target.elements_that_fit;
  return text + fmt::format(
                    "  the target error is not reached: some {} elements are foretold for it ({} "
                    "MiB as a matrix); {:.0f} fit, for which a bound of {:.2g} % is foretold\n"
                    "  further reach: more --memory, or --form-factors streamed (no matrix, much "
                    "slower)\n",
                    two_digits(p.target.elements_needed),
                    two_digits(std::pow(p.target.elements_needed, 2) * sizeof(double) / (1 << 20)),
                    fits, 100.0 * p.target.bound_that_fits);
}

std::string describe(const Predicted& p) {
  const GridSolution& grid = p.prediction->fine();
  const FormFactorSummary& f = grid.form_factors;
  std::string text = p.plan.empty() ? "" : "  as planned: " + p.plan + "\n";
  text += fmt::format("{} elements ({} on the next coarser grid), {} bands, {:.2f} s\n",
                      grid.mesh.size(), p.prediction->coarse().mesh.size(), p.scene.bands.size(),
                      p.seconds);
  for (const auto& reason : p.prediction->needs().reasons) text += "  " + reason + "\n";
  if (!p.prediction->needs().interreflection) return text;
  if (!p.adapt_steps.empty())
    text +=
        fmt::format("  adapted in {} steps from {} to {} elements, then each cut in four\n",
                    p.adapt_steps.size(), p.adapt_steps.front().cells, p.adapt_steps.back().cells);
  if (const auto& lines = p.lines)
    text += fmt::format(
        "  elements follow {} lines of contact, {} across which the slope of direct light jumps "
        "and "
        "{} its curvature, close ones as one; {} weaker ones are left out\n",
        lines->of_order[0], lines->of_order[1], lines->of_order[2], lines->left_out);
  if (grid.links)
    text += describe_links(*p.prediction);
  else
    text += fmt::format("  form factors: {} pairs without anything between, {} hidden, {} {}\n",
                        f.pairs_unoccluded, f.pairs_hidden, f.pairs_sampled,
                        f.method == FormFactorMethod::exact_visibility
                            ? "partly hidden, by outlines of the shadows"
                            : fmt::format("sampled with {} rays", f.rays));
  if (f.streamed_passes > 0)
    text += fmt::format(
        "  factors not kept: {} passes over all pairs to find and close them, {:.0f} to solve; a "
        "matrix would take {:.0f} MiB\n",
        f.streamed_passes, std::ceil(grid.solve.matrix_passes),
        std::pow(static_cast<double>(grid.mesh.size()), 2) * sizeof(double) / (1 << 20));
  if (f.buried_patches > 0)
    text +=
        fmt::format("  {} elements lie under another surface and see nothing\n", f.buried_patches);
  text += describe_darkness(p);
  if (f.covered_patches > 0)
    text += fmt::format("  {} elements lie partly under another surface: their free parts count\n",
                        f.covered_patches);
  text += f.closed ? fmt::format(
                         "  closure: none of {} rays escaped; row sums off by {:.1e} mean, {:.1e} "
                         "max; {}, then off by {:.1e}\n",
                         f.closure_rays, f.closure_error_mean, f.closure_error_max,
                         describe_repair(f), f.closure_residual_max)
                   : fmt::format("  the scene is open (no repair); largest row sum {:.6f}\n",
                                 f.row_sum_max);
  text += "  radiosity: " + grid.solve.brief() + "\n";
  if (const auto& shares = p.prediction->error_shares())
    text += fmt::format("  mean error bound: grids {:.2g} %, form factors {:.1g} %, {} {:.1g} %\n",
                        100.0 * shares->discretisation, 100.0 * shares->form_factors,
                        grid.links ? "links and solver" : "solver", 100.0 * shares->solver);
  text += describe_target(p);
  if (grid.links)
    text +=
        "  error bound: an estimate only, with three times what the links are thought to leave "
        "out\n";
  else if (!p.prediction->bound_is_reliable())
    text += fmt::format(
        "  error bound: an estimate only, the grid is too coarse ({} elements a surface; {} "
        "wanted)\n",
        grid.mesh.size() / grid.mesh.pieces.size(), Prediction::kPatchesAPiece);
  return text;
}

std::vector<SurfaceMean> surface_means(const Prediction& prediction) {
  const Scene& scene = prediction.scene();
  const SurfaceMeans of = prediction.surface_means();
  std::vector<SurfaceMean> means;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const auto row = static_cast<Eigen::Index>(s);
    if (of.area_m2[row] == 0.0) continue;
    const Material& material = scene.material_of(scene.surfaces[s]);
    const Eigen::Map<const Eigen::VectorXd> rho(material.reflectance.values.data(),
                                                of.irradiance.cols()),
        exitance(material.exitance.values.data(), of.irradiance.cols());
    means.push_back({scene.surfaces[s].name, of.area_m2[row],
                     exitance + rho.cwiseProduct(of.irradiance.row(row).transpose()),
                     rho.cwiseProduct(of.error_bound.row(row).transpose()),
                     of.irradiance.row(row).transpose(), of.error_bound.row(row).transpose()});
  }
  return means;
}

}  // namespace truebox::app
