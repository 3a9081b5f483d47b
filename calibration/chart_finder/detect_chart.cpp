// SPDX-License-Identifier: BSD-3-Clause
#include "chart_finder/detect_chart.h"

#include <algorithm>
#include <cmath>
#include <opencv2/mcc.hpp>

namespace truebox::detail {
namespace {

/// The mean of the finite samples of one cell; 0 if there is none.
float cell_mean(const ChartPicture& picture, const ChartPlane& plane, int x, int y, int step) {
  double sum = 0.0, n = 0.0;
  for (int dy = 0; dy < step; ++dy)
    for (int dx = 0; dx < step; ++dx) {
      const std::size_t i =
          static_cast<std::size_t>(y * step + dy) * static_cast<std::size_t>(picture.width) +
          static_cast<std::size_t>(x * step + dx);
      if (!std::isfinite(plane.value[i])) continue;
      sum += plane.value[i];
      n += 1.0;
    }
  return n > 0.0 ? static_cast<float>(sum / n) : 0.0f;
}

}  // namespace

ChartCopy display_copy(const ChartPicture& picture) {
  ChartCopy copy;
  copy.step = picture.mosaic ? 2 : 1;
  copy.width = picture.width / copy.step;
  copy.height = picture.height / copy.step;
  const std::size_t n =
      static_cast<std::size_t>(copy.width) * static_cast<std::size_t>(copy.height);
  copy.rgb.resize(3 * n);
  for (std::size_t c = 0; c < 3; ++c) {
    const ChartPlane& plane = picture.planes[std::min(c, picture.planes.size() - 1)];
    std::vector<float> cells(n);
    for (std::size_t i = 0; i < n; ++i)
      cells[i] = cell_mean(picture, plane, static_cast<int>(i) % copy.width,
                           static_cast<int>(i) / copy.width, copy.step);
    std::vector<float> ordered = cells;
    double top = 0.0;
    if (n > 0) {
      const auto at = ordered.begin() + static_cast<long>(0.99 * static_cast<double>(n - 1));
      std::nth_element(ordered.begin(), at, ordered.end());
      top = double{*at};
    }
    for (std::size_t i = 0; i < n; ++i) {
      const double v = top > 0.0 ? std::clamp(cells[i] / top, 0.0, 1.0) : 0.0;
      copy.rgb[3 * i + c] = static_cast<std::uint8_t>(std::lround(255.0 * std::pow(v, 1.0 / 2.2)));
    }
  }
  return copy;
}

std::optional<DetectedChart> detect_chart(const ChartCopy& copy) {
  constexpr int kSmallest_px = 24;  // four rows of patches of some pixels
  if (copy.width < kSmallest_px || copy.height < kSmallest_px) return std::nullopt;
  cv::Mat bgr(copy.height, copy.width, CV_8UC3);
  for (int y = 0; y < copy.height; ++y)
    for (int x = 0; x < copy.width; ++x) {
      const std::uint8_t* rgb =
          &copy.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(copy.width) +
                         static_cast<std::size_t>(x))];
      bgr.at<cv::Vec3b>(y, x) = {rgb[2], rgb[1], rgb[0]};
    }
  try {
    const auto detector = cv::mcc::CCheckerDetector::create();
    if (!detector->process(bgr, cv::mcc::MCC24, 1)) return std::nullopt;
    const auto best = detector->getBestColorChecker();
    if (!best) return std::nullopt;
    const std::vector<cv::Point2f> box = best->getBox();
    if (box.size() != 4) return std::nullopt;
    DetectedChart chart;
    chart.colour_distance = double{best->getCost()};
    for (std::size_t k = 0; k < 4; ++k)  // OpenCV: (0, 0) is the first pixel's centre
      chart.corners[k] = {double{box[k].x} + 0.5, double{box[k].y} + 0.5};
    return chart;
  } catch (const cv::Exception&) {  // pictures in which its contour search finds nothing
    return std::nullopt;
  }
}

}  // namespace truebox::detail
