// SPDX-License-Identifier: BSD-3-Clause
#include "transport/solve_radiosity.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "support/direct_solution.h"
#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using Eigen::Index;

enum class Room { cube, block, micrometre, megametre, coupled };

struct Case {
  SolveMethod method;
  Room room;
};

std::string name_of(const Case& c) {
  const char* rooms[] = {"cube", "block", "micrometre", "megametre", "weakly_coupled_rooms"};
  std::string name = method_name(c.method) + "_" + rooms[static_cast<int>(c.room)];
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// Eigen's Krylov methods stop where rounding stops their recurrence, an order above the others.
double tightest(SolveMethod method) {
  return method == SolveMethod::gmres || method == SolveMethod::bicgstab ? 1e-11 : 1e-12;
}

// Two cubes whose only link is a thousandth of a wall's exchange: S is nearly block diagonal.
FormFactors coupled_rooms(const FormFactors& one) {
  const Index n = one.size();
  FormFactors two;
  two.exchange_area_m2 = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  two.exchange_area_m2.topLeftCorner(n, n) = one.exchange_area_m2;
  two.exchange_area_m2.bottomRightCorner(n, n) = one.exchange_area_m2;
  two.area_m2.resize(2 * n);
  two.area_m2 << one.area_m2, one.area_m2;
  // A pinhole in the pair (0, n - 1) of each: what it took there goes to the other room.
  const double hole = 1e-3 * one.exchange_area_m2(0, n - 1);
  for (Index base : {Index{0}, n}) {
    two.exchange_area_m2(base, base + n - 1) -= hole;
    two.exchange_area_m2(base + n - 1, base) -= hole;
    two.exchange_area_m2(base, (base + n) % (2 * n) + n - 1) += hole;
    two.exchange_area_m2((base + n) % (2 * n) + n - 1, base) += hole;
  }
  two.usable.assign(static_cast<std::size_t>(2 * n), 1);
  two.summary = one.summary;
  return two;
}

FormFactors factors_of(Room room) {
  const double edge = room == Room::micrometre ? 1e-6 : room == Room::megametre ? 1e6 : 1.0;
  const Scene scene =
      room == Room::block ? tiny::cube_with_block(edge, 0.5) : tiny::cube(edge, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 0.25 * edge);
  FormFactorOptions options;
  options.relative_tolerance = 1e-13;
  options.occlusion = room == Room::block;
  FormFactors f = form_factors(mesh, scene, Visibility(mesh, scene), options);
  return room == Room::coupled ? coupled_rooms(f) : f;
}

class SolveRadiosity : public testing::TestWithParam<Case> {
 protected:
  const FormFactors f_ = factors_of(GetParam().room);
  const Index n_ = f_.size();

  SolveOptions options() const { return options(tightest(GetParam().method)); }
  SolveOptions options(double bound) const {
    SolveOptions o;
    o.method = GetParam().method;
    o.relative_bound = bound;
    o.iteration_limit = 2000000;
    return o;
  }
  BandMatrix constant(double value) const { return BandMatrix::Constant(n_, 1, value); }

  // Four bands: rho and emission drawn at random, emission on a fifth of the elements.
  void draw(BandMatrix& rho, BandMatrix& source, unsigned seed) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    rho.resize(n_, 4);
    source = BandMatrix::Zero(n_, 4);
    for (Index i = 0; i < n_; ++i)
      for (Index k = 0; k < 4; ++k) {
        rho(i, k) = uniform(random) < 0.1 ? 0.0 : 0.9 * uniform(random);
        if (uniform(random) < 0.2) source(i, k) = uniform(random);
      }
  }
};

TEST_P(SolveRadiosity, ReproducesFurnaceClosedForm) {
  // rho = 1/2, E = 1 everywhere, closed: B = 2 (buried elements keep B = 1).
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, constant(0.5), constant(1.0), options(), b);
  ASSERT_EQ(summary.outcome, SolveOutcome::converged) << summary.brief();
  const double closure =
      std::max(std::abs(f_.summary.row_sum_max - 1.0), f_.summary.closure_residual_max);
  for (Index i = 0; i < n_; ++i)
    EXPECT_NEAR(b(i, 0), f_.usable[static_cast<std::size_t>(i)] ? 2.0 : 1.0,
                summary.error_bound[0] + 2.0 * (closure + 1e-14));
}

TEST_P(SolveRadiosity, BalancesEnergy) {
  // Emitted = absorbed + lost through what does not close.
  BandMatrix rho, source, b;
  draw(rho, source, 51);
  ASSERT_EQ(solve_radiosity(f_, rho, source, options(), b).outcome, SolveOutcome::converged);
  for (Index k = 0; k < 4; ++k) {
    const Eigen::VectorXd incident = f_.exchange_area_m2 * b.col(k);  // W
    const double emitted = f_.area_m2.dot(source.col(k));
    const double absorbed = (Eigen::VectorXd::Ones(n_) - rho.col(k)).dot(incident);
    const double escaped = f_.area_m2.dot(b.col(k)) - incident.sum();
    EXPECT_NEAR((absorbed + escaped) / emitted, 1.0, 1e-10);
  }
}

TEST_P(SolveRadiosity, AgreesWithTheDirectSolutionWithinItsBound) {
  BandMatrix rho, source, b;
  draw(rho, source, 52);
  const BandMatrix truth = direct_solution(f_, rho, source);
  for (double bound : {1e-2, 1e-5, 1e-9, tightest(GetParam().method)}) {
    const SolveSummary summary = solve_radiosity(f_, rho, source, options(bound), b);
    ASSERT_EQ(summary.outcome, SolveOutcome::converged);
    for (Index k = 0; k < 4; ++k) {
      const double error = (b.col(k) - truth.col(k)).cwiseAbs().maxCoeff();
      // LU's own rounding: cond (1 + rho)/(1 - rho) < 20 times 2e-16 times B of order 1.
      EXPECT_LE(error, summary.error_bound[k] + 1e-14) << bound;
      EXPECT_LE(summary.error_bound[k], bound * b.col(k).maxCoeff() * (1 + 1e-12));
    }
  }
}

TEST_P(SolveRadiosity, LeavesBlackElementsTheirEmission) {
  BandMatrix rho, source, b;
  draw(rho, source, 53);
  solve_radiosity(f_, rho, source, options(), b);
  for (Index i = 0; i < n_; ++i)
    for (Index k = 0; k < 4; ++k)
      if (rho(i, k) == 0.0) {
        EXPECT_EQ(b(i, k), source(i, k));
      }
}

TEST_P(SolveRadiosity, BlackRoomSendsItsEmission) {
  BandMatrix rho, source, b;
  draw(rho, source, 54);
  rho.setZero();
  EXPECT_EQ(solve_radiosity(f_, rho, source, options(), b).outcome, SolveOutcome::converged);
  EXPECT_EQ((b - source).cwiseAbs().maxCoeff(), 0.0);
}

TEST_P(SolveRadiosity, NoLightIsDark) {
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, constant(0.5), constant(0.0), options(), b);
  EXPECT_EQ(summary.outcome, SolveOutcome::converged);
  EXPECT_EQ(b.cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(summary.error_bound[0], 0.0);
}

TEST_P(SolveRadiosity, BandsOfTwelveDecadesAreEquallyGood) {
  BandMatrix rho = BandMatrix::Constant(n_, 3, 0.7), source = BandMatrix::Zero(n_, 3), b;
  source.row(0) << 1e-12, 1.0, 1e12;
  ASSERT_EQ(solve_radiosity(f_, rho, source, options(1e-10), b).outcome, SolveOutcome::converged);
  for (Index i = 0; i < n_; ++i) {
    if (b(i, 1) == 0.0) continue;
    // Each band holds 1e-10 of its largest value, B = 1 at the source.
    EXPECT_NEAR(b(i, 0) * 1e12, b(i, 1), 3e-10);
    EXPECT_NEAR(b(i, 2) * 1e-12, b(i, 1), 3e-10);
  }
}

TEST_P(SolveRadiosity, SaysWhenItRunsOutOfIterations) {
  if (GetParam().method == SolveMethod::direct) GTEST_SKIP() << "a factorisation does not iterate";
  BandMatrix rho, source, b;
  draw(rho, source, 55);
  SolveOptions few = options();
  few.iteration_limit = 2;
  const SolveSummary summary = solve_radiosity(f_, rho, source, few, b);
  EXPECT_EQ(summary.outcome, SolveOutcome::iteration_limit);
  EXPECT_GE(summary.matrix_passes, 2.0);
  // A check of the bound more, and for shooting the shots up to it.
  EXPECT_LE(summary.matrix_passes, 4.0 + 2.0 * (GetParam().method == SolveMethod::bicgstab));
  // The bound holds all the same.
  const BandMatrix truth = direct_solution(f_, rho, source);
  for (Index k = 0; k < 4; ++k)
    EXPECT_LE((b.col(k) - truth.col(k)).cwiseAbs().maxCoeff(), summary.error_bound[k]);
}

TEST_P(SolveRadiosity, SaysWhenTheInputIsNoNumber) {
  BandMatrix source = constant(1.0), b;
  source(3, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solve_radiosity(f_, constant(0.5), source, options(), b).outcome,
            SolveOutcome::diverged);
}

TEST_P(SolveRadiosity, RefusesImpossibleOptions) {
  BandMatrix b;
  for (double bound : {0.0, 1.0, -1e-3, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_NE(options(bound).invalid(), "");
    EXPECT_THROW(solve_radiosity(f_, constant(0.5), constant(1.0), options(bound), b),
                 std::invalid_argument);
  }
  SolveOptions none = options();
  none.iteration_limit = 0;
  EXPECT_NE(none.invalid(), "");
  EXPECT_EQ(options().invalid(), "");
}

TEST_P(SolveRadiosity, RefusesToCreateEnergy) {
  BandMatrix b;
  for (double rho : {1.0, 1.02, -0.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(solve_radiosity(f_, constant(rho), constant(1.0), options(), b),
                 std::invalid_argument);
}

TEST_P(SolveRadiosity, ReturnsTheIrradianceOfItsAnswer) {
  BandMatrix rho, source, b, irradiance;
  draw(rho, source, 56);
  const SolveSummary summary = solve_radiosity(f_, rho, source, options(1e-6), b, {}, &irradiance);
  ASSERT_EQ(summary.outcome, SolveOutcome::converged);
  const BandMatrix exact = direct_solution(f_, rho, source);
  for (Index k = 0; k < 4; ++k) {
    const Eigen::VectorXd truth = (f_.exchange_area_m2 * exact.col(k)).cwiseQuotient(f_.area_m2);
    EXPECT_LE((irradiance.col(k) - truth).cwiseAbs().maxCoeff(),
              summary.error_bound[k] * std::max(1.0, f_.summary.row_sum_max) + 1e-14);
  }
}

TEST_P(SolveRadiosity, TellsOfItsProgressAndEndsWithItsAnswer) {
  BandMatrix rho, source, b;
  draw(rho, source, 57);
  double last = 0.0, first_error = 0.0, last_error = 0.0;
  int told = 0;
  const BandMatrix truth = direct_solution(f_, rho, source);
  SolveOptions watched = options(1e-8);
  watched.on_progress = [&](double passes, const BandMatrix& so_far) {
    EXPECT_GE(passes, last);
    last = passes;
    last_error = (so_far - truth).norm();
    if (told++ == 0) first_error = last_error;
  };
  ASSERT_EQ(solve_radiosity(f_, rho, source, watched, b).outcome, SolveOutcome::converged);
  EXPECT_GE(told, 1);
  EXPECT_LE(last_error, 1e-6 * truth.norm());
  if (told > 1) {
    EXPECT_LT(last_error, first_error);
  }
}

const SolveMethod kMethods[] = {SolveMethod::conjugate_gradient,
                                SolveMethod::gauss_seidel,
                                SolveMethod::jacobi,
                                SolveMethod::southwell,
                                SolveMethod::southwell_ambient,
                                SolveMethod::gmres,
                                SolveMethod::bicgstab,
                                SolveMethod::direct};

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (SolveMethod method : kMethods)
    for (Room room : {Room::cube, Room::block, Room::micrometre, Room::megametre, Room::coupled})
      // Size changes every method alike; the two that differ most stand for all.
      if ((room != Room::micrometre && room != Room::megametre && room != Room::cube) ||
          method == SolveMethod::conjugate_gradient || method == SolveMethod::gauss_seidel)
        cases.push_back({method, room});
  return cases;
}

INSTANTIATE_TEST_SUITE_P(MethodAndRoom, SolveRadiosity, testing::ValuesIn(all_cases()),
                         [](const auto& c) { return name_of(c.param); });

TEST(SolveRadiosity, KrylovSolvesANearlyWhiteRoom) {
  constexpr double kRho = 0.999999, kBound = 1e-7;
  const FormFactors f = factors_of(Room::cube);
  const Index n = f.size();
  SolveOptions options;
  options.relative_bound = kBound;
  BandMatrix source = BandMatrix::Zero(n, 1), b;
  source(0, 0) = 1.0;
  const SolveSummary summary =
      solve_radiosity(f, BandMatrix::Constant(n, 1, kRho), source, options, b);
  ASSERT_EQ(summary.outcome, SolveOutcome::converged) << summary.brief();
  EXPECT_LT(summary.iterations, 100) << "the recurrence lost its way";
  const BandMatrix truth = direct_solution(f, BandMatrix::Constant(n, 1, kRho), source);
  // LU loses cond = 2e6 times 2e-16 of B, of order 1e4.
  EXPECT_LE((b - truth).cwiseAbs().maxCoeff(), summary.error_bound[0] + 1e-5);
  EXPECT_LE(summary.error_bound[0], kBound * b.maxCoeff());
}

TEST(SolveRadiosity, MethodsAgree) {
  const FormFactors f = factors_of(Room::block);
  const Index n = f.size();
  const BandMatrix rho = BandMatrix::Constant(n, 1, 0.8);
  BandMatrix source = BandMatrix::Zero(n, 1), first, other;
  source(5, 0) = 1.0;
  double first_bound = 0.0;
  for (const SolveMethod method : kMethods) {
    SolveOptions options;
    options.method = method;
    options.relative_bound = tightest(method);
    const double bound = solve_radiosity(f, rho, source, options, other).error_bound[0];
    if (first.size() == 0) {
      first = other;
      first_bound = bound;
    }
    EXPECT_LE((other - first).cwiseAbs().maxCoeff(), bound + first_bound) << method_name(method);
  }
}

TEST(SolveRadiosity, MethodsAreKnownByTheirNames) {
  EXPECT_EQ(method_names().size(), std::size(kMethods));
  for (const SolveMethod method : kMethods) EXPECT_EQ(method_of_name(method_name(method)), method);
  EXPECT_THROW(method_of_name("guess"), std::invalid_argument);
}

TEST(SolveRadiosity, RefusesToFactoriseWhatIsTooLarge) {
  FormFactors f;
  f.area_m2 = Eigen::VectorXd::Ones(4001);
  BandMatrix b;
  SolveOptions options;
  options.method = SolveMethod::direct;
  EXPECT_THROW(
      solve_radiosity(f, BandMatrix::Constant(4001, 1, 0.5), BandMatrix::Ones(4001, 1), options, b),
      std::length_error);
}

}  // namespace
}  // namespace truebox
