// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace truebox {

class Prediction;

/// A number of the program against the number it should be. `allowed` is what the two may differ
/// by, in the quantity's unit, and `reason` says where that comes from.
struct AccuracyCheck {
  std::string group;  ///< "viewfactors", "furnace", ...
  std::string name;
  double computed = 0.0;
  double certified = 0.0;
  double allowed = 0.0;
  std::string unit;
  std::string reason;

  bool passed() const;
};

/// -log10 of the relative difference (absolute where the certified value is 0), in [0, 16].
/// Source: McCullough (1998), log relative error.
double matching_digits(double computed, double certified);

/// Told each finished group.
using CheckProgress = std::function<void(const std::string& group)>;

// One function a group of checks; `reference_dir` holds the certified values.
// InputError if a file is missing or malformed.

/// View factors of unoccluded polygon pairs, ordinary and extreme: view_factors.csv.
std::vector<AccuracyCheck> check_view_factors(const std::filesystem::path& reference_dir);

/// Closed furnace B = E / (1 - rho) by both solvers and with occlusion; infinite plates.
std::vector<AccuracyCheck> check_furnace(const std::filesystem::path& reference_dir);
std::vector<AccuracyCheck> check_infinite_plates(const std::filesystem::path& reference_dir);

/// Cube lit by its ceiling against the exact discrete solution on the same elements.
std::vector<AccuracyCheck> check_ceiling_lit_cube(const std::filesystem::path& reference_dir);

/// CIE 171:2006 cases 5.2, 5.3, 5.6 and 5.8.
std::vector<AccuracyCheck> check_cie171(const std::filesystem::path& reference_dir);

/// The published Cornell Box at 34 points in 7 bands against independent path tracing: allowed is
/// the program's own bound plus three of their standard errors.
std::vector<AccuracyCheck> check_cornell_box_probes(const std::filesystem::path& reference_dir,
                                                    std::size_t elements);
/// The same with a prediction of that scene at hand.
std::vector<AccuracyCheck> check_cornell_box_probes(const std::filesystem::path& reference_dir,
                                                    const Prediction& prediction);

}  // namespace truebox
