// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>

#include "figures/disc_plot.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "transport/nusselt.h"
#include "transport/view_factors.h"
#include "view_factor_commands.h"

namespace truebox::app {
namespace {

struct ViewFactorArguments {
  std::string scene, output, method = "planned", from, to, nusselt_plot;
  ViewFactorOptions options;
  int threads = 0;
  bool quiet = false;
};

struct SurfacePair {
  std::size_t i = 0, j = 0;
  ViewFactorEstimate estimate;
};

std::vector<std::size_t> chosen_surfaces(const Scene& scene, const std::string& name) {
  std::vector<std::size_t> chosen;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s)
    if (name.empty() || scene.surfaces[s].name == name) chosen.push_back(s);
  if (chosen.empty()) throw InputError(scene.path, 0, "a surface of the scene", '"' + name + '"');
  return chosen;
}

std::string quoted(const std::string& name) {
  std::string text = "\"";
  for (char c : name) text += c == '"' ? "\"\"" : std::string(1, c);
  return text + '"';
}

std::string as_csv(const Scene& scene, const ViewFactors& factors,
                   const std::vector<SurfacePair>& pairs) {
  std::string text = "from,to,view_factor,error_bound,method\n";
  for (const SurfacePair& pair : pairs) {
    const double area = factors.area_m2(pair.i);
    text += fmt::format("{},{},{:.15g},{:.2e},{}\n", quoted(scene.surfaces[pair.i].name),
                        quoted(scene.surfaces[pair.j].name), pair.estimate.exchange_area_m2 / area,
                        pair.estimate.error_bound_m2 / area, name_of(pair.estimate.method));
  }
  return text;
}

void print_summary(const Scene& scene, const ViewFactors& factors,
                   const std::vector<SurfacePair>& pairs) {
  std::map<std::string_view, std::size_t> methods;
  double bound = 0.0;
  for (const SurfacePair& pair : pairs) {
    ++methods[name_of(pair.estimate.method)];
    bound = std::max(bound, pair.estimate.error_bound_m2 / factors.area_m2(pair.i));
  }
  fmt::print("{}: {} view factors", scene.path, pairs.size());
  for (const auto& [name, count] : methods) fmt::print(", {} {}", count, name);
  fmt::print("; largest bound {:.1e}\n", bound);
}

// Nusselt's picture of one surface seen from the middle of another.
void write_nusselt_plot(const Scene& scene, const ViewFactorArguments& a) {
  if (a.from.empty() || a.to.empty())
    throw InputError(scene.path, 0, "--from and --to beside --nusselt-plot", "all pairs");
  const std::size_t from = chosen_surfaces(scene, a.from)[0], to = chosen_surfaces(scene, a.to)[0];
  const PointView view = view_from_centre(scene, from, to);
  DiscPlot plot;
  plot.title = fmt::format("{} seen from the middle of {}, Nusselt's analog", a.to, a.from);
  plot.caption = fmt::format("{} from the middle of {}: {:.6f}", a.to, a.from, view.factor);
  const auto add = [&](const std::vector<Polygon>& parts, bool filled) {
    for (const Polygon& part : parts) {
      DiscRegion region{{}, filled};
      for (const auto& p : nusselt_outline(view.point, view.normal, part, 32))
        region.outline.push_back({p.x(), p.y()});
      if (!region.outline.empty()) plot.regions.push_back(std::move(region));
    }
  };
  add(view.visible, true);
  add(scene.surfaces[to].pieces, false);
  write_file_atomically(a.nusselt_plot, to_svg(plot));
}

int view_factors(const ViewFactorArguments& a) {
  const Scene scene = read_scene(a.scene);
  if (!a.nusselt_plot.empty()) write_nusselt_plot(scene, a);
  std::unique_ptr<tbb::global_control> limit;
  if (a.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(a.threads));
  ViewFactorOptions options = a.options;
  options.method = *view_factor_method(a.method);
  const ViewFactors factors(scene);
  std::vector<SurfacePair> pairs;
  for (std::size_t i : chosen_surfaces(scene, a.from))
    for (std::size_t j : chosen_surfaces(scene, a.to))
      if (i != j || scene.surfaces[i].pieces.size() > 1) pairs.push_back({i, j, {}});
  const auto progress = terminal_progress(a.quiet);
  std::size_t done = 0;
  std::mutex lock;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pairs.size(), 1), [&](const auto& range) {
    for (std::size_t k = range.begin(); k < range.end(); ++k)
      pairs[k].estimate = factors.between(pairs[k].i, pairs[k].j, options);
    const std::lock_guard guard(lock);
    done += range.size();
    if (progress)
      progress("view factors", static_cast<double>(done) / static_cast<double>(pairs.size()));
  });
  const std::string text = as_csv(scene, factors, pairs);
  if (a.output.empty()) {
    fmt::print("{}", text);
  } else {
    write_file_atomically(a.output, "# quantity: view factor\n# unit: 1\n# source: truebox, " +
                                        scene.path + "\n" + text);
    print_summary(scene, factors, pairs);
  }
  std::size_t short_of_it = 0;
  for (const SurfacePair& pair : pairs) short_of_it += !pair.estimate.converged;
  const bool was_promised = options.method == ViewFactorMethod::planned ||
                            options.method == ViewFactorMethod::exact_visibility;
  if (short_of_it == 0 || !was_promised) return kAgrees;
  fmt::print(stderr,
             "truebox: {} of {} view factors are not within {:.1e} of their value; "
             "their bounds say by how much\n",
             short_of_it, pairs.size(), options.relative_tolerance);
  return kNotSolved;
}

}  // namespace

void add_viewfactor_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "viewfactor", "view factors between the scene's surfaces, occlusion included");
  auto a = std::make_shared<ViewFactorArguments>();
  std::vector<std::string> methods;
  for (ViewFactorMethod method : kViewFactorMethods) methods.emplace_back(name_of(method));
  command->add_option("SCENE", a->scene, "scene file (TOML)")->required();
  command->add_option("-o,--output", a->output, "CSV: from,to,view_factor,error_bound,method");
  command->add_option("--method", a->method, "how; planned picks for each pair")
      ->capture_default_str()
      ->check(CLI::IsMember(methods));
  command->add_option("--from", a->from, "only from this surface");
  command->add_option("--to", a->to, "only to this surface");
  command
      ->add_option("--tolerance", a->options.relative_tolerance,
                   "relative error bound asked of planned and exact-visibility")
      ->capture_default_str()
      ->check(CLI::Range(1e-13, 0.5));
  command->add_option("--rays", a->options.rays, "of ray-casting, each pair of flat convex pieces")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000'000));
  command->add_option("--arcs", a->options.arcs, "of nusselt: chords an edge")
      ->capture_default_str()
      ->check(CLI::Range(2, 100'000));
  command->add_option("--resolution", a->options.resolution, "of hemicube: pixels along its edge")
      ->capture_default_str()
      ->check(CLI::Range(2, 8192));
  command->add_option("--nusselt-plot", a->nusselt_plot,
                      "SVG of --to as seen from the middle of --from");
  command->add_option("--seed", a->options.seed, "of ray-casting")->capture_default_str();
  command->add_option("--threads", a->threads, "threads, 0 for all")->check(CLI::Range(0, 1024));
  command->add_flag("--quiet", a->quiet, "no progress");
  command->footer(
      "Example: truebox viewfactor reference/cornell_box/cornell_box.toml --from floor");
  command->callback([=, &chosen] { chosen = [=] { return view_factors(*a); }; });
}

}  // namespace truebox::app
