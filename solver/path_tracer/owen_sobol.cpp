// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/owen_sobol.h"

#include <utility>

namespace truebox {
namespace {

std::uint32_t reversed(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xFF00FF00u) >> 8) | ((x & 0x00FF00FFu) << 8);
  x = ((x & 0xF0F0F0F0u) >> 4) | ((x & 0x0F0F0F0Fu) << 4);
  x = ((x & 0xCCCCCCCCu) >> 2) | ((x & 0x33333333u) << 2);
  return ((x & 0xAAAAAAAAu) >> 1) | ((x & 0x55555555u) << 1);
}

// Each bit is flipped depending on those above it. The sum comes first and the rest are bijections
// that do not know the seed: over random seeds the outcome is exactly uniform.
std::uint32_t nested_scramble(std::uint32_t x, std::uint32_t seed) {
  x = reversed(x) + seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return reversed(x);
}

// Generator matrix of the second dimension: Pascal's triangle modulo 2, entry (k, j) is 1 where the
// bits of k are among those of j. So bit k gathers the bits j of the index that hold it.
std::uint32_t second_dimension(std::uint32_t x) {
  for (const auto& [shift, without] :
       {std::pair{1u, 0x55555555u}, std::pair{2u, 0x33333333u}, std::pair{4u, 0x0F0F0F0Fu},
        std::pair{8u, 0x00FF00FFu}, std::pair{16u, 0x0000FFFFu}})
    x ^= (x >> shift) & without;
  return reversed(x);
}

double unit(std::uint32_t x) { return (x + 0.5) * 0x1p-32; }

}  // namespace

std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
  std::uint64_t x = a + 0x9e3779b97f4a7c15ull * (b + 1);
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

UnitPair owen_sobol_pair(std::uint32_t index, std::uint32_t seed) {
  const std::uint32_t shuffled = nested_scramble(index, seed);
  const std::uint64_t seeds = mixed(seed, 1);
  return {
      unit(nested_scramble(reversed(shuffled), static_cast<std::uint32_t>(seeds))),
      unit(nested_scramble(second_dimension(shuffled), static_cast<std::uint32_t>(seeds >> 32)))};
}

}  // namespace truebox
