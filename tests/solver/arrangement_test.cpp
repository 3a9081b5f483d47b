// SPDX-License-Identifier: BSD-3-Clause
#include "discontinuity/arrangement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "discontinuity/line_selection.h"

namespace truebox {
namespace {

constexpr double kSnap = 0x1p-24;
constexpr double kAreaRounding = 1e-12;
const PlanePolygon kSquare = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

double area(const PlanePolygon& p) {
  double twice = 0.0;
  for (std::size_t k = 2; k < p.size(); ++k) twice += cross(p[k - 1] - p[0], p[k] - p[0]);
  return 0.5 * twice;
}

double total_area(const std::vector<PlanePolygon>& cells) {
  double sum = 0.0;
  for (const PlanePolygon& cell : cells) sum += area(cell);
  return sum;
}

// How far a segment runs inside a convex cell, further than `margin` from its edges.
double length_inside(const PlaneSegment& s, const PlanePolygon& cell, double margin) {
  double t0 = 0.0, t1 = 1.0;
  for (std::size_t k = 0; k < cell.size(); ++k) {
    const Vec2 along = (cell[(k + 1) % cell.size()] - cell[k]).normalized();
    const double a = cross(along, s.from - cell[k]) - margin;
    const double b = cross(along, s.to - cell[k]) - margin;
    if (a <= 0.0 && b <= 0.0) return 0.0;
    if (a < 0.0) t0 = std::max(t0, a / (a - b));
    if (b < 0.0) t1 = std::min(t1, a / (a - b));
  }
  return std::max(0.0, t1 - t0) * s.length_m();
}

void expect_cells_respect(const std::vector<PlanePolygon>& cells,
                          const std::vector<PlaneSegment>& segments, const PlanePolygon& outline) {
  EXPECT_NEAR(total_area(cells), area(outline), kAreaRounding);
  for (const PlanePolygon& cell : cells) {
    ASSERT_TRUE(cell.size() == 3 || cell.size() == 4);
    for (std::size_t k = 0; k < cell.size(); ++k) {
      const Vec2 &a = cell[k], &b = cell[(k + 1) % cell.size()], &c = cell[(k + 2) % cell.size()];
      EXPECT_GT(cross(b - a, c - b), 0.0) << "not convex";
    }
    for (const PlaneSegment& s : segments) EXPECT_EQ(length_inside(s, cell, 8.0 * kSnap), 0.0);
  }
}

TEST(CellsBetweenLines, KeepAPlainQuadWhole) {
  const auto cells = cells_between_lines(kSquare, {}, kSnap);
  ASSERT_EQ(cells.size(), 1u);
  EXPECT_EQ(area(cells[0]), 1.0);
}

TEST(CellsBetweenLines, ALineThroughTwoCornersMakesTwoTriangles) {
  const std::vector<PlaneSegment> diagonal = {{{0, 0}, {1, 1}}};
  const auto cells = cells_between_lines(kSquare, diagonal, kSnap);
  ASSERT_EQ(cells.size(), 2u);
  expect_cells_respect(cells, diagonal, kSquare);
}

TEST(CellsBetweenLines, TheSameLineTwiceCountsOnce) {
  const std::vector<PlaneSegment> once = {{{0.3, 0}, {0.4, 1}}};
  const std::vector<PlaneSegment> twice = {
      once[0], {{0.4, 1}, {0.3, 0}}, {{0.32, 0.2}, {0.38, 0.8}}};
  EXPECT_EQ(cells_between_lines(kSquare, twice, kSnap).size(),
            cells_between_lines(kSquare, once, kSnap).size());
}

TEST(CellsBetweenLines, AnIslandIsCutOutOfItsSurroundings) {
  const PlanePolygon block = {{0.31, 0.37}, {0.62, 0.28}, {0.7, 0.6}, {0.4, 0.66}};
  std::vector<PlaneSegment> outline;
  for (std::size_t k = 0; k < 4; ++k) outline.push_back({block[k], block[(k + 1) % 4]});
  const auto cells = cells_between_lines(kSquare, outline, kSnap);
  expect_cells_respect(cells, outline, kSquare);
  EXPECT_GT(cells.size(), 4u);
}

TEST(SelectedLines, ALineBesideAStrongerOneIsLeftOut) {
  const auto selected =
      selected_lines(kSquare, {{{{0.52, 0}, {0.52, 1}}, 1.0}, {{{0.5, 0}, {0.5, 1}}, 2.0}}, 0.1);
  ASSERT_EQ(selected.size(), 1u);
  EXPECT_EQ(selected[0].from.x(), 0.5);
}

TEST(SelectedLines, TwoLinesThatPartKeepTheirPartsThatAreApart) {
  const auto selected =
      selected_lines(kSquare, {{{{0, 0.5}, {1, 0.5}}, 2.0}, {{{0, 0.5}, {1, 0.8}}, 1.0}}, 0.1);
  ASSERT_GE(selected.size(), 2u);
  // 0.1 apart at 0.1 / sin(16.7 degrees) = 0.35 from the common point; samples every 0.035.
  EXPECT_NEAR((selected[1].from - Vec2(0, 0.5)).norm(), 0.35, 0.04);
}

TEST(SelectedLines, ALineThatEndsInsideGoesOnToTheNext) {
  const auto selected =
      selected_lines(kSquare, {{{{0.7, 0}, {0.7, 1}}, 2.0}, {{{0.2, 0.5}, {0.4, 0.5}}, 1.0}}, 0.05);
  ASSERT_EQ(selected.size(), 2u);
  EXPECT_NEAR(selected[1].from.x(), 0.0, 1e-12);
  EXPECT_NEAR(selected[1].to.x(), 0.7, 1e-12);
}

TEST(SelectedLines, LinesThatTouchTheOutlineOnlyAreLeftOut) {
  EXPECT_TRUE(
      selected_lines(kSquare, {{{{0, 0}, {1, 0}}, 1.0}, {{{-1, 1}, {1, -1}}, 1.0}}, 0.1).empty());
}

// Lines from anywhere to anywhere, some through corners, some twice, on polygons of 3 to 6 corners.
TEST(CellsBetweenLines, CoverExactlyAndRespectRandomLines) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> at(-0.2, 1.2);
  for (int time = 0; time < 150; ++time) {
    const std::size_t n = 3 + random() % 4;
    PlanePolygon outline;
    for (std::size_t k = 0; k < n; ++k) {
      const double angle_rad =
          2.0 * M_PI * (static_cast<double>(k) + 0.3 * at(random)) / static_cast<double>(n);
      outline.push_back({0.5 + 0.5 * std::cos(angle_rad), 0.5 + 0.5 * std::sin(angle_rad)});
    }
    std::vector<RankedLine> lines;
    for (std::size_t k = 0, count = random() % 25; k < count; ++k) {
      const Vec2 from = random() % 4 == 0 ? outline[random() % n] : Vec2(at(random), at(random));
      lines.push_back({{from, {at(random), at(random)}}, at(random), random() % 8 == 0});
      if (random() % 5 == 0) lines.push_back(lines.back());
    }
    SCOPED_TRACE(time);
    const auto segments = selected_lines(outline, lines, 0.05);
    expect_cells_respect(cells_between_lines(outline, segments, kSnap), segments, outline);
  }
}

}  // namespace
}  // namespace truebox
