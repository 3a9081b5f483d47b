// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "transport/element_tree.h"
#include "transport/exchange_operator.h"

namespace truebox {

/// How the links of a hierarchical exchange came out.
struct LinkSummary {
  std::size_t elements = 0, links = 0;  ///< a link counts once, for both directions
  std::size_t tried = 0;                ///< pairs of groups looked at
  std::size_t hidden = 0;               ///< of these, closed by a single blocker
  std::size_t bytes = 0;                ///< tree and links
  double processor_s = 0.0;             ///< all threads
  double relative_tolerance = 0.0;      ///< as asked for
  /// Root mean square over the area of what the links leave out of the irradiance, relative to its
  /// mean; worst band. From the kernel's spread in each link, summed as if independent.
  double relative_error = 0.0;
};

/// Exchange areas of a mesh, and which of its elements are not buried.
struct FoundExchange {
  std::unique_ptr<ExchangeOperator> exchange;
  std::vector<char> usable;
  FormFactorSummary summary;
  std::optional<LinkSummary> links;
};

/// What a method that is not the full matrix is told.
struct ExchangeRequest {
  const PatchMesh& mesh;
  const Scene& scene;
  const Visibility& visibility;
  const ShaftCulling& culling;
  const BandMatrix& rho;
  const BandMatrix& source;  ///< elements x bands, W m^-2 nm^-1
  const FormFactorOptions& options;
};
using FindExchange = std::function<FoundExchange(const ExchangeRequest&)>;

}  // namespace truebox
