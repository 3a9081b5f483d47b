// SPDX-License-Identifier: BSD-3-Clause
// An ImageSet as JSON: in report.json and, the same text, in the page. Internal to this folder.
#pragma once

#include <string>

#include "document/image_set.h"

namespace truebox::detail {

/// Everything, `packed` as base64.
std::string image_set_text(const ImageSet& set);

/// The inverse. Throws std::invalid_argument (or nlohmann's exceptions) on anything malformed and
/// on whatever `image_set_objection` says.
ImageSet image_set_from_text(const std::string& text);

}  // namespace truebox::detail
