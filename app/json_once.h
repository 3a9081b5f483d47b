// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// JSON's functions are compiled once, in json_once.cpp, instead of in every command: a third of the
// compile time of this folder. It is part of the precompiled header.
#include <nlohmann/json.hpp>

extern template class nlohmann::basic_json<>;
