// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adaptive/adaptive_solution.h"
#include "hierarchy/hierarchical_exchange.h"
#include "scene/scene.h"
#include "transport/predict_to_target.h"

namespace CLI {
class App;
}

namespace truebox::app {

/// What `--adaptive` alone means: everywhere, and of `render` what its camera sees.
inline constexpr const char* kDefaultGoal = "default";

/// What every command that predicts can be told.
struct PredictionArguments {
  std::string scene;
  std::size_t elements = PredictOptions{}.elements;
  int rays = FormFactorOptions{}.rays;
  std::string method = "krylov";
  /// "exact-visibility" or "ray-casting" for a matrix, "streamed" for none, or "hierarchical":
  /// links between groups
  std::string form_factors = "exact-visibility";
  double link_tolerance = HierarchyOptions{}.relative_tolerance;
  std::size_t memory_MiB = 8192;
  double relative_bound = SolveOptions{}.relative_bound;
  std::string target_error;        ///< "0.5%" or "0.005": chooses elements and solver bound
  Judge judge;                     ///< of what has that error; empty: means of surfaces
  std::string adaptive;            ///< empty: uniform; else the goal, or kDefaultGoal
  bool gather_edges = false;       ///< the gathered field, see PredictOptions::gathered_up_to
  bool interpolated = false;       ///< the answer is interpolated between corners: for --auto
  bool means_only = false;         ///< the answer is means of surfaces alone: for --auto
  std::string basis = "constant";  ///< of an element: see solve_basis.h
  /// "smooth", "constant", "averaged" or "least-squares"; empty where nothing was said: smooth
  std::string reconstruction;
  std::string repair = "scaling";  ///< or "least-squares" or "none"
  bool discontinuities = false;    ///< elements follow lines of light and shadow
  std::size_t bands = 0;           ///< lamp-weighted ones instead of the scene's; 0: the scene's
  std::string automatic;   ///< empty: as said here; else as planned, for a goal or kDefaultGoal
  std::string as_planned;  ///< command line of the plan that these are the arguments of
  bool error_shares = false, sensitivities = false;  ///< as in PredictOptions
  SolveGrid solve_grid;                              ///< as in PredictOptions, and:
  decltype(PredictOptions::watch_finest) watch_finest;
  int threads = 0;
  bool quiet = false;
};

/// `more_methods` are those that the command itself knows beside the solvers.
void add_prediction_options(CLI::App& command, PredictionArguments& arguments,
                            const std::vector<std::string>& more_methods = {});

/// A scene, its prediction and how long the solve took.
struct Predicted {
  Scene scene;
  std::unique_ptr<Prediction> prediction;
  TargetedPrediction
      target;  ///< without its prediction; the attempts, where an error was asked for
  bool misses_target = false;
  std::string plan;                    ///< what --auto decided, as a command line; empty without it
  std::vector<AdaptStep> adapt_steps;  ///< of the last mesh, where it was adapted
  std::optional<FollowedLines> lines;  ///< of light and shadow, where elements follow them
  double seconds = 0.0;
};

/// The scene of the arguments, in the bands they ask for.
Scene read_scene_of(const PredictionArguments& arguments);

/// "0.5%" or "0.005" as a share between 0 and 1; nothing for anything else. And a check for CLI11.
std::optional<double> share_of(const std::string& text);
std::string check_share(const std::string& text);

/// Reads and solves; shows progress. The caller checks `prediction->outcome()` and `misses_target`.
std::unique_ptr<Predicted> predict(const PredictionArguments& arguments);

/// The camera of that name, or the only one. InputError if there is none.
const CameraDescription& find_camera(const Scene& scene, const std::string& name);

/// A progress line on stderr if that is a terminal, nothing otherwise.
Progress terminal_progress(bool quiet = false);

/// The attempts at a target error, a line each, and what is possible where it was not reached.
std::string describe_target(const Predicted& predicted);

/// "552 nm", or "all wavelengths".
std::string name_of_band(const Scene& scene, std::size_t band);

/// What the solve did, as text for a person: elements, form factors, closure, solver, time.
std::string describe(const Predicted& predicted);

/// Means over a surface, elements that lie under another one left out; W m^-2 nm^-1 in each band.
struct SurfaceMean {
  std::string surface;
  double area_m2 = 0.0;
  Eigen::VectorXd radiosity, radiosity_bound, irradiance, irradiance_bound;
};
std::vector<SurfaceMean> surface_means(const Prediction& prediction);

}  // namespace truebox::app
