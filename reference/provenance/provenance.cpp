// SPDX-License-Identifier: BSD-3-Clause
#include "provenance/provenance.h"

#include "radiometry/input_error.h"

namespace truebox {
namespace {

std::string required(const TableFile& table, const std::string& key) {
  const auto entry = table.header.find(key);
  if (entry == table.header.end() || entry->second.empty())
    throw InputError(table.path, 0, "a header line \"# " + key + ": ...\"", "none");
  return entry->second;
}

}  // namespace

Provenance require_provenance(const TableFile& table, Use use) {
  Provenance provenance{.source = required(table, "source"),
                        .licence = {},
                        .unit = required(table, "unit"),
                        .uncertainty = required(table, "uncertainty"),
                        .use = use};
  if (const auto licence = table.header.find("licence"); licence != table.header.end())
    provenance.licence = licence->second;
  return provenance;
}

std::string to_string(Use use) { return use == Use::input ? "input" : "held out"; }

}  // namespace truebox
