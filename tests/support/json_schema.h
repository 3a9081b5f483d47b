// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

#include "support/scratch.h"

namespace truebox {

/// Debian's python3-jsonschema judges by the published schema; it is no code of ours.
inline bool has_schema_validator() {
  static const bool found = std::system("/usr/bin/python3 -c 'import jsonschema' 2>/dev/null") == 0;
  return found;
}

/// What `schema` (a file name in reports/document) has against a JSON text, or nothing.
inline std::optional<std::string> schema_objection(const std::string& schema,
                                                   const std::string& json) {
  static int count = 0;
  const std::string path = scratch_path("instance" + std::to_string(count++) + ".json");
  std::ofstream(path, std::ios::binary) << json;
  const std::string command =
      "/usr/bin/python3 -c \"import json, sys, jsonschema\n"
      "schema = json.load(open(sys.argv[1]))\n"
      "jsonschema.Draft202012Validator.check_schema(schema)\n"
      "e = jsonschema.exceptions.best_match(jsonschema.Draft202012Validator(schema)"
      ".iter_errors(json.load(open(sys.argv[2]))))\n"
      "print(e.json_path + ': ' + e.message[:300] if e else '', end='')\" '" TRUEBOX_SOURCE_DIR
      "/reports/document/" +
      schema + "' '" + path + "' 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  char buffer[1024];
  for (std::size_t n; pipe && (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;)
    text.append(buffer, n);
  if (!pipe || pclose(pipe) != 0) return "the validator failed: " + text;
  if (text.empty()) return std::nullopt;
  return text;
}

}  // namespace truebox
