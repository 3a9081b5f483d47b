// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "commands.h"

namespace truebox::app {

void add_sweep_command(CLI::App& program, Action& chosen);
void add_viewfactor_command(CLI::App& program, Action& chosen);

}  // namespace truebox::app
