// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "export/solution_files.h"

namespace truebox {
namespace {

template <class Write>
std::string data_array(const char* type, const std::string& name, int components,
                       const Write& write) {
  std::string text = fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">\n", type,
      name, components);
  write(text);
  return text + "</DataArray>\n";
}

}  // namespace

std::string solution_vtu(const Prediction& prediction) {
  const PatchMesh& mesh = prediction.fine().mesh;
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
  const std::string unit = prediction.scene().is_total ? "W_m-2" : "W_m-2_nm-1";
  const auto matrix = [&](const std::string& name, const BandMatrix& m) {
    text += data_array("Float32", name, static_cast<int>(m.cols()), [&](std::string& out) {
      for (Eigen::Index i = 0; i < m.rows(); ++i) {
        for (Eigen::Index b = 0; b < m.cols(); ++b) out += fmt::format("{:.7g} ", m(i, b));
        out += '\n';
      }
    });
  };
  matrix("radiosity_" + unit, prediction.radiosity());
  matrix("radiosity_error_bound_" + unit, prediction.radiosity_bound());
  text += data_array("Int32", "surface", 1, [&](std::string& out) {
    for (const Patch& patch : mesh.patches) out += fmt::format("{} ", mesh.surface_of(patch));
  });
  return text + "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

}  // namespace truebox
