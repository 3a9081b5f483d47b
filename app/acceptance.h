// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace truebox::app {

/// `accept` keeps its reasons beside a reference image: FILE.provenance.json (schema
/// acceptance.schema.json).
std::string acceptance_path(const std::string& reference);

/// The last reason, its time and whether the file is still the one accepted; empty if the file has
/// no such provenance. Throws InputError if it has one that cannot be read.
std::string acceptance_text(const std::string& reference);

}  // namespace truebox::app
