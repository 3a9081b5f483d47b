// SPDX-License-Identifier: BSD-3-Clause
#include "json_once.h"

template class nlohmann::basic_json<>;
