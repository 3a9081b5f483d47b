// SPDX-License-Identifier: BSD-3-Clause
#include "transport/ray_casting.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace truebox {
namespace {

std::uint32_t hash(std::uint64_t x) {  // splitmix64 (Steele et al. 2014)
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return static_cast<std::uint32_t>((x ^ (x >> 31)) >> 32);
}

std::uint32_t reversed(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// Owen's scrambling by a hash that only carries upwards in reversed bits (Burley 2020).
std::uint32_t scrambled(std::uint32_t x, std::uint32_t seed) {
  x = reversed(x) + seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return reversed(x);
}

constexpr int kDimensions = 4;

// Direction numbers of the first four Sobol' dimensions (Joe & Kuo 2008).
std::array<std::array<std::uint32_t, 32>, kDimensions> sobol_directions() {
  struct Primitive {
    unsigned degree, coefficients;
    std::array<std::uint32_t, 3> first;
  };
  constexpr std::array<Primitive, kDimensions> kPrimitives = {
      {{0, 0, {}}, {1, 0, {1}}, {2, 1, {1, 3}}, {3, 1, {1, 3, 1}}}};
  std::array<std::array<std::uint32_t, 32>, kDimensions> directions;
  for (unsigned d = 0; d < kDimensions; ++d) {
    const auto& [degree, coefficients, first] = kPrimitives[d];
    auto& v = directions[d];
    for (unsigned i = 0; i < 32; ++i) {
      if (d == 0) {
        v[i] = 1u << (31 - i);
      } else if (i < degree) {
        v[i] = first[i] << (31 - i);
      } else {
        v[i] = v[i - degree] ^ (v[i - degree] >> degree);
        for (unsigned k = 1; k < degree; ++k)
          if ((coefficients >> (degree - 1 - k)) & 1u) v[i] ^= v[i - k];
      }
    }
  }
  return directions;
}

double sobol(std::uint32_t index, int dimension, std::uint32_t seed) {
  static const auto kDirections = sobol_directions();
  std::uint32_t x = 0;
  for (int bit = 0; index != 0; ++bit, index >>= 1)
    if (index & 1u) x ^= kDirections[dimension][bit];
  return scrambled(x, seed) * 0x1p-32;
}

// Edges count as inside: a ray cannot slip between two blockers that share one.
bool blocks(const Blocker& blocker, const Vec3& from, const Vec3& to) {
  const double h = blocker.plane.distance_m(from), g = blocker.plane.distance_m(to);
  if (h * g >= 0.0) return false;
  const Vec3 crossing = from + h / (h - g) * (to - from);
  const Polygon& p = blocker.polygon;
  const double slack = 1e-14 * (to - from).squaredNorm();
  for (std::size_t k = 0; k < p.size(); ++k) {
    const Vec3& a = p[k];
    const Vec3 along = p[(k + 1) % p.size()] - a;
    if (blocker.plane.normal.dot(along.cross(crossing - a)) < -slack) return false;
  }
  return true;
}

}  // namespace

Vec3 sample_polygon(std::span<const Vec3> p, double u, double v) {
  // A triangle of the fan by area, then the square-root map.
  const auto twice_area = [&](std::size_t i) {
    return (p[i + 1] - p[0]).cross(p[i + 2] - p[0]).norm();
  };
  double total = 0.0;
  for (std::size_t i = 0; i + 2 < p.size(); ++i) total += twice_area(i);
  double pick = u * total;
  std::size_t i = 0;
  for (; i + 3 < p.size() && pick > twice_area(i); ++i) pick -= twice_area(i);
  const double s = std::sqrt(std::clamp(pick / twice_area(i), 0.0, 1.0));
  return p[0] + s * ((1.0 - v) * (p[i + 1] - p[0]) + v * (p[i + 2] - p[0]));
}

VisibleShare visible_share(const PlanarPolygon& i, const PlanarPolygon& j,
                           std::span<const Blocker* const> blockers, int rays, std::uint64_t seed) {
  std::array<std::uint32_t, kDimensions> seeds;
  for (int k = 0; k < kDimensions; ++k)
    seeds[k] = hash(seed * kDimensions + static_cast<unsigned>(k));
  std::array<double, kDimensions> at;
  double seen = 0.0, total = 0.0, squares = 0.0;
  for (int n = 0; n < rays; ++n) {
    for (int k = 0; k < kDimensions; ++k) at[k] = sobol(static_cast<std::uint32_t>(n), k, seeds[k]);
    const Vec3 a = sample_polygon(i.vertices, at[0], at[1]);
    const Vec3 b = sample_polygon(j.vertices, at[2], at[3]);
    const Vec3 r = b - a;
    const double cos_i = i.plane.normal.dot(r), cos_j = -j.plane.normal.dot(r);
    if (cos_i <= 0.0 || cos_j <= 0.0) continue;
    const double r2 = r.squaredNorm(), weight = cos_i * cos_j / (r2 * r2);
    total += weight;
    squares += weight * weight;
    if (std::none_of(blockers.begin(), blockers.end(),
                     [&](const Blocker* blocker) { return blocks(*blocker, a, b); }))
      seen += weight;
  }
  if (total == 0.0) return {0.5, 0.5};  // no ray says anything
  const double share = seen / total, effective = total * total / squares;
  const double steadied = (effective * share + 2.0) / (effective + 4.0);
  return {share, std::sqrt(steadied * (1.0 - steadied) / (effective + 4.0))};
}

}  // namespace truebox
