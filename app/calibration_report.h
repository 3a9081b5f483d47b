// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "document/report.h"
#include "photometry/photometric_calibration.h"

namespace truebox::app {

/// The photograph in grey (up to its 99th percentile) with what is no measurement in colour:
/// saturated red, below the floor blue, hot yellow, dead or stuck magenta, masked or not finite
/// green. 3 x width x height bytes.
std::vector<std::uint8_t> flag_overlay(const LinearPhotograph& photograph);

/// Every number of a calibration, as JSON text. `files`: the photographs' names, in their order.
std::string calibration_json(const PhotometricCalibration& calibration,
                             const std::vector<std::string>& files);

/// Checks, noise, budget, pictures: what a person needs to judge a calibration.
Report calibration_report(const PhotometricCalibration& calibration);

}  // namespace truebox::app
