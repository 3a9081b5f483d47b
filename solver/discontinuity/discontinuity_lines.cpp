// SPDX-License-Identifier: BSD-3-Clause
#include "discontinuity/discontinuity_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "discontinuity/plane_frame.h"
#include "transport/view_events.h"

namespace truebox {
namespace {

constexpr int kSamples = 8;  // along a line
// A kink's second difference falls to 1/4 (D1) or 1/16 (D2) where the step is a quarter; that of
// smooth light changes from one side to the other by its third derivative, 1/64.
constexpr double kShorter = 0.25, kKinked = 1.0 / 32.0;

class LinesOfPiece {
 public:
  LinesOfPiece(const Scene& scene, const PatchMesh& mesh, std::uint32_t piece, const Gather& gather,
               const ShaftCulling& culling, const LineOptions& options)
      : scene_(scene),
        mesh_(mesh),
        index_(piece),
        piece_(mesh.pieces[piece]),
        gather_(gather),
        culling_(culling),
        options_(options),
        frame_(piece_.polygon),
        receiver_(piece_.polygon) {}

  std::vector<DiscontinuityLine> run() {
    for (const ContactLine& contact : piece_.contacts)
      lines_.push_back({contact.from, contact.to, 0, std::numeric_limits<double>::infinity()});
    for (std::uint32_t lamp = 0; lamp < mesh_.pieces.size(); ++lamp) {
      const Surface& surface = scene_.surfaces[mesh_.pieces[lamp].surface];
      if (lamp == index_ || surface.is_opening || !scene_.material_of(surface).emits()) continue;
      const auto& exitance = scene_.material_of(surface).exitance.values;
      lamp_ = lamp;
      exitance_ = std::accumulate(exitance.begin(), exitance.end(), 0.0);
      add_lines_of_lamp();
    }
    return std::move(lines_);
  }

 private:
  static ShaftEnd end_of(const Piece& piece) {
    ShaftEnd end{piece.polygon, piece.plane, {}, true};
    for (const Vec3& v : piece.polygon) end.box.extend(v);
    return end;
  }

  void add_lines_of_lamp() {
    const Piece& lamp = mesh_.pieces[lamp_];
    const ShaftEnd here = end_of(piece_), there = end_of(lamp);
    if (here.is_behind(lamp.plane, culling_.tolerance_m()) ||
        there.is_behind(piece_.plane, culling_.tolerance_m()))
      return;
    add_plane_of_lamp(lamp.plane);
    std::vector<std::uint32_t> between = culling_.blockers();
    const std::size_t all = between.size();
    if (!culling_.keep_between(here, there, between, 0, all)) return;
    std::vector<Blocker> blockers;
    for (std::size_t k = all; k < between.size(); ++k)
      if (between[k] != index_ && between[k] != lamp_)
        blockers.push_back({mesh_.pieces[between[k]].polygon, mesh_.pieces[between[k]].plane});
    std::vector<const Blocker*> pointers;
    for (const Blocker& blocker : blockers) pointers.push_back(&blocker);
    for (const ViewEvent& event : view_events(receiver_, PlanarPolygon(lamp.polygon), pointers))
      add(event.from, event.to, event.of_two_edges ? 1 : 2);
  }

  // Where the luminaire is seen edge-on: its light rises from nothing.
  void add_plane_of_lamp(const Plane& plane) {
    std::vector<Vec3> crossing;
    const Polygon& p = piece_.polygon;
    for (std::size_t k = 0; k < p.size(); ++k) {
      const Vec3 &a = p[k], &b = p[(k + 1) % p.size()];
      const double h = plane.distance_m(a), g = plane.distance_m(b);
      if ((h > 0.0) != (g > 0.0)) crossing.push_back(a + h / (h - g) * (b - a));
    }
    if (crossing.size() == 2) add(crossing[0], crossing[1], 1);
  }

  // The part of a segment on the piece; false if none worth a name.
  bool clip_to_piece(Vec3& from, Vec3& to) const {
    double t0 = 0.0, t1 = 1.0;
    const Polygon& p = piece_.polygon;
    for (std::size_t k = 0; k < p.size(); ++k) {
      const Vec3 inward = frame_.normal().cross(p[(k + 1) % p.size()] - p[k]).normalized();
      const double a = inward.dot(from - p[k]), b = inward.dot(to - p[k]);
      if (std::max(a, b) <= 1e-9 * piece_.diameter_m) return false;
      if (a < 0.0) t0 = std::max(t0, a / (a - b));
      if (b < 0.0) t1 = std::min(t1, a / (a - b));
    }
    const Vec3 along = to - from;
    to = from + t1 * along;
    from += t0 * along;
    return (t1 - t0) * along.norm() > 1e-6 * piece_.diameter_m;
  }

  void add(Vec3 from, Vec3 to, int order) {
    if (!clip_to_piece(from, to)) return;
    int first = kSamples, last = -1;
    double square = 0.0;
    for (int k = 0; k < kSamples; ++k) {
      const Vec3 x = from + (k + 0.5) / kSamples * (to - from);
      const double strength = strength_at(x, frame_.normal().cross(to - from).normalized());
      if (!(strength >= options_.least_strength && strength > 0.0)) continue;
      first = std::min(first, k);
      last = k;
      square += strength * strength;
    }
    if (last < 0) return;
    const Vec3 step = (to - from) / kSamples;
    const double rms = std::sqrt(square / (last - first + 1));
    lines_.push_back({from + first * step, from + (last + 1) * step, order, rms});
  }

  double irradiance(const Vec3& x) {
    return exitance_ *
           gather_.visible_factor(x, frame_.normal(), mesh_.pieces[lamp_].polygon, lamp_, scratch_);
  }

  // How far the second difference across the line is from those on either side.
  double kink(const Vec3& x, const Vec3& step) {
    std::array<double, 5> e;
    for (int k = 0; k < 5; ++k) e[static_cast<std::size_t>(k)] = irradiance(x + (k - 2) * step);
    const double left = e[2] - 2.0 * e[1] + e[0], right = e[4] - 2.0 * e[3] + e[2];
    const double across = e[3] - 2.0 * e[2] + e[1];
    return std::max(std::abs(across - left), std::abs(across - right));
  }

  double strength_at(const Vec3& x, const Vec3& across) {
    const Vec3 step = 0.5 * options_.width_m * across;
    const double wide = kink(x, step) / options_.unit;
    if (wide < options_.least_strength) return 0.0;
    return kink(x, kShorter * step) / options_.unit >= kKinked * wide ? wide : 0.0;
  }

  const Scene& scene_;
  const PatchMesh& mesh_;
  std::uint32_t index_;
  const Piece& piece_;
  const Gather& gather_;
  const ShaftCulling& culling_;
  const LineOptions& options_;
  PlaneFrame frame_;
  PlanarPolygon receiver_;
  std::uint32_t lamp_ = 0;
  double exitance_ = 0.0;
  Gather::Scratch scratch_;
  std::vector<DiscontinuityLine> lines_;
};

}  // namespace

std::vector<DiscontinuityLine> discontinuity_lines(const Scene& scene, const PatchMesh& mesh,
                                                   std::uint32_t piece, const Gather& gather,
                                                   const ShaftCulling& culling,
                                                   const LineOptions& options) {
  return LinesOfPiece(scene, mesh, piece, gather, culling, options).run();
}

}  // namespace truebox
