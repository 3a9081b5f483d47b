// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/bsdf.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "path_tracer/fresnel.h"

namespace truebox {
namespace {

using Eigen::ArrayXd;
using std::numbers::pi;

Eigen::Map<const ArrayXd> as_array(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

Vec3 cosine_direction(UnitPair p) {  // Malley: uniform in the disk, lifted
  const double r = std::sqrt(p.u), phi = 2.0 * pi * p.v;
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(1.0 - p.u)};
}

double ggx_density(const Vec3& m, double alpha) {
  const double t = m.x() * m.x() + m.y() * m.y() + alpha * alpha * m.z() * m.z();
  return alpha * alpha / (pi * t * t);
}

// Smith's Lambda: (average slope hidden) / (seen).
double smith_lambda(const Vec3& w, double alpha) {
  const double tan2 = (w.x() * w.x() + w.y() * w.y()) / (w.z() * w.z());
  return 0.5 * (std::sqrt(1.0 + alpha * alpha * tan2) - 1.0);
}

// A facet normal as it is seen from `o`. Source: Heitz (2018), JCGT 7(4), listing 1.
Vec3 visible_facet(const Vec3& o, double alpha, UnitPair p) {
  const Vec3 stretched = Vec3(alpha * o.x(), alpha * o.y(), o.z()).normalized();
  const double length2 = stretched.head<2>().squaredNorm();
  const Vec3 t1 = length2 > 0.0
                      ? Vec3(Vec3(-stretched.y(), stretched.x(), 0.0) / std::sqrt(length2))
                      : Vec3(Vec3::UnitX());
  const Vec3 t2 = stretched.cross(t1);
  const double r = std::sqrt(p.u), phi = 2.0 * pi * p.v;
  const double a = r * std::cos(phi), s = 0.5 * (1.0 + stretched.z());
  const double b = (1.0 - s) * std::sqrt(1.0 - a * a) + s * r * std::sin(phi);
  const Vec3 m = a * t1 + b * t2 + std::sqrt(std::max(0.0, 1.0 - a * a - b * b)) * stretched;
  return Vec3(alpha * m.x(), alpha * m.y(), std::max(1e-12, m.z())).normalized();
}

}  // namespace

void Bsdf::fresnel(double cos_incident, Eigen::Ref<ArrayXd> reflectance) const {
  const auto &n = material_->refractive_index, &k = material_->absorption_index;
  for (Eigen::Index b = 0; b < reflectance.size(); ++b) {
    const auto band = static_cast<std::size_t>(b);
    const bool as_before = b > 0 && n[band] == n[band - 1] && k[band] == k[band - 1];
    reflectance[b] =
        as_before ? reflectance[b - 1] : fresnel_conductor(cos_incident, n[band], k[band]);
  }
}

void Bsdf::evaluate(const Vec3& o, const Vec3& i, Eigen::Ref<ArrayXd> f_cos) const {
  if (is_specular() || i.z() <= 0.0 || o.z() <= 0.0) {
    f_cos.setZero();
    return;
  }
  if (material_->scattering == Scattering::lambertian) {
    f_cos = i.z() / pi * as_array(material_->reflectance.values);
    return;
  }
  const Vec3 m = (o + i).normalized();
  const double alpha = material_->roughness;
  fresnel(std::clamp(m.dot(o), 0.0, 1.0), f_cos);
  f_cos *= ggx_density(m, alpha) /
           (4.0 * o.z() * (1.0 + smith_lambda(o, alpha) + smith_lambda(i, alpha)));
}

double Bsdf::density(const Vec3& o, const Vec3& i) const {
  if (is_specular() || i.z() <= 0.0 || o.z() <= 0.0) return 0.0;
  if (material_->scattering == Scattering::lambertian) return i.z() / pi;
  const double alpha = material_->roughness;
  return ggx_density((o + i).normalized(), alpha) / (4.0 * o.z() * (1.0 + smith_lambda(o, alpha)));
}

std::optional<Bsdf::Sample> Bsdf::sample(const Vec3& o, bool from_inside, UnitPair direction,
                                         UnitPair choice, int& only_band,
                                         Eigen::Ref<ArrayXd> weight) const {
  if (o.z() <= 0.0) return std::nullopt;
  switch (material_->scattering) {
    case Scattering::lambertian: {
      weight = as_array(material_->reflectance.values);
      const Vec3 i = cosine_direction(direction);
      return Sample{i, i.z() / pi};
    }
    case Scattering::mirror:
      if (material_->refractive_index.size() > 0)
        fresnel(o.z(), weight);
      else
        weight = as_array(material_->reflectance.values);
      return Sample{{-o.x(), -o.y(), o.z()}};
    case Scattering::rough_conductor: {
      const double alpha = material_->roughness;
      const Vec3 m = visible_facet(o, alpha, direction);
      const Vec3 i = 2.0 * m.dot(o) * m - o;
      if (i.z() <= 0.0) return std::nullopt;
      const double seen = 1.0 + smith_lambda(o, alpha);
      fresnel(std::clamp(m.dot(o), 0.0, 1.0), weight);
      weight *= seen / (seen + smith_lambda(i, alpha));
      return Sample{i, density(o, i)};
    }
    case Scattering::dielectric:
      return through_dielectric(o, from_inside, choice, only_band, weight);
  }
  return std::nullopt;
}

Bsdf::Sample Bsdf::through_dielectric(const Vec3& o, bool from_inside, UnitPair choice,
                                      int& only_band, Eigen::Ref<ArrayXd> weight) const {
  const auto& n = material_->refractive_index.values;
  const bool disperses = std::any_of(n.begin(), n.end(), [&](double v) { return v != n[0]; });
  weight.setOnes();
  if (disperses && only_band < 0) {
    const auto count = static_cast<double>(n.size());
    only_band = static_cast<int>(std::min(count - 1.0, choice.v * count));
    weight.setZero();
    weight[only_band] = count;
  }
  const double index = n[static_cast<std::size_t>(std::max(0, only_band))];
  const double eta = from_inside ? 1.0 / index : index;
  const double reflected = fresnel_dielectric(o.z(), eta);
  if (choice.u < reflected) return {{-o.x(), -o.y(), o.z()}};
  weight /= eta * eta;
  const double sin2 = (1.0 - o.z() * o.z()) / (eta * eta);
  return {{-o.x() / eta, -o.y() / eta, -std::sqrt(std::max(0.0, 1.0 - sin2))}, 0.0, eta, true};
}

}  // namespace truebox
