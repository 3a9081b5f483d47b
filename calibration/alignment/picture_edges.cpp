// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "alignment/edge_field.h"
#include "alignment/edge_localisation.h"
#include "alignment/edge_planes.h"
#include "alignment/edge_source.h"
#include "alignment/rendered_view.h"

namespace truebox {
namespace {

constexpr int kMost = 1280;         // px a side in which a render's edges are sought
constexpr double kHalfPiece = 6.0;  // px of the planes along an edge
constexpr double kHalfWidth = 5.0;  // across

/// A straight piece of edge in the planes' pixels.
struct Piece {
  PixelPosition centre;
  std::array<double, 2> normal{};
  double u_px = 0.0;

  std::array<double, 2> tangent() const { return {-normal[1], normal[0]}; }
  PixelPosition along(double px) const {
    return {centre.x_px + px * tangent()[0], centre.y_px + px * tangent()[1]};
  }
  PixelPosition across(double px) const {
    return {centre.x_px + px * normal[0], centre.y_px + px * normal[1]};
  }
};

/// How far from a piece another point is, along and across it.
std::array<double, 2> offset(const Piece& from, PixelPosition to) {
  const double dx = to.x_px - from.centre.x_px, dy = to.y_px - from.centre.y_px;
  return {dx * from.tangent()[0] + dy * from.tangent()[1],
          dx * from.normal[0] + dy * from.normal[1]};
}

/// Places a piece on the step and turns it along, from its two halves; nothing where there is no
/// step or it is not straight.
std::optional<Piece> settled(const EdgePlanes& planes, Piece piece) {
  constexpr double kMostTurn = 0.05;  // left after the last round: a corner or an arc
  double turn = 1.0;
  for (int round = 0; round < 3; ++round) {
    double offsets[2];
    for (const int side : {0, 1}) {
      const double at = side == 0 ? -0.5 * kHalfPiece : 0.5 * kHalfPiece;
      const auto found =
          localised_edge(planes, {piece.along(at), piece.normal, 0.5 * kHalfPiece, kHalfWidth});
      if (!found) return std::nullopt;
      offsets[side] = found->offset_px;
    }
    turn = (offsets[1] - offsets[0]) / kHalfPiece;
    piece.centre = piece.across(0.5 * (offsets[0] + offsets[1]));
    const auto t = piece.tangent();
    const double length = std::hypot(1.0, turn);
    piece.normal = {(piece.normal[0] - turn * t[0]) / length,
                    (piece.normal[1] - turn * t[1]) / length};
  }
  if (std::abs(turn) > kMostTurn) return std::nullopt;
  const auto whole = localised_edge(planes, {piece.centre, piece.normal, kHalfPiece, kHalfWidth});
  if (!whole || whole->u_px > 0.3) return std::nullopt;
  piece.centre = piece.across(whole->offset_px);
  piece.u_px = whole->u_px;
  return piece;
}

/// Pieces that do not overlap, over all edges of a picture.
std::vector<Piece> pieces_of(const EdgePlanes& planes) {
  const EdgeField field(planes.width, planes.height, planes.guide, 1.0);
  const auto ridges = field.ridges();
  std::vector<bool> taken(ridges.size(), false);
  std::vector<Piece> pieces;
  const auto near_border = [&](PixelPosition p) {
    constexpr double kMargin = kHalfPiece + 2.0;
    return p.x_px < kMargin || p.y_px < kMargin || p.x_px > planes.width - kMargin ||
           p.y_px > planes.height - kMargin;
  };
  for (std::size_t i = 0; i < ridges.size(); ++i) {
    if (taken[i] || near_border(ridges[i].position)) continue;
    const auto piece = settled(
        planes,
        {ridges[i].position, {std::cos(ridges[i].angle_rad), std::sin(ridges[i].angle_rad)}, 0.0});
    if (!piece || near_border(piece->centre)) continue;
    const bool overlaps = std::any_of(pieces.begin(), pieces.end(), [&](const Piece& other) {
      const auto [along, across] = offset(other, piece->centre);
      return std::abs(along) < 2.0 * kHalfPiece - 1.0 && std::abs(across) < 2.0;
    });
    if (overlaps) continue;
    for (std::size_t k = 0; k < ridges.size(); ++k) {
      const auto [along, across] = offset(*piece, ridges[k].position);
      if (std::abs(along) < kHalfPiece && std::abs(across) < 2.0) taken[k] = true;
    }
    pieces.push_back(*piece);
  }
  return pieces;
}

class OfPicture : public EdgeSource {
 public:
  OfPicture(const RenderedView& view, const CameraDescription& like) : view_(view), like_(like) {
    const EdgePlanes planes = edge_planes(view.picture(), kMost);
    for (const Piece& piece : pieces_of(planes)) add(piece, planes.reduction);
    group_into_lines();
    find_centre();
  }

  std::vector<EdgeSample> visible(const CameraParameters& p,
                                  const EdgeSampling& sampling) const override {
    const double width = like_.pixels[0], height = like_.pixels[1], margin = sampling.margin_px;
    std::vector<EdgeSample> samples;
    for (const Known& known : pieces_) {
      const auto at = projected(p, known.point_m), from = projected(p, known.from_m),
                 to = projected(p, known.to_m);
      if (!at || !from || !to) continue;
      if (at->x_px < -margin || at->y_px < -margin || at->x_px > width + margin ||
          at->y_px > height + margin)
        continue;
      const double dx = to->x_px - from->x_px, dy = to->y_px - from->y_px;
      const double length = std::hypot(dx, dy);
      if (!(length > 0.0)) continue;
      EdgeSample s;
      s.edge = known.line;
      s.point_m = known.point_m;
      s.position = *at;
      s.normal = {dy / length, -dx / length};
      s.half_length_px = 0.5 * length;
      s.sides = {known.sides[0], known.sides[1]};
      samples.push_back(s);
    }
    return sampling.clearance_px > 0.0 ? cleared(samples, sampling.clearance_px) : samples;
  }

  std::string border_name(const EdgeSample& sample) const override {
    if (view_.is_print()) return "line " + std::to_string(sample.edge + 1);
    std::string a = view_.surface_name(sample.sides[0]), b = view_.surface_name(sample.sides[1]);
    if (a == b) return "on " + a;  // a shadow's edge
    if (b < a) std::swap(a, b);
    return a + "/" + b;
  }
  Vec3 centre_m() const override { return centre_m_; }
  std::string what() const override { return "picture"; }

 private:
  struct Known {
    Vec3 point_m, from_m, to_m;
    std::array<int, 2> sides{};  // surfaces
    std::size_t line = 0;
    Piece piece;  // px of the render
  };

  // The plane that the edge lies on: of the nearer surface, where there are two.
  void add(Piece piece, int reduction) {
    piece.centre = {piece.centre.x_px * reduction, piece.centre.y_px * reduction};
    std::optional<RenderedView::Place> best;
    Known known;
    for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
      const PixelPosition beside = piece.across((side == 0 ? -2.0 : 2.0) * reduction);
      const auto place = view_.at_pixel(static_cast<int>(std::floor(beside.x_px)),
                                        static_cast<int>(std::floor(beside.y_px)));
      known.sides[side] = place ? place->surface : 0;
      if (place && (!best || distance(*place) < distance(*best))) best = place;
    }
    if (!best) return;
    const double half = kHalfPiece * reduction;
    const auto at = view_.on_plane(*best, piece.centre),
               from = view_.on_plane(*best, piece.along(-half)),
               to = view_.on_plane(*best, piece.along(half));
    if (!at || !from || !to) return;
    known.point_m = *at;
    known.from_m = *from;
    known.to_m = *to;
    known.piece = piece;
    pieces_.push_back(known);
  }

  double distance(const RenderedView::Place& place) const {
    return (place.point_m - view_.camera().position_m).norm();
  }

  // Pieces that go on from one another, also around a lens' bend, are one line, in their order.
  void group_into_lines() {
    const auto continues = [](const Known& a, const Known& b) {
      constexpr double kMostGap = 5.0 * kHalfPiece, kMostTurn = 0.08;
      const auto [along, across] = offset(a.piece, b.piece.centre);
      const double parallel =
          a.piece.normal[0] * b.piece.normal[0] + a.piece.normal[1] * b.piece.normal[1];
      return std::abs(parallel) > std::cos(kMostTurn) && std::abs(along) < kMostGap &&
             std::abs(across) < 0.5 + kMostTurn * std::abs(along);
    };
    std::vector<std::size_t> line(pieces_.size());
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      line[i] = i;
      for (std::size_t k = 0; k < i; ++k) {
        if (line[k] == line[i] || !continues(pieces_[k], pieces_[i])) continue;
        const std::size_t from = line[i], to = line[k];
        std::replace(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(i + 1), from, to);
      }
    }
    std::vector<std::size_t> seen;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      auto found = std::find(seen.begin(), seen.end(), line[i]);
      pieces_[i].line = static_cast<std::size_t>(found - seen.begin());
      if (found == seen.end()) seen.push_back(line[i]);
    }
    // Along the direction of each line's first piece.
    std::vector<Piece> first(seen.size());
    for (std::size_t i = pieces_.size(); i-- > 0;) first[pieces_[i].line] = pieces_[i].piece;
    std::sort(pieces_.begin(), pieces_.end(), [&](const Known& a, const Known& b) {
      if (a.line != b.line) return a.line < b.line;
      return offset(first[a.line], a.piece.centre)[0] < offset(first[b.line], b.piece.centre)[0];
    });
  }

  void find_centre() {
    if (pieces_.empty()) return;
    Vec3 low = pieces_[0].point_m, high = low;
    for (const Known& known : pieces_) {
      low = low.cwiseMin(known.point_m);
      high = high.cwiseMax(known.point_m);
    }
    centre_m_ = 0.5 * (low + high);
  }

  const RenderedView& view_;
  CameraDescription like_;
  std::vector<Known> pieces_;
  Vec3 centre_m_ = Vec3::Zero();
};

}  // namespace

std::unique_ptr<EdgeSource> edges_of_picture(const RenderedView& view,
                                             const CameraDescription& like) {
  return std::make_unique<OfPicture>(view, like);
}

}  // namespace truebox
