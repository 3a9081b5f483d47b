// SPDX-License-Identifier: BSD-3-Clause
#include "planning/mutual_visibility.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <random>

#include "transport/shaft.h"

namespace truebox {
namespace {

enum class PieceSight : unsigned char { backs, hidden, partial, full };

struct Piece {
  std::size_t surface = 0;
  Polygon polygon;
  Plane plane;
};

class Shafts {
 public:
  explicit Shafts(const Scene& scene) : tolerance_m_(1e-9 * scene.diameter_m()) {
    for (std::size_t s = 0; s < scene.surfaces.size(); ++s)
      for (const Polygon& polygon : scene.surfaces[s].pieces) {
        pieces_.push_back({s, polygon, plane_of(polygon)});
        Eigen::AlignedBox3d box;
        for (const Vec3& v : polygon) box.extend(v);
        if (scene.surfaces[s].is_opening) continue;  // seen, but nothing there
        blockers_.emplace_back(Blocker{polygon, pieces_.back().plane});
        boxes_.push_back(box);
        piece_of_blocker_.push_back(pieces_.size() - 1);
      }
  }

  const std::vector<Piece>& pieces() const { return pieces_; }

  PieceSight between(std::size_t p, std::size_t q) const {
    Polygon a, b;  // what is behind the other's plane sees nothing of it
    clip(pieces_[p].polygon, pieces_[q].plane, tolerance_m_, a);
    clip(pieces_[q].polygon, pieces_[p].plane, tolerance_m_, b);
    if (!rises(a, pieces_[q].plane) || !rises(b, pieces_[p].plane)) return PieceSight::backs;
    Eigen::AlignedBox3d hull;
    for (const Polygon* polygon : {&a, &b})
      for (const Vec3& v : *polygon) hull.extend(v);
    PieceSight sight = PieceSight::full;
    for (std::size_t k = 0; k < blockers_.size(); ++k) {
      if (piece_of_blocker_[k] == p || piece_of_blocker_[k] == q || !hull.intersects(boxes_[k]))
        continue;
      switch (
          shaft_occlusion(a, pieces_[p].plane, b, pieces_[q].plane, blockers_[k], tolerance_m_)) {
        case ShaftOcclusion::full: return PieceSight::hidden;
        case ShaftOcclusion::partial: sight = PieceSight::partial; break;
        case ShaftOcclusion::none: break;
      }
    }
    return sight;
  }

 private:
  bool rises(const Polygon& polygon, const Plane& plane) const {
    for (const Vec3& v : polygon)
      if (plane.distance_m(v) > tolerance_m_) return true;
    return false;
  }

  double tolerance_m_;
  std::vector<Piece> pieces_;
  std::vector<ShaftBlocker> blockers_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::size_t> piece_of_blocker_;
};

void count(PieceSight sight, MutualVisibility::Shares& shares) {
  ++shares.pairs;
  switch (sight) {
    case PieceSight::backs: ++shares.facing_away; break;
    case PieceSight::hidden: ++shares.hidden; break;
    case PieceSight::partial: ++shares.partial; break;
    case PieceSight::full: ++shares.full; break;
  }
}

// Two surfaces see each other in full if every two of their pieces that face each other do.
Sight joined(Sight before, PieceSight sight, bool first_facing) {
  if (sight == PieceSight::backs) return before;
  const Sight now = sight == PieceSight::hidden    ? Sight::none
                    : sight == PieceSight::partial ? Sight::partial
                                                   : Sight::full;
  return first_facing || now == before ? now : Sight::partial;
}

}  // namespace

MutualVisibility::MutualVisibility(const Scene& scene, std::size_t most_pieces, std::size_t sample)
    : surfaces_(scene.surfaces.size()) {
  const Shafts shafts(scene);
  const std::size_t n = shafts.pieces().size();
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  const bool complete = n <= most_pieces;
  if (complete) {
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) pairs.emplace_back(p, q);
  } else {
    std::mt19937_64 random(1);
    while (pairs.size() < sample) {
      const std::size_t p = random() % n, q = random() % n;
      if (p != q) pairs.emplace_back(p, q);
    }
  }
  std::vector<PieceSight> found(pairs.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pairs.size(), 64), [&](const auto& range) {
    for (std::size_t k = range.begin(); k < range.end(); ++k)
      found[k] = shafts.between(pairs[k].first, pairs[k].second);
  });
  for (PieceSight sight : found) count(sight, shares_);
  if (!complete) return;
  sights_.assign(surfaces_ * surfaces_, Sight::none);
  std::vector<char> faced(sights_.size(), 0);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const std::size_t i = shafts.pieces()[pairs[k].first].surface;
    const std::size_t j = shafts.pieces()[pairs[k].second].surface;
    for (const std::size_t at : {i * surfaces_ + j, j * surfaces_ + i}) {
      sights_[at] = joined(sights_[at], found[k], !faced[at]);
      if (found[k] != PieceSight::backs) faced[at] = 1;
      if (i == j) break;
    }
  }
}

}  // namespace truebox
