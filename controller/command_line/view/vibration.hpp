// Compares the handle's vibration with what a hand notices, as JSON for the page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "controller/assessment/thresholds.hpp"
#include "controller/signals/handle_spectrum.hpp"

namespace proxarm::command_line {

// Returns the threshold of models/thresholds/hands.yaml. Throws SetupError.
assessment::VibrationThreshold vibration_threshold();

// {"source": TEXT, "points": [[Hz, µm], …]}, sent once.
nlohmann::json threshold_json(const assessment::VibrationThreshold& threshold);

// {"of": "steel" or "encoders", "bands": [{centre_Hz, amplitude_um, frequency_Hz, threshold_um}, …]}; `threshold_um` is
// null for a band outside the threshold's points.
nlohmann::json spectrum_json(const std::vector<controller::HandleSpectrum::Band>& bands, bool of_truth,
                             const assessment::VibrationThreshold& threshold);

}  // namespace proxarm::command_line
