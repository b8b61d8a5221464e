// The handle's vibration beside what a hand notices, as the page is told it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "controller/assessment/thresholds.hpp"
#include "controller/signals/handle_spectrum.hpp"

namespace proxarm::command_line {

// That of models/thresholds/hands.yaml. Throws SetupError.
assessment::VibrationThreshold vibration_threshold();

// {"source": TEXT, "points": [[Hz, µm], …]}, told once.
nlohmann::json threshold_json(const assessment::VibrationThreshold& threshold);

// {"of": "steel" or "encoders", "bands": [{centre_Hz, amplitude_um, frequency_Hz, threshold_um}, …]}; of a band beyond
// the threshold's points `threshold_um` is null.
nlohmann::json spectrum_json(const std::vector<controller::HandleSpectrum::Band>& bands, bool of_truth,
                             const assessment::VibrationThreshold& threshold);

}  // namespace proxarm::command_line
