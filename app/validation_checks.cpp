// SPDX-License-Identifier: BSD-3-Clause
#include "validation_checks.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "verification/basis_checks.h"
#include "verification/render_checks.h"

namespace truebox::app {

std::vector<AccuracyCheck> run_validation(const std::filesystem::path& dir, const std::string& only,
                                          std::size_t elements, const Progress& progress,
                                          Image* p_values) {
  using Group = std::pair<const char*, std::function<std::vector<AccuracyCheck>()>>;
  const Group groups[] = {
      {"viewfactors", [&] { return check_view_factors(dir); }},
      {"furnace", [&] { return check_furnace(dir); }},
      {"plates", [&] { return check_infinite_plates(dir); }},
      {"bases", [&] { return check_bases(dir); }},
      {"cube", [&] { return check_ceiling_lit_cube(dir); }},
      {"cie171", [&] { return check_cie171(dir); }},
      {"cornellbox", [&] { return check_cornell_box_probes(dir, elements); }},
      {kRender,
       [&] {
         RenderCheckOptions options;
         options.elements = elements;
         options.progress = progress;
         return check_renders(dir, options, p_values);
       }},
  };
  std::vector<AccuracyCheck> all;
  double done = 0.0;
  for (const auto& [name, check] : groups) {
    const std::string_view group = name;
    const bool is_closed_form = group != "cornellbox" && group != kRender;
    if (group == kRender && only != kRender) continue;
    if (only == kClosedForms ? !is_closed_form : !only.empty() && only != name) continue;
    if (progress) progress(std::string("validate ") + name, done / std::size(groups));
    auto checks = check();
    all.insert(all.end(), checks.begin(), checks.end());
    done += 1.0;
  }
  return all;
}

std::vector<Check> report_checks(const std::vector<AccuracyCheck>& checks) {
  std::vector<Check> list;
  for (const AccuracyCheck& c : checks)
    list.push_back(
        {c.group + ": " + c.name, c.passed() ? Agreement::agrees : Agreement::fails,
         std::abs(c.computed - c.certified), c.allowed, c.unit,
         fmt::format("computed {:.12g}, certified {:.12g}, {:.1f} digits; allowed: {}", c.computed,
                     c.certified, matching_digits(c.computed, c.certified), c.reason)});
  return list;
}

}  // namespace truebox::app
