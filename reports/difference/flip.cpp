// SPDX-License-Identifier: BSD-3-Clause
#include "difference/flip.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "difference/ciede2000.h"
#include "difference/display_light.h"

namespace truebox {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kColourExponent = 0.7;  // q_c
/// Y, Cx, Cz: like CIELAB without the cube root, so that it stays linear (section 4.1).
struct Opponent {
  cv::Mat y, cx, cz;
};

LinearRgb clamped(const LinearRgb& c) {
  return {std::clamp(c[0], 0.0, 1.0), std::clamp(c[1], 0.0, 1.0), std::clamp(c[2], 0.0, 1.0)};
}

/// CIELAB whose chroma grows with lightness as colourfulness does (Hunt; section 4.1).
Lab hunt_adjusted(const LinearRgb& rgb) {
  const Lab lab = cielab(xyz_from_bt709(rgb), kDisplayWhite);
  return {lab.L, 0.01 * lab.L * lab.a, 0.01 * lab.L * lab.b};
}

Opponent opponent(int width, int height, const RgbPlanes& planes) {
  Opponent result{{height, width, CV_32F}, {height, width, CV_32F}, {height, width, CV_32F}};
  auto *y = result.y.ptr<float>(), *cx = result.cx.ptr<float>(), *cz = result.cz.ptr<float>();
  for (std::size_t i = 0; i < planes[0].size(); ++i) {
    const Tristimulus s = xyz_from_bt709(clamped({planes[0][i], planes[1][i], planes[2][i]}));
    const double x = s.X / kDisplayWhite.X, z = s.Z / kDisplayWhite.Z;
    y[i] = static_cast<float>(116.0 * s.Y - 16.0);
    cx[i] = static_cast<float>(500.0 * (x - s.Y));
    cz[i] = static_cast<float>(200.0 * (s.Y - z));
  }
  return result;
}

cv::Mat filtered(const cv::Mat& plane, const cv::Mat& along_x, const cv::Mat& along_y) {
  cv::Mat result;
  cv::sepFilter2D(plane, result, CV_32F, along_x, along_y, cv::Point(-1, -1), 0.0,
                  cv::BORDER_REPLICATE);
  return result;
}

/// One Gaussian of a contrast sensitivity: a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees.
struct Sensitivity {
  double a, b;
};
constexpr double kWidest = 0.04;  // the largest b of table 1, which sets the radius of all kernels

/// Filters with the sum of Gaussians of table 1, cut off at the common radius and normalised: each
/// Gaussian is separable, so their sum takes two one-dimensional passes each.
cv::Mat seen(const cv::Mat& plane, std::initializer_list<Sensitivity> gaussians, double ppd) {
  const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(kWidest / (2 * kPi * kPi)) * ppd));
  cv::Mat sum;
  double total = 0.0;
  for (const Sensitivity& g : gaussians) {
    cv::Mat kernel(2 * radius + 1, 1, CV_64F);
    for (int k = -radius; k <= radius; ++k)
      kernel.at<double>(k + radius) = std::exp(-kPi * kPi * k * k / (ppd * ppd * g.b));
    const double weight = g.a * std::sqrt(kPi / g.b);
    total += weight * std::pow(cv::sum(kernel)[0], 2);
    const cv::Mat part = weight * filtered(plane, kernel, kernel);
    sum = sum.empty() ? part : cv::Mat(sum + part);
  }
  return sum / total;
}

/// Hunt-adjusted CIELAB of the filtered picture, clamped to what the display can show.
std::vector<Lab> perceived(const Opponent& o, double ppd) {
  const cv::Mat my = seen(o.y, {{1.0, 0.0047}}, ppd), mx = seen(o.cx, {{1.0, 0.0053}}, ppd),
                mz = seen(o.cz, {{34.1, 0.04}, {13.5, 0.025}}, ppd);
  std::vector<Lab> result(static_cast<std::size_t>(my.total()));
  const auto *py = my.ptr<float>(), *px = mx.ptr<float>(), *pz = mz.ptr<float>();
  for (std::size_t i = 0; i < result.size(); ++i) {
    const double y = (py[i] + 16.0) / 116.0;
    const Tristimulus xyz = {(y + px[i] / 500.0) * kDisplayWhite.X, y,
                             (y - pz[i] / 200.0) * kDisplayWhite.Z};
    result[i] = hunt_adjusted(clamped(bt709_from_xyz(xyz)));
  }
  return result;
}

double hyab(const Lab& p, const Lab& q) {
  return std::abs(p.L - q.L) + std::hypot(p.a - q.a, p.b - q.b);
}

/// Colour difference in [0, 1]: HyAB to the power q_c, its lower 40 % stretched over 95 %.
double colour_error(double distance, double largest) {
  constexpr double kCut = 0.4, kShare = 0.95;
  const double e = std::pow(distance, kColourExponent), cut = kCut * largest;
  if (e < cut) return kShare / cut * e;
  return kShare + (e - cut) / (largest - cut) * (1.0 - kShare);
}

/// Scales the positive weights to a sum of 1 and the negative ones to -1.
void balance(cv::Mat& kernel) {
  double positive = 0.0, negative = 0.0;
  for (int k = 0; k < kernel.rows; ++k)
    (kernel.at<double>(k) > 0.0 ? positive : negative) += kernel.at<double>(k);
  for (int k = 0; k < kernel.rows; ++k)
    kernel.at<double>(k) /= kernel.at<double>(k) > 0.0 ? positive : -negative;
}

/// How strong an edge and a point are at each pixel of the achromatic picture.
struct Features {
  cv::Mat edge, point;
};

Features features(const cv::Mat& y, double ppd) {
  const double sigma = 0.5 * 0.082 * ppd;  // 0.082 degrees from peak to trough
  const int radius = static_cast<int>(std::ceil(3.0 * sigma)), size = 2 * radius + 1;
  cv::Mat gauss(size, 1, CV_64F), first(size, 1, CV_64F), second(size, 1, CV_64F);
  for (int k = -radius; k <= radius; ++k) {
    const double g = std::exp(-k * k / (2.0 * sigma * sigma));
    gauss.at<double>(k + radius) = g;
    first.at<double>(k + radius) = -k * g;
    second.at<double>(k + radius) = (k * k / (sigma * sigma) - 1.0) * g;
  }
  gauss /= cv::sum(gauss)[0];
  balance(first);
  balance(second);
  const cv::Mat normal = (y + 16.0) / 116.0;
  Features f;
  cv::magnitude(filtered(normal, first, gauss), filtered(normal, gauss, first), f.edge);
  cv::magnitude(filtered(normal, second, gauss), filtered(normal, gauss, second), f.point);
  return f;
}

}  // namespace

std::vector<float> flip(int width, int height, const RgbPlanes& test, const RgbPlanes& reference,
                        double pixels_per_degree) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (const RgbPlanes* planes : {&test, &reference})
    for (const auto& plane : *planes)
      if (plane.size() != pixels || pixels == 0)
        throw std::invalid_argument("a plane has other than width x height samples");
  if (!(pixels_per_degree > 0.0)) throw std::invalid_argument("pixels per degree must be positive");
  const Opponent t = opponent(width, height, test), r = opponent(width, height, reference);
  const auto seen_t = perceived(t, pixels_per_degree), seen_r = perceived(r, pixels_per_degree);
  const Features ft = features(t.y, pixels_per_degree), fr = features(r.y, pixels_per_degree);
  const double largest =
      std::pow(hyab(hunt_adjusted({0, 1, 0}), hunt_adjusted({0, 0, 1})), kColourExponent);
  std::vector<float> result(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double colour = colour_error(hyab(seen_t[i], seen_r[i]), largest);
    const double feature = std::max(std::abs(ft.edge.ptr<float>()[i] - fr.edge.ptr<float>()[i]),
                                    std::abs(ft.point.ptr<float>()[i] - fr.point.ptr<float>()[i]));
    const double exponent = 1.0 - std::sqrt(std::min(1.0, feature / std::numbers::sqrt2));
    result[i] = static_cast<float>(std::pow(colour, exponent));
  }
  return result;
}

}  // namespace truebox
