// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "adaptive/adaptive_solution.h"
#include "hierarchy/hierarchical_exchange.h"
#include "image/image_file.h"
#include "irradiance_reference.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "radiometry/processor_time.h"
#include "scene/requirements.h"
#include "sweep.h"
#include "transport/prediction.h"

namespace truebox::app {
namespace {

using Eigen::Index;

constexpr std::uint64_t kPlaceSeed = 1, kReferenceSeed = 1000, kPathSeed = 7;
constexpr int kLeastReferencePaths = 1024, kMostReferencePaths = 1 << 20;  // a place
constexpr int kReferenceAhead = 16;  // paths of the reference : of the most that is swept
constexpr std::size_t kSmallestElements = 250, kGridsOfAPiece = 16;
constexpr double kSigmas = 2.0;  // of the reference, beside a bound

struct Answer {
  BandMatrix value, bound;  // places x bands
  std::string work;
  bool bound_is_promised = true;
};

struct Setting {
  std::string method, setting;
  std::function<Answer()> solve;
};

class IrradianceSweep : public SweepSubject {
 public:
  IrradianceSweep(const Scene& scene, const SweepArguments& a) : arguments_(a) {
    if (!a.reference.empty() && a.points.empty())
      throw InputError("--reference", 0, "--points, the places that it is for", "none");
    scene_ = a.reference.empty() ? scene : bands_of_reference(scene);
    if (!a.points.empty())
      places_ = read_points(a.points, scene.metres_per_unit);
    else
      places_ = random_places(scene_, a.places, kPlaceSeed,
                              a.camera.empty() ? nullptr : &find_camera(scene, a.camera));
    is_lambertian_ = !requirements(scene_).path_tracing;
    list_settings();
  }

  std::vector<std::string> jobs() const override {
    std::vector<std::string> names;
    for (const Setting& s : settings_) names.push_back(s.method + ", " + s.setting);
    return names;
  }

  Sweep prepare() override {
    find_reference();
    Sweep sweep;
    sweep.title = fmt::format("irradiance at {} places in {} bands of {}", places_.size(),
                              scene_.bands.size(), scene_.path);
    sweep.error_name = "rms relative error";
    sweep.reference = reference_.source;
    sweep.floor = reference_.relative_error();
    // The rms of n places is good to 1 / sqrt(2 n); bands of a place share their noise.
    sweep.resolved =
        sweep.floor * (1.0 + kSigmas / std::sqrt(2.0 * static_cast<double>(places_.size())));
    sweep.left_out = left_out_;
    return sweep;
  }

  std::vector<SweepPoint> run(std::size_t job) override {
    const double start = process_cpu_s();
    const Answer answer = settings_[job].solve();
    SweepPoint point = judged(answer);
    point.cpu_s = process_cpu_s() - start;
    point.method = settings_[job].method;
    point.setting = settings_[job].setting;
    return {point};
  }

 private:
  Scene bands_of_reference(const Scene& scene) const {
    try {
      return in_bands_at(scene, bands_of_irradiance(arguments_.reference));
    } catch (const std::invalid_argument& error) {
      throw InputError(arguments_.reference, 0, "bands that the scene has", error.what());
    }
  }

  void find_reference() {
    const auto progress = terminal_progress(arguments_.quiet);
    if (!arguments_.reference.empty())
      reference_ = read_irradiance(arguments_.reference, places_, scene_.bands);
    else
      // What is swept by paths, too, must not be held to as few of them.
      reference_ = trace_reference(
          scene_, places_, *share_of(arguments_.reference_error),
          is_lambertian_ ? kLeastReferencePaths : kReferenceAhead * arguments_.largest_paths,
          kMostReferencePaths, kReferenceSeed, progress);
    if (!arguments_.save_reference.empty())
      write_file_atomically(arguments_.save_reference, irradiance_csv(reference_, places_, scene_));
    if (!(reference_.value.array() > 0.0).any())
      throw InputError(scene_.path, 0, "a place that light reaches", "none of the places");
  }

  void list_settings() {
    if (!is_lambertian_)
      left_out_.push_back("all by radiosity: a surface is not Lambertian");
    else if (ladder().empty())
      left_out_.push_back(fmt::format(
          "a matrix and adapted meshes: three grids of these pieces take {} elements or more, and "
          "--largest-elements is {}",
          smallest_elements(), arguments_.largest_elements));
    if (is_lambertian_) {
      list_matrices();
      list_adapted();
      list_links();
      list_solver_bounds();
    }
    for (int paths = 16; paths <= arguments_.largest_paths; paths *= 4)
      settings_.push_back(
          {"paths", fmt::format("{} a place", paths), [this, paths] { return by_paths(paths); }});
  }

  std::size_t smallest_elements() const {
    std::size_t pieces = 0;
    for (const Surface& surface : scene_.surfaces) pieces += surface.pieces.size();
    return std::max(kSmallestElements, kGridsOfAPiece * pieces);
  }

  // Lines of contact may leave two requests with the same mesh: the coarsest there is.
  std::vector<std::size_t> ladder() const {
    std::vector<std::size_t> elements;
    std::size_t last = 0;
    for (std::size_t n = smallest_elements(); n <= arguments_.largest_elements; n *= 2) {
      if (n * n * sizeof(double) > FormFactorOptions{}.memory_limit_bytes) break;
      const std::size_t size = uniform_mesh(scene_, edge_for_count(scene_, n / 16), 2).size();
      if (size != last) elements.push_back(n);
      last = size;
    }
    return elements;
  }

  void add(const std::string& method, const std::string& setting, const PredictOptions& options) {
    settings_.push_back({method, setting, [this, options] {
                           return by_radiosity(std::make_unique<Prediction>(scene_, options));
                         }});
  }

  void list_matrices() {
    for (const FormFactorMethod method :
         {FormFactorMethod::ray_casting, FormFactorMethod::exact_visibility}) {
      if (method == FormFactorMethod::ray_casting && !requirements(scene_).occlusion) {
        left_out_.push_back("a matrix by rays: nothing can stand between two surfaces");
        continue;
      }
      for (const std::size_t n : ladder()) {
        PredictOptions options;
        options.elements = n;
        options.form_factors.method = method;
        add(method == FormFactorMethod::ray_casting ? "matrix, rays" : "matrix, shadow outlines",
            fmt::format("{} elements", n), options);
      }
    }
  }

  void list_adapted() {
    for (const std::size_t n : ladder()) {
      if (2 * n > arguments_.largest_elements && n != smallest_elements()) break;
      PredictOptions options;
      options.elements = n;
      options.form_factors.method = FormFactorMethod::exact_visibility;
      settings_.push_back({"adapted mesh", fmt::format("{} elements", n), [this, options] {
                             return by_radiosity(predict_adaptively(scene_, options, Goal{}));
                           }});
    }
  }

  void list_links() {
    const std::size_t n = std::max(smallest_elements(), arguments_.largest_elements);
    for (const double tolerance : {0.1, 0.03, 0.01}) {
      PredictOptions options;
      options.elements = n;
      options.find_exchange = hierarchical_exchange({.relative_tolerance = tolerance});
      add("links", fmt::format("{} elements, {:g} %", n, 100.0 * tolerance), options);
    }
  }

  void list_solver_bounds() {
    const auto elements = ladder();
    if (elements.empty()) return;
    for (const double bound : {0.3, 0.03, 0.003}) {
      PredictOptions options;
      options.elements = elements[elements.size() / 2];
      options.solve.relative_bound = bound;
      add("matrix, solver bound", fmt::format("{} elements, {:g}", options.elements, bound),
          options);
    }
  }

  Answer by_radiosity(const std::unique_ptr<Prediction>& prediction) const {
    Answer answer;
    answer.value.resize(reference_.value.rows(), reference_.value.cols());
    answer.bound.resize(reference_.value.rows(), reference_.value.cols());
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, places_.size(), 1), [&](const auto& range) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const auto at = prediction->irradiance_at(places_[i].position_m, places_[i].normal);
            answer.value.row(static_cast<Index>(i)) = at.value.transpose();
            answer.bound.row(static_cast<Index>(i)) = at.error_bound.transpose();
          }
        });
    const GridSolution& grid = prediction->fine();
    answer.bound_is_promised = prediction->bound_is_reliable();
    answer.work = fmt::format("{} elements, {}", grid.mesh.size(),
                              grid.links ? fmt::format("{} links", grid.links->links)
                              : grid.form_factors.rays > 0
                                  ? fmt::format("{} rays", grid.form_factors.rays)
                                  : fmt::format("{:.3g} passes", grid.solve.matrix_passes));
    return answer;
  }

  Answer by_paths(int paths) const {
    const IrradianceTable traced = trace_irradiance(scene_, places_, paths, kPathSeed);
    return {traced.value, kSigmas * traced.standard_error,
            fmt::format("{} paths", places_.size() * static_cast<std::size_t>(paths)),
            false};  // two standard errors: right for most, not for all
  }

  SweepPoint judged(const Answer& answer) const {
    SweepPoint point;
    point.work = answer.work;
    point.bound_is_promised = answer.bound_is_promised;
    double squares = 0.0, held = 0.0, lit = 0.0;
    const double dark = 1e-9 * reference_.value.maxCoeff();
    for (Index i = 0; i < answer.value.rows(); ++i)
      for (Index k = 0; k < answer.value.cols(); ++k) {
        const double truth = reference_.value(i, k), u = reference_.standard_error(i, k);
        if (truth <= dark || !std::isfinite(u)) continue;
        const double error = std::abs(answer.value(i, k) - truth);
        lit += 1.0;
        squares += error * error / (truth * truth);
        point.largest_error = std::max(point.largest_error, error / truth);
        point.bound += answer.bound(i, k) / truth;
        held += error <= answer.bound(i, k) + kSigmas * u;
      }
    point.error = std::max(1e-16, std::sqrt(squares / lit));
    point.bound /= lit;
    point.bound_held = held / lit;
    return point;
  }

  const SweepArguments& arguments_;
  Scene scene_;
  std::vector<ProbePoint> places_;
  bool is_lambertian_ = true;
  std::vector<Setting> settings_;
  std::vector<std::string> left_out_;
  IrradianceTable reference_;
};

}  // namespace

std::unique_ptr<SweepSubject> sweep_irradiance(const Scene& scene, const SweepArguments& a) {
  return std::make_unique<IrradianceSweep>(scene, a);
}

}  // namespace truebox::app
