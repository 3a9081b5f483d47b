// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>
#include <filesystem>

#include "commands.h"
#include "radiometry/input_error.h"

namespace truebox::app {

std::string reference_directory() {
  namespace fs = std::filesystem;
  if (const char* chosen = std::getenv("TRUEBOX_REFERENCE")) {
    if (!fs::is_directory(chosen))
      throw InputError("$TRUEBOX_REFERENCE", 0, "a folder of reference data", chosen);
    return chosen;
  }
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path installed = program.parent_path().parent_path() / "share/truebox/reference";
  for (const fs::path& folder : {installed, fs::path(TRUEBOX_CHECKOUT_REFERENCE)})
    if (fs::is_directory(folder / "colour")) return folder.string();
  throw InputError(installed.string(), 0, "the shipped reference data (or $TRUEBOX_REFERENCE)",
                   "no such folder");
}

}  // namespace truebox::app
