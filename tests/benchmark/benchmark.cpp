// SPDX-License-Identifier: BSD-3-Clause
// Speed against accuracy on the measured Cornell Box: a table for people, one JSON for plots.
// Times depend on the machine and on what else it does; compare only within one run.
#include "benchmark.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "scene/scene_file.h"

using truebox::FormFactorMethod;

namespace {

using namespace truebox::benchmark;

nlohmann::json as_json(const Accuracy& a) {
  return {{"elements", a.elements},
          {"coarse_elements", a.coarse_elements},
          {"compared", a.compared},
          {"solve_s", a.solve_s},
          {"probe_s", a.probe_s},
          {"rms_relative_error", a.rms_error},
          {"max_relative_error", a.max_error},
          {"rms_relative_standard_error_of_reference", a.rms_standard_error},
          {"mean_relative_bound", a.mean_bound},
          {"covered_share", a.covered}};
}

const char* name_of(FormFactorMethod method) {
  return method == FormFactorMethod::exact_visibility ? "outlines" : "rays";
}

nlohmann::json as_json(const ClosedBox& c) {
  return {{"elements", c.elements},
          {"threads", c.threads},
          {"form_factors", name_of(c.method)},
          {"link_tolerance", c.link_tolerance},
          {"links", c.links},
          {"job_s", c.job_s},
          {"job_cpu_s", c.job_cpu_s},
          {"cells_s", c.cells_s},
          {"rms_relative_error", c.rms_error},
          {"rms_relative_standard_error_of_reference", c.rms_standard_error},
          {"mean_relative_bound", c.mean_bound},
          {"covered_share", c.covered}};
}

nlohmann::json as_json_array(const std::vector<BandKernels>& rows) {
  nlohmann::json json = nlohmann::json::array();
  for (const BandKernels& k : rows)
    json.push_back({{"threads", k.threads},
                    {"triad_bytes_per_s", k.triad_bytes_per_s},
                    {"band_product_flop_per_s", k.product_flop_per_s},
                    {"band_product_one_band_bytes_per_s", k.product_one_band_bytes_per_s},
                    {"all_bands_to_one_band_time", k.bands_time_ratio},
                    {"solve_one_band_s", k.solve_one_band_s},
                    {"solve_all_bands_to_one_band_time", k.solve_time_ratio},
                    {"passes", k.matrix_passes},
                    {"passes_of_one_band", k.one_band_passes},
                    {"bands_reduced", k.bands_reduced}});
  return json;
}

nlohmann::json as_json(const Kernels& k) {
  return {{"elements", k.elements},
          {"bands", k.bands},
          {"occlusion_queries_per_s", k.occlusion_queries_per_s},
          {"form_factor_rays_per_s", k.rays_per_s},
          {"form_factor_pairs_per_s", k.pairs_per_s},
          {"form_factor_pairs_unoccluded_per_s", k.pairs_unoccluded_per_s},
          {"bands_by_threads", as_json_array(k.of_threads)}};
}

nlohmann::json as_json(const SolverWork& w) {
  return {{"relative_bound", w.relative_bound},
          {"krylov_passes", w.krylov_passes},
          {"krylov_s", w.krylov_s},
          {"gauss_seidel_passes", w.gauss_seidel_passes},
          {"gauss_seidel_s", w.gauss_seidel_s}};
}

void print(const Accuracy& a, double first_s) {
  fmt::print("{:>9}{:>10.3f}{:>9.1f}{:>12.3f}{:>12.3f}{:>12.3f}{:>12.3f}{:>11.1f}\n", a.elements,
             a.solve_s, a.solve_s / first_s, 100.0 * a.rms_error, 100.0 * a.max_error,
             100.0 * a.rms_standard_error, 100.0 * a.mean_bound, 100.0 * a.covered);
}

void print(const ClosedBox& c) {
  fmt::print("{:>9}{:>9}{:>10}{:>10.3f}{:>10.3f}{:>12.3f}{:>12.3f}{:>12.3f}{:>11.1f}\n", c.elements,
             c.threads, name_of(c.method), c.job_s, c.job_cpu_s, 100.0 * c.rms_error,
             100.0 * c.rms_standard_error, 100.0 * c.mean_bound, 100.0 * c.covered);
}

nlohmann::json as_json(const FormFactorRows& f) {
  return {{"elements", f.elements},
          {"threads", f.threads},
          {"points", f.points},
          {"tolerance", f.tolerance},
          {"cpu_s", f.cpu_s},
          {"wall_s", f.wall_s},
          {"pairs_per_s", f.pairs / f.cpu_s},
          {"row_sum_rms_error", f.row_sum_rms_error},
          {"row_sum_max_error", f.row_sum_max_error},
          {"buried_rows", f.buried_rows},
          {"row_difference", f.row_difference},
          {"memory_bytes", f.memory_bytes}};
}

// View3D on the same scene and kind of machine, one thread: time and rms error of row sums; and
// the setting that takes less of both here.
struct View3D {
  std::size_t elements;
  double time_s, rms_error;
  int points = 4;
  double tolerance = 5e-4;
};
constexpr View3D kView3D[] = {
    {497, 1.3, 1.7e-4}, {988, 4.1, 1.1e-4}, {2018, 16.8, 5.7e-5}, {5005, 117.0, 6.6e-5}};

// All pairs of the closed box next to the field's program. Its time is scaled by the pairs.
void compare_form_factors(const std::string& reference, nlohmann::json& json) {
  fmt::print(
      "\nForm factors of the closed box without rays, rows before any repair\n"
      "{:>9}{:>8}{:>8}{:>11}{:>9}{:>9}{:>9}{:>10}{:>10}{:>8}{:>12}{:>9}{:>10}{:>8}\n",
      "elements", "threads", "points", "tolerance", "CPU / s", "wall / s", "Mpairs/s", "rms", "max",
      "buried", "off by hand", "B / pair", "View3D rms", "x time");
  const auto line = [&](const View3D& other, int threads, int points, double tolerance, int rows) {
    const FormFactorRows f =
        measure_form_factor_rows(reference, other.elements, threads, points, tolerance, rows);
    const double scaled = std::pow(static_cast<double>(f.elements) / other.elements, 2);
    const double n = static_cast<double>(f.elements);
    fmt::print(
        "{:>9}{:>8}{:>8}{:>11.0e}{:>9.3f}{:>9.3f}{:>9.2f}{:>10.1e}{:>10.1e}{:>8}{:>12.1e}{:>9.2f}"
        "{:>10.1e}{:>8.0f}\n",
        f.elements, threads, points, tolerance, f.cpu_s, f.wall_s, 1e-6 * f.pairs / f.cpu_s,
        f.row_sum_rms_error, f.row_sum_max_error, f.buried_rows, f.row_difference,
        static_cast<double>(f.memory_bytes) / (n * n), other.rms_error,
        other.time_s * scaled / f.cpu_s);
    std::fflush(stdout);
    json["form_factor_rows"].push_back(as_json(f));
  };
  for (int threads : {1, 2})
    for (const View3D& other : kView3D)
      line(other, threads, other.points, other.tolerance, threads == 1 ? 8 : 0);
  line({497, 63.0, 2.3e-6}, 1, 0, 1e-6, 0);
  line({497, 63.0, 2.3e-6}, 1, 0, 1e-9, 8);
}

void print(const Kernels& k) {
  fmt::print("\nKernels, {} elements, {} bands\n", k.elements, k.bands);
  const auto line = [](const char* name, double value, const char* unit) {
    fmt::print("  {:<58}{:>10.3g} {}\n", name, value, unit);
  };
  line("occlusion queries alone", 1e-6 * k.occlusion_queries_per_s, "M/s");
  line("rays in form factors", 1e-6 * k.rays_per_s, "M/s");
  line("  share of the queries alone", 100.0 * k.rays_per_s / k.occlusion_queries_per_s, "%");
  line("pairs of form factors", 1e-6 * k.pairs_per_s, "M/s");
  line("pairs of form factors, nothing in between", 1e-6 * k.pairs_unoccluded_per_s, "M/s");
  for (const BandKernels& b : k.of_threads) {
    fmt::print("  {} thread{}\n", b.threads, b.threads == 1 ? "" : "s");
    line("memory bandwidth (triad)", 1e-9 * b.triad_bytes_per_s, "GB/s");
    line("matrix times all bands", 1e-9 * b.product_flop_per_s, "GFLOP/s");
    line("matrix times one band, matrix read", 1e-9 * b.product_one_band_bytes_per_s, "GB/s");
    line("time of all bands : time of one, a pass", b.bands_time_ratio, "");
    line("  the same of a whole solve", b.solve_time_ratio, "");
    line("solve of one band", 1e3 * b.solve_one_band_s, "ms");
    line("  its passes", b.one_band_passes, "");
    line("  passes of all bands together", b.matrix_passes, "");
    line("  bands less the most products of a pass", b.bands_reduced, "");
  }
}

// Path tracing's error falls like n^-1/2: what it takes to reach the error of each radiosity
// picture, from the longest run in the table.
void print(const PictureBenchmark& pictures) {
  fmt::print(
      "\nA picture of 512 x 512 pixels in 7 bands, relative error of a pixel in %\n"
      "{:>12}{:>10}{:>16}{:>10}{:>10}{:>10}{:>24}\n",
      "method", "setting", "processor / s", "solve", "median", "p99", "paths take, x as long");
  const auto& longest = *std::max_element(
      pictures.rows.begin(), pictures.rows.end(), [](const auto& a, const auto& b) {
        return (a.name == "paths" ? a.setting : 0) < (b.name == "paths" ? b.setting : 0);
      });
  for (const PictureError& row : pictures.rows) {
    const double ratio = longest.p99 / row.p99;
    fmt::print("{:>12}{:>10}{:>16.1f}{:>10.1f}{:>10.3f}{:>10.3f}{:>24}\n", row.name, row.setting,
               row.processor_s, row.solve_s, 100.0 * row.median, 100.0 * row.p99,
               row.name == "paths"
                   ? ""
                   : fmt::format("{:.0f}", longest.processor_s * ratio * ratio / row.processor_s));
  }
  fmt::print("  one standard error of the truth: median {:.3f}, p99 {:.3f}\n",
             100.0 * pictures.truth_noise.median, 100.0 * pictures.truth_noise.p99);
}

nlohmann::json as_json(const PictureBenchmark& pictures) {
  nlohmann::json json;
  for (const PictureError& row : pictures.rows)
    json.push_back({{"method", row.name},
                    {"setting", row.setting},
                    {"processor_s", row.processor_s},
                    {"solve_processor_s", row.solve_s},
                    {"median_relative_error", row.median},
                    {"p99_relative_error", row.p99}});
  return json;
}

std::vector<LinkGrowth> print_links(const truebox::Scene& closed_box) {
  fmt::print(
      "\nLinks and the full matrix (outlines), one thread\n{:>26}{:>10}{:>10}{:>10}{:>10}{:>10}"
      "{:>10}{:>10}{:>10}{:>10}\n",
      "scene", "tolerance", "elements", "links", "MiB", "CPU / s", "MiB", "CPU / s", "estimate",
      "error");
  std::vector<LinkGrowth> rows;
  const auto add = [&rows](const LinkGrowth& r) {
    fmt::print("{:>26}{:>10.2g}{:>10}{:>10}{:>10}{:>10.2f}{:>10}{:>10.2f}{:>10.1e}{:>10.1e}\n",
               r.scene.substr(0, 25), r.tolerance, r.elements, r.links, r.links_bytes >> 20,
               r.links_s, r.matrix_bytes >> 20, r.matrix_s, r.estimate, r.error);
    std::fflush(stdout);
    rows.push_back(r);
  };
  constexpr std::size_t kLargestMatrix = 11000;
  for (double tolerance : {1e-2, 3e-3})
    for (std::size_t count : {600u, 1200u, 2400u, 5000u, 10000u, 20000u})
      add(measure_links("closed box", closed_box, count, tolerance, count < kLargestMatrix));
  for (std::size_t count : {3400u, 10000u, 25000u, 50000u})
    add(measure_links("museum of more rooms", museum_of(count), count, 0.1, false));
  for (std::size_t count : {128u, 512u, 2048u}) add(measure_facing_squares(count));
  return rows;
}

void print(const std::vector<SolverWork>& solvers) {
  fmt::print("\nPasses over the matrix to a relative bound\n{:>12}{:>16}{:>16}{:>22}\n", "bound",
             "krylov", "gauss-seidel", "time, krylov = 1");
  for (const SolverWork& w : solvers)
    fmt::print("{:>12.0e}{:>16}{:>16}{:>22.2f}\n", w.relative_bound, w.krylov_passes,
               w.gauss_seidel_passes, w.gauss_seidel_s / w.krylov_s);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program{"Speed against accuracy on the measured Cornell Box"};
  std::vector<std::size_t> elements{500, 1000, 2000, 4000};
  std::vector<std::size_t> closed_elements{300, 600, 1200, 2400};
  bool only_closed_box = false;
  std::vector<double> link_tolerances{4e-2, 1e-2};
  std::size_t kernel_elements = 2000;
  std::string json_path, reference = TRUEBOX_REFERENCE_DIR;
  program.add_option("--elements", elements, "sizes of the fine grid")->delimiter(',');
  program.add_option("--closed-box-elements", closed_elements, "sizes for the closed box")
      ->delimiter(',');
  program.add_option("--link-tolerances", link_tolerances, "of hierarchical form factors")
      ->delimiter(',');
  program.add_flag("--only-closed-box", only_closed_box, "nothing but the closed box");
  program.add_option("--kernel-elements", kernel_elements, "size of the matrix for the kernels")
      ->capture_default_str();
  program.add_option("--json", json_path, "also write every number as JSON");
  program.add_option("--reference", reference, "the folder of reference data");
  bool only_pictures = false, only_form_factors = false, only_kernels = false;
  program.add_flag("--only-kernels", only_kernels, "rays, pairs and bands, no more");
  program.add_flag("--only-form-factors", only_form_factors, "all pairs next to View3D, no more");
  std::vector<int> samples{16, 64, 256, 1024};
  program.add_flag("--only-pictures", only_pictures, "radiosity against path tracing, no more");
  program.add_option("--samples", samples, "paths a pixel")->delimiter(',');
  bool only_links = false;
  std::string links_picture;
  program.add_flag("--only-links", only_links, "links against elements, no more");
  program.add_option("--links-svg", links_picture, "draw them into this file");
  CLI11_PARSE(program, argc, argv);

  const auto scene =
      truebox::read_scene(std::filesystem::path(reference) / "cornell_box" / "cornell_box.toml");
  const auto pictures = [&] {
    return measure_pictures(
        truebox::in_bands_at(scene, {400.0, 452.0, 500.0, 552.0, 600.0, 652.0, 700.0}), elements,
        samples);
  };
  if (only_links) {
    const auto rows = print_links(truebox::read_scene(std::filesystem::path(reference) /
                                                      "independent_renders" / "closed_box.toml"));
    if (!links_picture.empty()) std::ofstream(links_picture) << links_svg(rows) << '\n';
    return 0;
  }
  if (only_pictures) {
    print(pictures());
    return 0;
  }
  nlohmann::json json{{"threads", std::thread::hardware_concurrency()},
                      {"compiler", __VERSION__},
                      {"scene", "cornell_box"}};
  const auto kernels_of = [&](const truebox::Scene& measured) {
    const Kernels kernels = measure_kernels(measured, kernel_elements);
    print(kernels);
    json["kernels"] = as_json(kernels);
  };
  if (only_kernels) {
    kernels_of(scene);
    return 0;
  }
  if (only_form_factors) {
    compare_form_factors(reference, json);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    fmt::print("\nWhat the machine does on the same scene, one thread:");
    kernels_of(truebox::read_scene(std::filesystem::path(reference) / "independent_renders" /
                                   "closed_box.toml"));
    return 0;
  }
  fmt::print(
      "Irradiance against independent path tracing, relative, in %\n"
      "{:>9}{:>10}{:>9}{:>12}{:>12}{:>12}{:>12}{:>11}\n",
      "elements", "solve / s", "ratio", "rms error", "max error", "its floor", "mean bound",
      "covered");
  double first_s = 0.0;
  for (std::size_t count : only_closed_box ? std::vector<std::size_t>{} : elements) {
    const Accuracy accuracy = measure_accuracy(scene, reference, count);
    if (first_s == 0.0) first_s = accuracy.solve_s;
    print(accuracy, first_s);
    std::fflush(stdout);
    json["accuracy"].push_back(as_json(accuracy));
  }
  fmt::print(
      "\nClosed box, scene file to cell means in 31 bands, relative, in %\n"
      "{:>9}{:>9}{:>10}{:>10}{:>10}{:>12}{:>12}{:>12}{:>11}\n",
      "elements", "threads", "hidden by", "job / s", "CPU / s", "rms error", "its floor",
      "mean bound", "covered");
  for (int threads : only_closed_box ? std::vector<int>{1} : std::vector<int>{1, 2})
    for (const auto method : {FormFactorMethod::ray_casting, FormFactorMethod::exact_visibility})
      for (std::size_t count : closed_elements) {
        const ClosedBox box = measure_closed_box(reference, count, threads, method);
        print(box);
        std::fflush(stdout);
        json["closed_box"].push_back(as_json(box));
      }
  fmt::print(
      "\nThe same by links between groups, one thread\n{:>9}{:>12}{:>12}{:>10}{:>12}{:>12}\n",
      "elements", "tolerance", "links", "CPU / s", "rms error", "mean bound");
  for (double tolerance : link_tolerances)
    for (std::size_t count : closed_elements) {
      const ClosedBox box =
          measure_closed_box(reference, count, 1, FormFactorMethod::ray_casting, tolerance);
      fmt::print("{:>9}{:>12.3g}{:>12}{:>10.3f}{:>12.3f}{:>12.3f}\n", box.elements, tolerance,
                 box.links, box.job_cpu_s, 100.0 * box.rms_error, 100.0 * box.mean_bound);
      std::fflush(stdout);
      json["closed_box_hierarchical"].push_back(as_json(box));
    }
  if (only_closed_box) return 0;
  compare_form_factors(reference, json);
  kernels_of(scene);
  const auto solvers = measure_solvers(scene, kernel_elements, {1e-2, 1e-4, 1e-7, 1e-12});
  print(solvers);
  for (const SolverWork& work : solvers) json["solvers"].push_back(as_json(work));
  const PictureBenchmark rendered = pictures();
  print(rendered);
  json["pictures"] = as_json(rendered);
  if (!json_path.empty()) {
    std::ofstream(json_path) << json.dump(2) << '\n';
    fmt::print("\n{}\n", json_path);
  }
  return 0;
}
