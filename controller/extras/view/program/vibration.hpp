// Compares the handle's vibration with the threshold at which a hand notices vibration, as JSON for the page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "controller/extras/assessment/thresholds.hpp"
#include "controller/signals/handle_spectrum.hpp"

namespace proxarm::command_line {

// Reads the threshold from models/thresholds/hands.yaml. Throws SetupError.
assessment::VibrationThreshold vibration_threshold();

// Returns {"source": TEXT, "points": [[Hz, µm], …]}, which the page gets once.
nlohmann::json threshold_json(const assessment::VibrationThreshold& threshold);

// Returns {"of": "steel" or "encoders", "bands": [{centre_Hz, amplitude_um, frequency_Hz, threshold_um}, …]}.
// `of_truth`: the spectrum is of the true motion ("steel"). threshold_um is null for a band outside the threshold's
// points.
nlohmann::json spectrum_json(const std::vector<controller::HandleSpectrum::Band>& bands, bool of_truth,
                             const assessment::VibrationThreshold& threshold);

}  // namespace proxarm::command_line
