// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "radiometry/observer.h"

namespace truebox {

/// Intensity and two colour differences of a display's light (dimensionless).
struct Ictcp {
  double I = 0.0, Ct = 0.0, Cp = 0.0;
};

/// ICtCp of linear BT.2020 light in cd m^-2, through the PQ curve; negative cone signals count as
/// none. Source: ITU-R BT.2100-2 (2018), tables 4 and 7.
Ictcp ictcp(const LinearRgb& bt2020_cd_m2);

/// Linear BT.709 to linear BT.2020, both D65. Source: ITU-R BT.2087-0 (2015), M2.
LinearRgb bt2020_from_bt709(const LinearRgb& bt709);

/// dE_ITP = 720 sqrt(dI^2 + (dCt / 2)^2 + dCp^2); 1 is just visible where an eye is most critical.
/// Holds for lights of a display at any level, not only for surface colours.
/// Source: ITU-R BT.2124-0 (2019), annex 1.
double delta_e_itp(const Ictcp& first, const Ictcp& second);

}  // namespace truebox
