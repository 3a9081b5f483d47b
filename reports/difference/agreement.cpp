// SPDX-License-Identifier: BSD-3-Clause
#include "difference/agreement.h"

#include <stdexcept>

namespace truebox {

std::string to_text(Agreement agreement) {
  switch (agreement) {
    case Agreement::agrees: return "agrees";
    case Agreement::warning: return "warning";
    case Agreement::fails: return "fails";
    case Agreement::not_run: break;
  }
  return "not run";
}

Agreement agreement_from_text(const std::string& text) {
  for (Agreement a : {Agreement::agrees, Agreement::warning, Agreement::fails, Agreement::not_run})
    if (to_text(a) == text) return a;
  throw std::invalid_argument("no agreement is called '" + text + "'");
}

}  // namespace truebox
