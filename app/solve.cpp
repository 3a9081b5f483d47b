// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"

namespace truebox::app {
namespace {

struct SolveArguments {
  PredictionArguments prediction;
  std::string output, summary;
};

std::vector<double> values(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

nlohmann::json summary_json(const Predicted& p) {
  const GridSolution& grid = p.prediction->fine();
  const FormFactorSummary& f = grid.form_factors;
  return {{"scene", p.scene.path},
          {"elements", grid.mesh.size()},
          {"elements_coarse", p.prediction->coarse().mesh.size()},
          {"bands", p.scene.bands.size()},
          {"bands_solved", p.prediction->needs().distinct_bands.size()},
          {"seconds", p.seconds},
          {"plan", p.prediction->needs().reasons},
          {"form_factors",
           {{"pairs_unoccluded", f.pairs_unoccluded},
            {"pairs_hidden", f.pairs_hidden},
            {"pairs_sampled", f.pairs_sampled},
            {"rays", f.rays},
            {"closed", f.closed},
            {"closure_error_max", f.closure_error_max},
            {"closure_error_mean", f.closure_error_mean},
            {"repair_max", f.repair_max},
            {"closure_residual_max", f.closure_residual_max}}},
          {"solver",
           {{"outcome", grid.solve.brief()},
            {"iterations", grid.solve.iterations},
            {"matrix_passes", grid.solve.matrix_passes},
            {"residual_history", grid.solve.residual_history}}}};
}

nlohmann::json solution_json(const Predicted& p) {
  nlohmann::json json = summary_json(p);
  json["units"] = {
      {"radiosity", Radiosity::unit()}, {"irradiance", Irradiance::unit()}, {"area", "m^2"}};
  json["band_centres_nm"] = p.scene.bands.centres_nm();
  json["surfaces"] = nlohmann::json::array();
  for (const SurfaceMean& mean : surface_means(*p.prediction))
    json["surfaces"].push_back({{"name", mean.surface},
                                {"area", mean.area_m2},
                                {"radiosity", values(mean.radiosity)},
                                {"radiosity_error_bound", values(mean.radiosity_bound)},
                                {"irradiance", values(mean.irradiance)}});
  return json;
}

template <class Write>
std::string data_array(const char* type, const char* name, int components, const Write& write) {
  std::string text = fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">\n", type,
      name, components);
  write(text);
  return text + "</DataArray>\n";
}

// VTK XML unstructured grid, one polygon an element, cell data one component a band (ParaView).
std::string solution_vtu(const Predicted& p) {
  const PatchMesh& mesh = p.prediction->fine().mesh;
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" "
      "NumberOfCells=\"{}\">\n<Points>\n",
      mesh.vertices.size(), mesh.size());
  text += data_array("Float64", "Points", 3, [&](std::string& out) {
    for (const Vec3& v : mesh.vertices) out += fmt::format("{} {} {}\n", v.x(), v.y(), v.z());
  });
  text += "</Points>\n<Cells>\n";
  text += data_array("Int32", "connectivity", 1, [&](std::string& out) {
    for (std::uint32_t c : mesh.corners) out += fmt::format("{} ", c);
  });
  text += data_array("Int32", "offsets", 1, [&](std::string& out) {
    for (const Patch& patch : mesh.patches)
      out += fmt::format("{} ", patch.first_corner + patch.corner_count);
  });
  text += data_array("UInt8", "types", 1, [&](std::string& out) {
    for (std::size_t i = 0; i < mesh.size(); ++i) out += "7 ";  // VTK_POLYGON
  });
  text += "</Cells>\n<CellData>\n";
  const auto matrix = [&](const char* name, const BandMatrix& m) {
    text += data_array("Float32", name, static_cast<int>(m.cols()), [&](std::string& out) {
      for (Eigen::Index i = 0; i < m.rows(); ++i) {
        for (Eigen::Index b = 0; b < m.cols(); ++b) out += fmt::format("{:.7g} ", m(i, b));
        out += '\n';
      }
    });
  };
  matrix("radiosity_W_m-2_nm-1", p.prediction->radiosity());
  matrix("radiosity_error_bound_W_m-2_nm-1", p.prediction->radiosity_bound());
  text += data_array("Int32", "surface", 1, [&](std::string& out) {
    for (const Patch& patch : mesh.patches) out += fmt::format("{} ", mesh.surface_of(patch));
  });
  return text + "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

void print_surfaces(const Predicted& p) {
  const std::size_t bands = p.scene.bands.size();
  const std::vector<std::size_t> shown =
      bands < 3 ? std::vector<std::size_t>{0}
                : std::vector<std::size_t>{bands / 4, bands / 2, 3 * bands / 4};
  fmt::print("{:<20}", "mean radiosity of");
  for (std::size_t b : shown) fmt::print("{:>14.0f} nm{:>10}", p.scene.bands.centre_nm(b), "bound");
  fmt::print("   ({})\n", Radiosity::unit());
  for (const SurfaceMean& mean : surface_means(*p.prediction)) {
    fmt::print("{:<20}", mean.surface);
    for (std::size_t b : shown) {
      const auto k = static_cast<Eigen::Index>(b);
      const double share =
          mean.radiosity[k] > 0 ? mean.radiosity_bound[k] / mean.radiosity[k] : 0.0;
      fmt::print("{:>17.6g}{:>8.2f} %", mean.radiosity[k], 100.0 * share);
    }
    fmt::print("\n");
  }
}

int solve(const SolveArguments& a) {
  const auto extension = std::filesystem::path(a.output).extension();
  if (!a.output.empty() && extension != ".json" && extension != ".vtu")
    throw InputError(a.output, 0, "an output ending in .json or .vtu", extension.string());
  const auto predicted = predict(a.prediction);
  fmt::print("{}", describe(*predicted));
  if (predicted->prediction->outcome() != SolveOutcome::converged) {
    fmt::print(stderr, "truebox: the solver did not reach its bound: {}\n",
               predicted->prediction->fine().solve.brief());
    return kNotSolved;
  }
  print_surfaces(*predicted);
  if (extension == ".json")
    write_file_atomically(a.output, solution_json(*predicted).dump(1) + "\n");
  if (extension == ".vtu") write_file_atomically(a.output, solution_vtu(*predicted));
  if (!a.summary.empty()) write_file_atomically(a.summary, summary_json(*predicted).dump(1) + "\n");
  return predicted->misses_target ? kNotSolved : kAgrees;
}

}  // namespace

void add_solve_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand("solve", "radiosity in every band, with an error bound");
  auto arguments = std::make_shared<SolveArguments>();
  add_prediction_options(*command, arguments->prediction);
  command->add_option("-o,--output", arguments->output,
                      "means of the surfaces (.json) or all elements (.vtu, ParaView)");
  command->add_option("--summary", arguments->summary, "how the solve went, as JSON");
  command->footer("Example: truebox solve reference/cornell_box/cornell_box.toml -o box.vtu");
  command->callback([=, &chosen] { chosen = [=] { return solve(*arguments); }; });
}

}  // namespace truebox::app
