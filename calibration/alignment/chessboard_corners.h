// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "image/image.h"

namespace truebox {

/// Inner corners of a chessboard, row by row, `columns` in a row; px, (0.5, 0.5) being the centre
/// of the top left pixel. Found on an 8-bit grey copy and then placed between pixels where the
/// gradients around point at it (OpenCV: findChessboardCorners, cornerSubPix; Foerstner, Guelch
/// 1987). The window of the second is half the smallest distance of two corners, at most 11 px.
/// Nothing where the picture shows no such board.
std::optional<std::vector<PixelPosition>> chessboard_corners(const Image& photograph, int columns,
                                                             int rows);

}  // namespace truebox
