// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/flat_field.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

bool is_central(int x, int y, int width, int height) {
  return 4 * x + 2 >= width && 4 * x + 2 <= 3 * width && 4 * y + 2 >= height &&
         4 * y + 2 <= 3 * height;
}

double squared_radius(int x, int y, int width, int height) {
  const double dx = x + 0.5 - 0.5 * width, dy = y + 0.5 - 0.5 * height;
  return 4.0 * (dx * dx + dy * dy) /
         (static_cast<double>(width) * width + static_cast<double>(height) * height);
}

/// The law's value at r^2 and its derivatives by its parameters.
double law(bool cos4, const Eigen::VectorXd& p, double r2, Eigen::VectorXd* derivative) {
  if (cos4) {
    const double base = 1.0 + p[0] * r2;
    if (derivative) (*derivative)[0] = -2.0 * r2 / (base * base * base);
    return 1.0 / (base * base);
  }
  if (derivative) *derivative << r2, r2 * r2, r2 * r2 * r2;
  return 1.0 + r2 * (p[0] + r2 * (p[1] + r2 * p[2]));
}

}  // namespace

FlatField flat_from_frames(const std::vector<Frame>& frames, const MasterDark* dark,
                           const NoiseModel& noise, const BlockOptions& options, double uncertainty,
                           const std::string& what) {
  FlatField flat;
  if (frames.empty()) return flat;
  flat.width = frames[0].image.width;
  flat.height = frames[0].image.height;
  flat.model = "frames";
  const std::size_t n = frames[0].image.pixel_count();
  if (dark && dark->mean_dn.size() != n)
    throw MismatchError("the dark frames have another size than " + frames[0].path);
  std::vector<double> mean(n, 0.0);
  const double count = static_cast<double>(frames.size());
  for (const Frame& frame : frames) {
    if (frame.image.width != flat.width || frame.image.height != flat.height)
      throw MismatchError(frame.path + ": a flat frame of another size");
    for (std::size_t i = 0; i < n; ++i) {
      const double level = dark ? double{dark->mean_dn[i]} : 0.0;
      mean[i] += options.response.linear_dn(frame.image.channels[0].samples[i] - level) / count;
    }
  }
  std::map<char, std::vector<double>> centre;
  for (int y = 0; y < flat.height; ++y)
    for (int x = 0; x < flat.width; ++x) {
      const std::size_t i = frames[0].image.index(x, y);
      if (!is_central(x, y, flat.width, flat.height) || options.is_excluded(i)) continue;
      if (!(frames[0].image.channels[0].samples[i] < options.saturation_dn))
        throw InputError(
            what, 0, "a flat field below saturation",
            "a saturated photosite at (" + std::to_string(x) + ", " + std::to_string(y) + ")");
      centre[options.site(x, y)].push_back(mean[i]);
    }
  std::map<char, double> scale;
  for (auto& [site, values] : centre) {
    double sum = 0.0;
    for (double v : values) sum += v;
    scale[site] = sum / static_cast<double>(values.size());
    if (!(scale[site] > 0.0))
      throw InputError(what, 0, "a flat field brighter than its dark",
                       "no light on site " + std::string(1, site));
  }
  flat.relative.resize(n);
  flat.u_noise.resize(n);
  flat.u_common.assign(n, static_cast<float>(uncertainty));
  for (std::size_t i = 0; i < n; ++i) {
    const int x = static_cast<int>(i) % flat.width, y = static_cast<int>(i) / flat.width;
    const auto own = scale.find(options.site(x, y));
    if (own == scale.end())
      throw InputError(what, 0, "every colour of the mosaic in the centre of the flat field",
                       "a picture of too few pixels");
    const double slope = options.response.slope(mean[i]);
    const double variance =
        (noise.variance_dn2(mean[i]) / count + (dark ? dark->variance_at(i) : 0.0)) /
        (slope * slope);
    flat.relative[i] = static_cast<float>(mean[i] / own->second);
    flat.u_noise[i] = static_cast<float>(std::sqrt(variance) / std::max(mean[i], 1e-30));
  }
  return flat;
}

FlatField fitted_flat(const FlatField& frames, const std::string& name,
                      const BlockOptions& options) {
  const bool cos4 = name == "cos4";
  const int shape = cos4 ? 1 : 3;
  std::map<char, int> scale_of;
  for (int k = 0; k < 4; ++k) {
    const char site = options.site(k % 2, k / 2);
    if (!scale_of.contains(site)) scale_of[site] = shape + static_cast<int>(scale_of.size());
  }
  const int unknowns = shape + static_cast<int>(scale_of.size());
  Eigen::VectorXd p = Eigen::VectorXd::Zero(unknowns), d(shape), row(unknowns);
  p.tail(unknowns - shape).setOnes();
  Eigen::MatrixXd normal;
  double chi2 = 0.0, used = 0.0;
  for (int pass = 0; pass < (cos4 ? 20 : 4); ++pass) {
    normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    chi2 = used = 0.0;
    for (int y = 0; y < frames.height; ++y)
      for (int x = 0; x < frames.width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(frames.width) +
                              static_cast<std::size_t>(x);
        const double u = double{frames.u_noise[i]} * frames.relative[i];
        if (options.is_excluded(i) || !(u > 0.0)) continue;
        const double r2 = squared_radius(x, y, frames.width, frames.height);
        const int own = scale_of[options.site(x, y)];
        const double value = law(cos4, p, r2, &d);
        row.setZero();
        row.head(shape) = p[own] * d;
        row[own] = value;
        const double residual = frames.relative[i] - p[own] * value;
        normal.noalias() += row * row.transpose() / (u * u);
        right += row * (residual / (u * u));
        chi2 += residual * residual / (u * u);
        used += 1.0;
      }
    const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
    if (used < 4.0 * unknowns || solver.info() != Eigen::Success || !(solver.rcond() > 1e-14)) {
      FlatField kept = frames;
      kept.model = "frames (the law \"" + name + "\" could not be fitted)";
      return kept;
    }
    p += solver.solve(right);
  }
  const Eigen::MatrixXd covariance = normal.inverse();
  FlatField flat = frames;
  flat.model = name;
  flat.chi2_per_dof = chi2 / (used - unknowns);
  const double enlarge = std::max(1.0, flat.chi2_per_dof);
  for (int k = 0; k < shape; ++k) {
    flat.coefficients.push_back(p[k]);
    flat.coefficients_u.push_back(std::sqrt(enlarge * covariance(k, k)));
  }
  const Eigen::MatrixXd inner = enlarge * covariance.topLeftCorner(shape, shape);
  for (std::size_t i = 0; i < flat.relative.size(); ++i) {
    const int x = static_cast<int>(i) % flat.width, y = static_cast<int>(i) / flat.width;
    const double value = law(cos4, p, squared_radius(x, y, flat.width, flat.height), &d);
    const double u_law = std::sqrt(std::max(d.dot(inner * d), 0.0)) / value;
    flat.relative[i] = static_cast<float>(value);
    flat.u_noise[i] = 0.0f;
    flat.u_common[i] = static_cast<float>(std::hypot(double{frames.u_common[i]}, u_law));
  }
  return flat;
}

}  // namespace truebox
