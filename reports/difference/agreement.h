// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace truebox {

/// What a comparison came to. The order is the severity: the worst of several checks is their
/// maximum, except that a check that has not run proves nothing and counts as a failure.
enum class Agreement { agrees, warning, fails, not_run };

/// "agrees", "warning", "fails", "not run".
std::string to_text(Agreement agreement);

/// The inverse of `to_text`. Throws std::invalid_argument on any other text.
Agreement agreement_from_text(const std::string& text);

inline Agreement worse(Agreement a, Agreement b) { return a < b ? b : a; }

}  // namespace truebox
