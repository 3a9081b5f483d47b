// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace truebox {

/// Two numbers in (0, 1).
struct UnitPair {
  double u = 0.5, v = 0.5;
};

/// Point `index` of the first two Sobol' dimensions, shuffled and Owen-scrambled by `seed`. For one
/// seed any 2^k points from a multiple of 2^k fill every elementary interval of area 2^-k once;
/// over random seeds each point is uniform, so that a mean of f is unbiased and its variance falls
/// faster than 1/n where f is smooth. Different seeds stand for independent randomisations.
/// Sources: Sobol' (1967); Owen (1995); hashed scrambling, Burley (2020), JCGT 9(4).
UnitPair owen_sobol_pair(std::uint32_t index, std::uint32_t seed);

/// 64 well-mixed bits of two numbers (finaliser of SplitMix64, Steele, Lea & Flood 2014).
std::uint64_t mixed(std::uint64_t a, std::uint64_t b);

/// The numbers of one path: a pair a decision, all from point `index` of their own sequences.
class PathNumbers {
 public:
  PathNumbers(std::uint64_t seed, std::uint32_t index) : seed_(seed), index_(index) {}
  UnitPair next() {
    return owen_sobol_pair(index_, static_cast<std::uint32_t>(mixed(seed_, dimension_++)));
  }

 private:
  std::uint64_t seed_, dimension_ = 0;
  std::uint32_t index_;
};

}  // namespace truebox
