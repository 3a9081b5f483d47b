// SPDX-License-Identifier: BSD-3-Clause
// The body of shadow_lanes.cpp, once for each width of vectors: everything in it must be compiled
// for that width, for GCC takes comparisons of vectors apart in functions that are not.

// Eight doubles at once, in whatever registers the machine has; no fused products, so that every
// machine finds the same bits (-ffp-contract=off).
using Eight [[gnu::vector_size(64)]] = double;

constexpr int kMostCuts = 12;       // of one shadow that reach the source
constexpr double kNothing = 1e-12;  // of the source's area: rounding
constexpr double kSameLine = 1e-9;  // of its radius: lines closer than this count once

[[gnu::always_inline]] inline Eight load(const std::array<double, kShadowLanes>& values) {
  Eight eight;
  __builtin_memcpy(&eight, values.data(), sizeof(eight));
  return eight;
}

[[gnu::always_inline]] inline void store(std::array<double, kShadowLanes>& values,
                                         const Eight& eight) {
  __builtin_memcpy(values.data(), &eight, sizeof(eight));
}

// Comparisons stand in the selections they are for: kept as masks, compilers take them apart.
[[gnu::always_inline]] inline Eight larger(const Eight& a, const Eight& b) { return a > b ? a : b; }
[[gnu::always_inline]] inline Eight smaller(const Eight& a, const Eight& b) {
  return a < b ? a : b;
}

[[gnu::always_inline]] inline double largest(const Eight& eight) {
  using Four [[gnu::vector_size(32)]] = double;
  Four low, high;
  __builtin_memcpy(&low, &eight, sizeof(low));
  __builtin_memcpy(&high, reinterpret_cast<const char*>(&eight) + sizeof(low), sizeof(high));
  low = low > high ? low : high;
  const double a = low[0] > low[1] ? low[0] : low[1], b = low[2] > low[3] ? low[2] : low[3];
  return a > b ? a : b;
}

// Keeps the part of a segment where a height is at most 0 that falls linearly from `a` to `b`;
// `root` is where it is 0. Nothing is left where low >= high.
[[gnu::always_inline]] inline void keep_behind(const Eight& a, const Eight& b, const Eight& root,
                                               Eight& low, Eight& high) {
  const Eight beyond = Eight{} + 2.0, later = larger(low, root), sooner = smaller(high, root);
  const Eight if_out = b > 0.0 ? beyond : later, if_in = b > 0.0 ? sooner : high;
  low = a > 0.0 ? if_out : low;
  high = a > 0.0 ? high : if_in;
}

// A shadow's line on the source: heights of corners over it, and where edges cross it.
struct Cut {
  Eight along_u, along_v, height;
  Eight slope;  // of the height, within a factor sqrt 2
  std::array<Eight, FlatSource::kMostCorners> corner, root;
};

// Twice the area, and six times its first moments.
struct Region {
  Eight twice = {}, u = {}, v = {};

  [[gnu::always_inline]] void add(const Eight& part, const Eight& sum_u, const Eight& sum_v) {
    twice += part;
    u += part * sum_u;
    v += part * sum_v;
  }
};

struct Cuts {
  std::array<Cut, 3 * kMostCuts> cut;
  int count = 0;
};

// The source's edges as far as they lie behind all cuts.
template <std::size_t kCorners>
[[gnu::always_inline]] inline void add_edges(const FlatSource& s, const Cut* first,
                                             const Cut* last, Region& region) {
  for (std::size_t k = 0; k < kCorners; ++k) {
    const std::size_t next = (k + 1) % kCorners;
    const double eu = s.corner_u[next] - s.corner_u[k], ev = s.corner_v[next] - s.corner_v[k];
    Eight low = {}, high = low + 1.0;
    for (const Cut* cut = first; cut != last; ++cut)
      keep_behind(cut->corner[k], cut->corner[next], cut->root[k], low, high);
    const Eight part = larger(high - low, Eight{}) * (s.corner_u[k] * ev - s.corner_v[k] * eu);
    const Eight both = low + high;
    region.add(part, 2.0 * s.corner_u[k] + both * eu, 2.0 * s.corner_v[k] + both * ev);
  }
}

// The cuts' own lines as far as they lie in the source and behind the other cuts. Of two equal
// lines the first counts.
template <std::size_t kCorners>
[[gnu::always_inline]] inline void add_lines(const FlatSource& s, double same_m, const Cut* first,
                                             const Cut* last, Region& region) {
  for (const Cut* cut = first; cut != last; ++cut) {
    Eight from_u = {}, from_v = {}, to_u = {}, to_v = {}, low = {}, high = {};
    for (std::size_t k = 0; k < kCorners; ++k) {
      const std::size_t next = (k + 1) % kCorners;
      const Eight &a = cut->corner[k], &b = cut->corner[next];
      const Eight u = s.corner_u[k] + cut->root[k] * (s.corner_u[next] - s.corner_u[k]);
      const Eight v = s.corner_v[k] + cut->root[k] * (s.corner_v[next] - s.corner_v[k]);
      const Eight leaves_u = a > 0.0 ? from_u : u, leaves_v = a > 0.0 ? from_v : v;
      const Eight enters_u = b > 0.0 ? to_u : u, enters_v = b > 0.0 ? to_v : v;
      const Eight crosses = a > 0.0 ? high : low + 1.0;
      from_u = b > 0.0 ? leaves_u : from_u;
      from_v = b > 0.0 ? leaves_v : from_v;
      high = b > 0.0 ? crosses : high;
      to_u = a > 0.0 ? enters_u : to_u;
      to_v = a > 0.0 ? enters_v : to_v;
    }
    for (const Cut* other = first; other != last; ++other) {
      if (other == cut) continue;
      const Eight tie = (other < cut ? same_m : -same_m) * other->slope;
      const Eight a = other->along_u * from_u + other->along_v * from_v + (other->height + tie);
      const Eight b = other->along_u * to_u + other->along_v * to_v + (other->height + tie);
      keep_behind(a, b, a / (a - b), low, high);
    }
    const Eight part = larger(high - low, Eight{}) * (from_u * to_v - from_v * to_u);
    const Eight both = low + high;
    region.add(part, 2.0 * from_u + both * (to_u - from_u), 2.0 * from_v + both * (to_v - from_v));
  }
}

// What all lanes need of the source.
struct View {
  Eight rx, ry, rz;      // from the points to the centroid
  Eight r2, cosine;      // of these: length squared, times the receiver's cosine
  Eight ru, rv;          // along the source's axes
  double nu, nv;         // the receiver's normal along them
  double whole_twice_m2;

  // Of the whole kernel, the region's: its area and the kernel at its centroid.
  [[gnu::always_inline]] Eight share(const Region& region) const {
    const double least_m2 = kNothing * whole_twice_m2;
    const Eight third = 1.0 / (3.0 * larger(region.twice, Eight{} + least_m2));
    const Eight u = region.u * third, v = region.v * third;
    const Eight at2 = r2 + 2.0 * (u * ru + v * rv) + u * u + v * v;
    const Eight ratio = r2 / at2;
    const Eight share = region.twice / whole_twice_m2 * (1.0 + (u * nu + v * nv) / cosine) *
                        (ratio * ratio);
    const Eight within = smaller(larger(share, Eight{}), Eight{} + 1.0);
    return region.twice > least_m2 ? within : Eight{};
  }
};

// Adds the cuts of one shadow that reach the source. False if they are too many; `reaches`: from
// some point it may hide something.
[[gnu::always_inline]] inline bool find_cuts(const LaneShadow& shadow, const PlanarPolygon& source,
                                             const FlatSource& flat, Cuts& cuts,
                                             bool& reaches) {
  const Vec3& c = source.centroid;
  const double radius_m = source.radius_m;
  const int before = cuts.count;
  Eight highest = Eight{} - radius_m;
  for (int p = 0; p < shadow.count; ++p) {
    const auto at = static_cast<std::size_t>(p);
    const Eight x = load(shadow.x[at]), y = load(shadow.y[at]), z = load(shadow.z[at]);
    const Eight height = x * c.x() + y * c.y() + z * c.z() - load(shadow.offset_m[at]);
    if (largest(height) <= -radius_m) continue;
    highest = larger(highest, height);
    if (cuts.count - before == kMostCuts) return false;
    Cut& cut = cuts.cut[static_cast<std::size_t>(cuts.count++)];
    cut.along_u = x * flat.u.x() + y * flat.u.y() + z * flat.u.z();
    cut.along_v = x * flat.v.x() + y * flat.v.y() + z * flat.v.z();
    cut.height = height;
    cut.slope = larger(cut.along_u, -cut.along_u) + larger(cut.along_v, -cut.along_v);
  }
  reaches = largest(-highest) > -radius_m;
  return true;
}

template <std::size_t kCorners>
[[gnu::always_inline]] inline void measure(const FlatSource& flat, Cut& cut) {
  for (std::size_t k = 0; k < kCorners; ++k)
    cut.corner[k] = cut.along_u * flat.corner_u[k] + cut.along_v * flat.corner_v[k] + cut.height;
  for (std::size_t k = 0; k < kCorners; ++k)
    cut.root[k] = cut.corner[k] / (cut.corner[k] - cut.corner[(k + 1) % kCorners]);
}

[[gnu::always_inline]] inline View view_of(const LanePoints& points, const Vec3& normal,
                                           const PlanarPolygon& source, const FlatSource& flat) {
  View view;
  const Vec3& c = source.centroid;
  view.rx = c.x() - load(points.x);
  view.ry = c.y() - load(points.y);
  view.rz = c.z() - load(points.z);
  view.r2 = view.rx * view.rx + view.ry * view.ry + view.rz * view.rz;
  view.cosine = view.rx * normal.x() + view.ry * normal.y() + view.rz * normal.z();
  view.ru = view.rx * flat.u.x() + view.ry * flat.u.y() + view.rz * flat.u.z();
  view.rv = view.rx * flat.v.x() + view.ry * flat.v.y() + view.rz * flat.v.z();
  view.nu = normal.dot(flat.u);
  view.nv = normal.dot(flat.v);
  view.whole_twice_m2 = 2.0 * source.area_m2;
  return view;
}

template <std::size_t kCorners>
[[gnu::always_inline]] inline Eight share_behind(const FlatSource& flat, double same_m,
                                                 const View& view, const Cut* first,
                                                 const Cut* last) {
  Region region;
  add_edges<kCorners>(flat, first, last, region);
  add_lines<kCorners>(flat, same_m, first, last, region);
  return view.share(region);
}

// Of the union of at most two shadows, whose cuts begin at `begin`.
template <std::size_t kCorners>
[[gnu::always_inline]] inline Eight share_in_shadow(const FlatSource& flat, double same_m,
                                                    const View& view, Cuts& cuts,
                                                    const std::array<int, 3>& begin, int active) {
  for (int k = 0; k < cuts.count; ++k) measure<kCorners>(flat, cuts.cut[static_cast<std::size_t>(k)]);
  const Cut* const first = cuts.cut.data();
  Eight hidden = {};
  for (std::size_t k = 0; k < static_cast<std::size_t>(active); ++k)
    hidden += share_behind<kCorners>(flat, same_m, view, first + begin[k], first + begin[k + 1]);
  if (active == 2)
    hidden -= share_behind<kCorners>(flat, same_m, view, first, first + begin[2]);
  return hidden;
}

bool hidden_shares(const LanePoints& points, const Vec3& normal, const PlanarPolygon& source,
                   const FlatSource& flat, std::span<const LaneShadow* const> shadows,
                   LaneShares& shares) {
  const View view = view_of(points, normal, source, flat);
  const Vec3& m = source.plane.normal;
  const Eight cosine = -(view.rx * m.x() + view.ry * m.y() + view.rz * m.z());
  store(shares.kernel_m2,
        load(points.weight_m2) * view.cosine * cosine / (view.r2 * view.r2));
  Cuts cuts;
  std::array<int, 3> begin{};
  int active = 0;
  std::uint32_t all = 0;
  for (const LaneShadow* shadow : shadows) {
    all |= shadow->hides_all;
    const int before = cuts.count;
    bool reaches = false;
    if (!find_cuts(*shadow, source, flat, cuts, reaches)) return false;
    if (!reaches) {
      cuts.count = before;
      continue;
    }
    if (active == 2) return false;
    begin[static_cast<std::size_t>(++active)] = cuts.count;
  }
  const double same_m = kSameLine * source.radius_m;
  Eight hidden = flat.corners == 4
                     ? share_in_shadow<4>(flat, same_m, view, cuts, begin, active)
                     : share_in_shadow<FlatSource::kMostCorners>(flat, same_m, view, cuts, begin,
                                                                 active);
  const Eight one = Eight{} + 1.0;
  hidden = smaller(larger(hidden, Eight{}), one);
  store(shares.hidden, hidden > 1.0 - kNothing ? one : hidden);
  for (std::size_t l = 0; l < kShadowLanes; ++l)
    if (all >> l & 1u) shares.hidden[l] = 1.0;
  return true;
}

// One more plane: where `there` is not 0, n . x = offset; elsewhere everything is behind.
[[gnu::always_inline]] inline bool add_plane(LaneShadow& shadow, const Eight& there, const Eight& x,
                                             const Eight& y, const Eight& z,
                                             const Eight& offset_m) {
  if (shadow.count == LaneShadow::kMostPlanes) return false;
  const auto at = static_cast<std::size_t>(shadow.count++);
  const Eight none = {}, far = none + std::numeric_limits<double>::max();
  store(shadow.x[at], there != 0.0 ? x : none);
  store(shadow.y[at], there != 0.0 ? y : none);
  store(shadow.z[at], there != 0.0 ? z : none);
  store(shadow.offset_m[at], there != 0.0 ? offset_m : far);
  return true;
}

[[gnu::always_inline]] inline std::uint32_t bits_of(const Eight& lanes) {
  std::uint32_t bits = 0;
  for (std::size_t l = 0; l < kShadowLanes; ++l) bits |= (lanes[l] != 0.0 ? 1u : 0u) << l;
  return bits;
}

[[gnu::always_inline]] inline Eight square_root(const Eight& eight) {
  std::array<double, kShadowLanes> values;
  store(values, eight);
  for (double& value : values) value = std::sqrt(value);
  return load(values);
}

// Planes through an edge of the outline, from the points that see one of its two faces.
[[gnu::always_inline]] inline bool add_outline(LaneShadow& shadow, const LanePoints& points,
                                               const ConvexOccluder::Edge& edge,
                                               const Eight& which) {
  const Vec3 &a = edge.a, &b = edge.b;
  const Eight ax = a.x() - load(points.x), ay = a.y() - load(points.y), az = a.z() - load(points.z);
  const double ex = b.x() - a.x(), ey = b.y() - a.y(), ez = b.z() - a.z();
  const Eight cx = ay * ez - az * ey, cy = az * ex - ax * ez, cz = ax * ey - ay * ex;
  const Eight length = which * square_root(cx * cx + cy * cy + cz * cz);
  const Eight over = 1.0 / (length != 0.0 ? length : Eight{} + 1.0);
  const Eight nx = cx * over, ny = cy * over, nz = cz * over;
  return add_plane(shadow, length, nx, ny, nz, nx * a.x() + ny * a.y() + nz * a.z());
}

constexpr std::size_t kMostFaces = 32;

bool make_shadow(const LanePoints& points, const Vec3& normal, const ConvexOccluder& solid,
                 double tolerance_m, LaneShadow& shadow) {
  const Eight px = load(points.x), py = load(points.y), pz = load(points.z);
  const Eight zero = {}, one = zero + 1.0;
  std::array<Eight, kMostFaces> sees;  // 1 or 0
  Eight sees_any = {}, looks_out = {};
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    const Vec3& n = solid.faces[f].normal;
    const Eight height = n.x() * px + n.y() * py + n.z() * pz - solid.faces[f].offset_m;
    sees[f] = height > tolerance_m ? one : zero;
    sees_any = larger(sees_any, sees[f]);
    if (normal.dot(n) > 0.0) looks_out = height >= -tolerance_m ? one : looks_out;
  }
  const Eight nothing = (one - sees_any) * looks_out;
  shadow.count = 0;
  shadow.hides_all = bits_of((one - sees_any) * (one - looks_out));
  if (bits_of(nothing) != 0)
    add_plane(shadow, nothing, zero, zero, zero, zero - std::numeric_limits<double>::max());
  for (const ConvexOccluder::Edge& edge : solid.edges) {
    const Eight which = sees[edge.left] - sees[edge.right];
    if (bits_of(which) != 0 && !add_outline(shadow, points, edge, which)) return false;
  }
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    const Plane& face = solid.faces[f];
    if (bits_of(sees[f]) != 0 &&
        !add_plane(shadow, sees[f], zero + face.normal.x(), zero + face.normal.y(),
                   zero + face.normal.z(), zero + (face.offset_m - tolerance_m)))
      return false;
  }
  return true;
}
