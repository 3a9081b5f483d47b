// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/chessboard_corners.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace truebox {
namespace {

/// The mean of all channels, stretched to 8 bit.
cv::Mat grey_copy(const Image& image) {
  std::vector<float> mean(image.pixel_count(), 0.0f);
  for (const Channel& channel : image.channels)
    for (std::size_t i = 0; i < mean.size(); ++i)
      if (std::isfinite(channel.samples[i])) mean[i] += channel.samples[i];
  std::vector<float> sorted = mean;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(0.999 * double(sorted.size() - 1));
  std::nth_element(sorted.begin(), at, sorted.end());
  const double scale = *at > 0.0f ? 255.0 / *at : 1.0;
  cv::Mat grey(image.height, image.width, CV_8UC1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      grey.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(scale * mean[image.index(x, y)]);
  return grey;
}

}  // namespace

std::optional<std::vector<PixelPosition>> chessboard_corners(const Image& photograph, int columns,
                                                             int rows) {
  if (photograph.pixel_count() == 0 || photograph.channels.empty()) return std::nullopt;
  const cv::Mat grey = grey_copy(photograph);
  const cv::Size board(columns, rows);
  std::vector<cv::Point2f> found;
  try {
    if (!cv::findChessboardCorners(grey, board, found)) return std::nullopt;
    double nearest = 1e9;
    for (std::size_t i = 0; i < found.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        nearest =
            std::min(nearest, double(std::hypot(found[i].x - found[k].x, found[i].y - found[k].y)));
    const int half = std::clamp(static_cast<int>(0.5 * nearest), 2, 11);
    cv::cornerSubPix(grey, found, {half, half}, {-1, -1},
                     {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 50, 1e-4});
  } catch (const cv::Exception&) {  // pictures smaller than its windows
    return std::nullopt;
  }
  std::vector<PixelPosition> corners;
  for (const cv::Point2f& p : found) corners.push_back({p.x + 0.5, p.y + 0.5});
  return corners;
}

}  // namespace truebox
