// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace truebox {

/// A measured or fitted value with its standard uncertainty (coverage factor k = 1), both in the
/// unit of the quantity. Source: JCGM 100:2008 (GUM), 2.3.1.
struct Estimate {
  double value = 0.0;
  double standard_uncertainty = 0.0;
};

}  // namespace truebox
