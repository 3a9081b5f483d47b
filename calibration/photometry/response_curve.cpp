// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/response_curve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/photo.hpp>
#include <random>

#include "photometry/exposure_blocks.h"

namespace truebox {
namespace {

constexpr std::size_t kReadings = 256, kMiddle = 128, kUnitReadings = 16;
constexpr double kUnknown = 0.3;       // relative standard uncertainty
constexpr double kLevel = 1.0 + 1e-4;  // above the ties that make_rising parts
constexpr int kSide = 10;              // 100 pixels: Debevec's system has 256 + 100 unknowns
constexpr int kSquareSide = 64;        // Robertson averages over all pixels given

using Curve = std::vector<double>;  // kReadings signals; empty: not recovered

Curve recovered(const std::vector<const Frame*>& frames, const std::vector<std::size_t>& pixels,
                int side, ResponseMethod method) {
  // OpenCV 4.6's Robertson writes three channels whatever the picture has.
  const int channels = method == ResponseMethod::robertson ? 3 : 1;
  std::vector<cv::Mat> pictures;
  std::vector<float> times;
  for (const Frame* frame : frames) {
    cv::Mat picture(side, side, CV_8UC(channels));
    for (int k = 0; k < side * side; ++k)
      std::fill_n(picture.data + channels * k, channels,
                  static_cast<std::uint8_t>(std::clamp(
                      frame->image.channels[0].samples[pixels[static_cast<std::size_t>(k)]], 0.0f,
                      255.0f)));
    pictures.push_back(picture);
    times.push_back(static_cast<float>(frame->exposure_s));
  }
  cv::Mat response;
  try {
    if (method == ResponseMethod::debevec)
      cv::createCalibrateDebevec(side * side, 10.0f, false)->process(pictures, response, times);
    else
      cv::createCalibrateRobertson(60, 0.005f)->process(pictures, response, times);
  } catch (const cv::Exception&) {
    return {};
  }
  if (response.total() != kReadings || response.type() != CV_32FC(channels)) return {};
  Curve curve(kReadings);
  for (std::size_t r = 0; r < kReadings; ++r)
    curve[r] = double{response.ptr<float>(static_cast<int>(r))[0]};
  return curve;
}

/// Nearest non-decreasing curve in relative terms (pool adjacent violators; Ayer et al. 1955),
/// ties parted by one part in a million. Returns the largest relative change.
double make_rising(Curve& curve) {
  struct Pool {
    double sum;
    std::size_t n;
  };
  std::vector<Pool> pools;
  for (double v : curve) {
    pools.push_back({std::log(std::max(v, 1e-12)), 1});
    while (pools.size() > 1) {
      Pool& last = pools.back();
      Pool& before = pools[pools.size() - 2];
      if (before.sum / static_cast<double>(before.n) <= last.sum / static_cast<double>(last.n))
        break;
      before = {before.sum + last.sum, before.n + last.n};
      pools.pop_back();
    }
  }
  double largest = 0.0;
  std::size_t r = 0;
  for (const Pool& pool : pools)
    for (std::size_t k = 0; k < pool.n; ++k, ++r) {
      const double v =
          std::exp(pool.sum / static_cast<double>(pool.n)) * (1.0 + 1e-6 * static_cast<double>(r));
      largest = std::max(largest, std::abs(v / std::max(curve[r], 1e-12) - 1.0));
      curve[r] = v;
    }
  return largest;
}

/// Readings that no pixel held have no signal: a geometric step between their neighbours, the
/// nearest one's at the ends. False if under half of them have one.
bool fill_gaps(Curve& curve) {
  std::vector<std::size_t> known;
  for (std::size_t r = 0; r < curve.size(); ++r)
    if (std::isfinite(curve[r]) && curve[r] > 0.0) known.push_back(r);
  if (known.size() < kReadings / 2) return false;
  for (std::size_t r = 0; r < curve.size(); ++r) {
    const auto next = std::lower_bound(known.begin(), known.end(), r);
    if (next != known.end() && *next == r) continue;
    if (next == known.begin() || next == known.end()) {
      curve[r] = next == known.end() ? curve[known.back()] : curve[known.front()];
      continue;
    }
    const std::size_t low = *(next - 1), high = *next;
    const double share = static_cast<double>(r - low) / static_cast<double>(high - low);
    curve[r] = std::pow(curve[low], 1.0 - share) * std::pow(curve[high], share);
  }
  return true;
}

/// Scales the curve so that the middle readings mean themselves, in the geometric mean of 32 of
/// them: one reading alone is too noisy a unit. False if it is no curve.
bool normalise(Curve& curve) {
  double logs = 0.0;
  for (std::size_t r = kMiddle - kUnitReadings; r <= kMiddle + kUnitReadings; ++r) {
    if (curve.size() != kReadings || !std::isfinite(curve[r]) || !(curve[r] > 0.0)) return false;
    logs += std::log(static_cast<double>(r) / curve[r]);
  }
  const double scale = std::exp(logs / static_cast<double>(2 * kUnitReadings + 1));
  for (double& v : curve) {
    v *= scale;
    if (!std::isfinite(v)) return false;
  }
  return true;
}

/// Pixels that some frame shows off both ends, spread evenly over the order of brightness.
std::vector<std::size_t> usable_pixels(const std::vector<const Frame*>& frames) {
  std::vector<std::pair<double, std::size_t>> ordered;
  for (std::size_t i = 0; i < frames[0]->image.pixel_count(); ++i) {
    double sum = 0.0;
    bool inside = false;
    for (const Frame* frame : frames) {
      const double v = frame->image.channels[0].samples[i];
      if (!std::isfinite(v)) {
        inside = false;
        break;
      }
      sum += v;
      inside = inside || (v > 5.0 && v < 250.0);
    }
    if (inside) ordered.emplace_back(sum, i);
  }
  std::sort(ordered.begin(), ordered.end());
  std::vector<std::size_t> pixels;
  for (const auto& [sum, i] : ordered) pixels.push_back(i);
  return pixels;
}

/// `n` pixels, one at random of each n-th part of the order of brightness.
std::vector<std::size_t> stratified(const std::vector<std::size_t>& ordered, std::size_t n,
                                    std::mt19937_64& random) {
  std::vector<std::size_t> picked(n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t from = k * ordered.size() / n;
    const std::size_t to = std::max((k + 1) * ordered.size() / n, from + 1);
    picked[k] = ordered[std::uniform_int_distribution<std::size_t>(from, to - 1)(random)];
  }
  return picked;
}

}  // namespace

ResponseCurve recover_response(const std::vector<Frame>& frames, ResponseMethod method,
                               std::uint64_t seed, int resamplings) {
  ResponseCurve result;
  if (frames.size() < 2) {
    result.why_not = "one exposure tells nothing of the response";
    return result;
  }
  const auto sorted = sorted_by_exposure(frames);
  if (!(sorted.back()->exposure_s > sorted.front()->exposure_s)) {
    result.why_not = "all exposures are equal";
    return result;
  }
  const auto ordered = usable_pixels(sorted);
  if (ordered.size() < 64) {
    result.why_not =
        "only " + std::to_string(ordered.size()) + " pixels are neither black nor white";
    return result;
  }
  std::mt19937_64 random(seed);
  const int side = method == ResponseMethod::debevec ? kSide : kSquareSide;
  const auto count = static_cast<std::size_t>(side * side);
  const auto draw = [&](const std::vector<const Frame*>& some) {
    Curve curve = recovered(some, stratified(ordered, count, random), side, method);
    return !curve.empty() && fill_gaps(curve) && normalise(curve) ? curve : Curve{};
  };
  // The mean over resamplings is the curve: it uses many more pixels than one set holds.
  Curve mean(kReadings, 0.0), squares(kReadings, 0.0);
  double n = 0.0;
  for (int k = 0; k < std::max(resamplings, 2); ++k) {
    const Curve curve = draw(sorted);
    if (curve.empty()) continue;
    for (std::size_t r = 0; r < kReadings; ++r) {
      mean[r] += curve[r];
      squares[r] += curve[r] * curve[r];
    }
    n += 1.0;
  }
  if (n < 2.0) {
    result.why_not = "the recovery did not converge";
    return result;
  }
  Curve variance(kReadings, 0.0);
  for (std::size_t r = 0; r < kReadings; ++r) {
    mean[r] /= n;
    variance[r] = std::max(squares[r] / n - mean[r] * mean[r], 0.0) * n / (n - 1.0);
  }
  if (sorted.size() >= 3) {
    std::vector<Curve> left_out;
    for (std::size_t f = 0; f < sorted.size(); ++f) {
      auto some = sorted;
      some.erase(some.begin() + static_cast<long>(f));
      Curve curve = draw(some);
      if (!curve.empty()) left_out.push_back(std::move(curve));
    }
    const double m = static_cast<double>(left_out.size());
    for (std::size_t r = 0; m >= 2.0 && r < kReadings; ++r) {
      double centre = 0.0, sum = 0.0;
      for (const Curve& c : left_out) centre += c[r] / m;
      for (const Curve& c : left_out) sum += (c[r] - centre) * (c[r] - centre);
      variance[r] += (m - 1.0) / m * sum;
    }
  }
  std::vector<std::size_t> held(kReadings, 0);
  for (const Frame* frame : sorted)
    for (std::size_t i : ordered)
      ++held[static_cast<std::size_t>(
          std::clamp(frame->image.channels[0].samples[i], 0.0f, 255.0f))];
  while (result.lowest < kMiddle && held[result.lowest] == 0) ++result.lowest;
  while (result.highest > kMiddle && held[result.highest] == 0) --result.highest;
  result.largest_repair = make_rising(mean);
  normalise(mean);
  // Readings at the ends that all stand for one signal, or whose signal is hardly known, are out.
  const auto unknown = [&](std::size_t r) { return std::sqrt(variance[r]) > kUnknown * mean[r]; };
  const auto level = [&](std::size_t r) { return mean[r + 1] < mean[r] * kLevel; };
  while (result.lowest < kMiddle && (unknown(result.lowest) || level(result.lowest)))
    ++result.lowest;
  while (result.highest > kMiddle && (unknown(result.highest) || level(result.highest - 1)))
    --result.highest;
  for (std::size_t r = 0; r < kReadings; ++r)
    result.signal_dn.push_back({mean[r], r >= result.lowest && r <= result.highest
                                             ? std::sqrt(variance[r])
                                             : std::numeric_limits<double>::infinity()});
  result.found = true;
  return result;
}

CameraResponse to_camera_response(const ResponseCurve& curve) {
  CameraResponse response;
  response.table_dn = curve.signal_dn;
  return response;
}

}  // namespace truebox
