// SPDX-License-Identifier: BSD-3-Clause
#include "difference/structural_similarity.h"

#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace truebox {
namespace {

cv::Mat windowed(const cv::Mat& plane) {
  cv::Mat mean;
  cv::GaussianBlur(plane, mean, cv::Size(11, 11), 1.5);
  return mean;
}

cv::Mat doubles(int width, int height, const std::vector<float>& plane) {
  cv::Mat floats(height, width, CV_32F, const_cast<float*>(plane.data())), result;
  floats.convertTo(result, CV_64F);  // variances are small differences of squares
  return result;
}

}  // namespace

std::vector<float> structural_similarity(int width, int height, const RgbPlanes& test,
                                         const RgbPlanes& reference) {
  constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  cv::Mat sum(height, width, CV_64F, cv::Scalar(0.0));
  for (std::size_t c = 0; c < 3; ++c) {
    if (test[c].size() != pixels || reference[c].size() != pixels || pixels == 0)
      throw std::invalid_argument("a plane has other than width x height samples");
    const cv::Mat t = doubles(width, height, test[c]), r = doubles(width, height, reference[c]);
    const cv::Mat mean_t = windowed(t), mean_r = windowed(r);
    const cv::Mat variance_t = windowed(t.mul(t)) - mean_t.mul(mean_t);
    const cv::Mat variance_r = windowed(r.mul(r)) - mean_r.mul(mean_r);
    const cv::Mat covariance = windowed(t.mul(r)) - mean_t.mul(mean_r);
    const cv::Mat above = (2.0 * mean_t.mul(mean_r) + kC1).mul(2.0 * covariance + kC2);
    const cv::Mat below =
        (mean_t.mul(mean_t) + mean_r.mul(mean_r) + kC1).mul(variance_t + variance_r + kC2);
    sum += above / below / 3.0;
  }
  cv::Mat floats;
  sum.convertTo(floats, CV_32F);
  return {floats.ptr<float>(), floats.ptr<float>() + pixels};
}

}  // namespace truebox
