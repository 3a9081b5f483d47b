// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "hierarchy/group_basis.h"
#include "transport/found_exchange.h"

namespace truebox {

struct HierarchyOptions {
  /// Root mean square over the area of what all links together leave out of the irradiance,
  /// relative to its mean, worst band: an aim, met as far as the elements allow.
  double relative_tolerance = 1e-2;
  std::size_t memory_limit_bytes = std::size_t{4} << 30;
  int most_degree = kMaxLinkDegree;  ///< of the kernel between flat groups; 0: constants alone

  std::string invalid() const;  ///< why these options cannot be used; empty if they can
};

/// Memory that so many elements take with their tree, points and links, bytes; measured, at most
/// three times too much. Links are taken to grow like 1 / tolerance.
std::size_t estimated_bytes(std::size_t elements, const HierarchyOptions& options);

/// std::length_error that says what would fit, if the estimate exceeds the memory limit.
void require_memory(std::size_t elements, const HierarchyOptions& options);

/// Exchange by links between groups of elements (hierarchical radiosity). Links of a coarse
/// tolerance and a solution with them come first; the second links know where the light is, and
/// their tolerance is chosen from what the first left out: the change of the solution says how much
/// their estimate is worth. In a closed scene rows are scaled to sum to 1; the summary says by how
/// much. std::invalid_argument if options.invalid(); std::length_error if links exceed the limit.
FindExchange hierarchical_exchange(const HierarchyOptions& options);

}  // namespace truebox
