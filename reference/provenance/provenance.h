// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "radiometry/table_file.h"

namespace truebox {

/// What a number from outside is used for. A value that entered a fit never validates that fit.
enum class Use { input, held_out };

/// Where a number comes from: without it a reference is an opinion.
struct Provenance {
  std::string source;       ///< who measured or published it, and where it can be found
  std::string licence;      ///< empty where the values are facts
  std::string unit;         ///< "1", "W m^-2 nm^-1", ...
  std::string uncertainty;  ///< as the source states it, in words
  Use use = Use::held_out;
};

/// A reference value with its provenance.
template <class T>
struct Certified {
  T value;
  Provenance provenance;
};

/// Reads `# source:`, `# unit:`, `# uncertainty:` (all required) and `# licence:` from a table's
/// header. InputError names what is missing: a file without a source is not a reference.
Provenance require_provenance(const TableFile& table, Use use = Use::held_out);

/// "input" or "held out", as reports print it.
std::string to_string(Use use);

}  // namespace truebox
