// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace truebox::app {

struct ChessboardArguments {
  std::string corners;  ///< "9x6", inner corners
  std::string square;   ///< "25mm"
  std::vector<std::string> photographs;
  std::string directory;
};

/// Intrinsics and distortion from photographs of a chessboard; returns an ExitCode.
int calibrate_from_chessboard(const ChessboardArguments& arguments);

}  // namespace truebox::app
