// SPDX-License-Identifier: BSD-3-Clause
#include "architecture/include_rules.h"

#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>

namespace truebox {
namespace {

using Modules = std::set<std::string>;

// Modules that each module may include, itself aside. Left to right; solver and reference never
// meet, only calibration and reports see both.
const std::map<std::string, Modules>& allowed_modules() {
  static const Modules kSolver = {
      "radiometry",  "image",  "scene",         "rays",     "mesh",     "transport", "hierarchy",
      "path_tracer", "sensor", "discontinuity", "adaptive", "planning", "export"};
  static const Modules kReference = {"provenance", "analytic", "readings"};
  static const auto join = [](Modules a, const Modules& b) {
    a.insert(b.begin(), b.end());
    return a;
  };
  static const Modules kLeft = join(kSolver, kReference);
  static const Modules kCalibration = {"photometry",  "chart_finder", "alignment",
                                       "uncertainty", "fit",          "verification"};
  static const Modules kBoth = join(kLeft, kCalibration);
  static const std::map<std::string, Modules> kAllowed = {
      {"solver/radiometry", {}},
      {"solver/image", {"radiometry"}},
      {"solver/scene", {"radiometry", "image"}},
      {"solver/rays", {"radiometry", "image", "scene"}},
      // The independent check: neither mesh nor transport, so that no error is common to both.
      {"solver/path_tracer", {"radiometry", "image", "scene", "rays"}},
      {"solver/mesh", {"radiometry", "image", "scene"}},
      {"solver/transport", {"radiometry", "image", "scene", "rays", "mesh"}},
      {"solver/distributed", {"radiometry", "image", "scene", "rays", "mesh", "transport"}},
      {"solver/hierarchy", {"radiometry", "image", "scene", "rays", "mesh", "transport"}},
      {"solver/sensor", {"radiometry", "image", "scene", "mesh", "transport"}},
      {"solver/discontinuity", {"radiometry", "image", "scene", "rays", "mesh", "transport"}},
      {"solver/adaptive",
       {"radiometry", "image", "scene", "mesh", "transport", "sensor", "discontinuity"}},
      {"solver/planning",
       {"radiometry", "image", "scene", "rays", "mesh", "path_tracer", "transport", "hierarchy",
        "sensor", "discontinuity", "adaptive"}},
      {"solver/export", {"radiometry", "image", "scene", "mesh", "transport"}},
      {"reference/provenance", {"radiometry", "image"}},
      {"reference/analytic", {"radiometry", "image", "provenance"}},
      {"reference/readings", {"radiometry", "image", "provenance", "analytic"}},
      {"calibration/photometry", join(kLeft, {"uncertainty"})},
      {"calibration/chart_finder", kLeft},
      {"calibration/uncertainty", kLeft},
      {"calibration/alignment", join(kLeft, {"photometry", "uncertainty"})},
      {"calibration/fit", join(kLeft, {"photometry", "uncertainty", "alignment"})},
      {"calibration/verification", join(kLeft, {"photometry", "uncertainty", "alignment"})},
      {"reports/difference", kBoth},
      {"reports/colour", join(kBoth, {"difference"})},
      {"reports/figures", join(kBoth, {"difference", "colour"})},
      {"reports/document", join(kBoth, {"difference", "colour", "figures"})},
      {"reports/walkthrough", join(kBoth, {"difference", "colour", "figures", "document"})}};
  return kAllowed;
}

struct ThirdParty {
  std::string start;               // of the included path
  std::vector<std::string> homes;  // modules that may include it
  bool in_headers = false;
};

const std::vector<ThirdParty>& third_parties() {
  static const std::vector<ThirdParty> kTable = {
      {"embree3/", {"solver/rays"}},
      {"geos_c.h", {"solver/discontinuity"}},
      {"petsc", {"solver/distributed"}},
      {"mpi.h", {"solver/distributed"}, true},  // in a header that no other folder includes
      {"Imf", {"solver/image"}},
      {"OpenEXR/", {"solver/image"}},
      {"Imath", {"solver/image"}},
      {"half.h", {"solver/image"}},  // Imath's
      {"Iex", {"solver/image"}},
      {"half.h", {"solver/image"}},  // Imath's
      {"png.h", {"solver/image"}},
      {"jpeglib.h", {"solver/image"}},
      {"tiff", {"solver/image"}},
      {"libraw/", {"solver/image"}},
      {"toml++/", {"solver/scene", "reference/readings"}},
      {"ceres/", {"calibration/fit", "calibration/alignment"}},
      {"OpenColorIO/", {"reports/colour"}},
      {"mustache", {"reports/document"}},
      {"kainjow/", {"reports/document"}},
      {"nlohmann/", {"reports/document", "reports/walkthrough", "solver/export"}},
      {"zlib.h", {"reports/document"}},
      {"fmt/", {"reports/", "solver/export"}},
      {"tbb/", {"solver/"}},
      {"unsupported/Eigen/", {"solver/transport"}},
      {"Eigen/", {"solver/", "calibration/"}, true},
      {"CLI/", {}},
      {"opencv2/photo", {"calibration/photometry"}},  // response curves; a package of its own
      {"opencv2/mcc", {"calibration/chart_finder"}},  // finds colour charts
      // OpenCV's libraries, each a package: calibration may not borrow the reports' filters, but a
      // chessboard's corners are found by one library and made sub-pixel by the other.
      {"opencv2/imgproc", {"reports/difference", "calibration/alignment"}},
      {"opencv2/calib3d", {"calibration/alignment"}},
      {"boost/math/", {"calibration/uncertainty"}},
      {"gtest/", {}},
      {"gmock/", {}}};
  return kTable;
}

std::string module_of(const std::string& path) {
  const std::size_t first = path.find('/'), second = path.find('/', first + 1);
  return second == std::string::npos ? path.substr(0, first) : path.substr(0, second);
}

std::string layer_of(const std::string& module) {
  for (const auto& [name, allowed] : allowed_modules())
    if (name.substr(name.find('/') + 1) == module) return name;
  return {};
}

}  // namespace

std::vector<std::string> include_violations(const std::string& path, const std::string& text) {
  static const std::regex kInclude(R"(^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"])",
                                   std::regex::multiline);
  std::vector<std::string> violations;
  const auto complain = [&](const std::string& header, const std::string& why) {
    violations.push_back(path + " includes " + header + ": " + why);
  };
  const std::string module = module_of(path), name = module.substr(module.find('/') + 1);
  const bool is_header = path.ends_with(".h");
  const auto known = allowed_modules().find(module);
  if (known == allowed_modules().end()) return {path + ": a module without a place in the order"};
  for (std::sregex_iterator at(text.begin(), text.end(), kInclude), end; at != end; ++at) {
    const std::string header = (*at)[2];
    if ((*at)[1] == "\"") {
      const std::string target = header.substr(0, header.find('/'));
      if (header.find('/') == std::string::npos || header.find("..") != std::string::npos)
        complain(header, "write the module, \"" + name + "/...\"");
      else if (layer_of(target).empty())
        complain(header, "no module of the library");
      else if (target != name && !known->second.contains(target))
        complain(header, "against the order of the layers");
      continue;
    }
    bool is_known = header.find('/') == std::string::npos && !header.ends_with(".h");  // std
    for (const ThirdParty& party : third_parties()) {
      if (!header.starts_with(party.start)) continue;
      is_known = true;
      bool at_home = false;
      for (const std::string& home : party.homes)
        at_home |= home.ends_with("/") ? path.starts_with(home) : module == home;
      if (!at_home)
        complain(header, "outside the folder of this library");
      else if (is_header && !party.in_headers)
        complain(header, "a library in a header");
      break;
    }
    if (!is_known && header != "unistd.h" && header != "fnmatch.h")  // POSIX
      complain(header, "a library that no folder is named for");
  }
  return violations;
}

std::vector<std::string> include_violations_of_tree(const std::filesystem::path& checkout,
                                                    std::size_t& files_read) {
  std::vector<std::string> all;
  files_read = 0;
  for (const char* river : {"solver", "reference", "calibration", "reports"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(checkout / river)) {
      const auto extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      std::ifstream file(entry.path());
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      const auto found =
          include_violations(entry.path().lexically_relative(checkout).generic_string(), text);
      all.insert(all.end(), found.begin(), found.end());
      ++files_read;
    }
  return all;
}

}  // namespace truebox
