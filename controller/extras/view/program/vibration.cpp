#include "controller/extras/view/program/vibration.hpp"

#include <nlohmann/json.hpp>

#include "controller/preparation/data_files.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

using nlohmann::json;

namespace {
constexpr double um_per_m = 1e6;
}

assessment::VibrationThreshold vibration_threshold() {
  const std::filesystem::path file = controller::shipped_file("models/thresholds/hands.yaml");
  auto vibration = assessment::load_thresholds(file).vibration;
  if (vibration) return *vibration;
  throw description::SetupError({.file = file.string(),
                                 .key = "vibration",
                                 .found = "nothing",
                                 .expected = "the amplitudes from which on a hand notices a vibration"});
}

json threshold_json(const assessment::VibrationThreshold& threshold) {
  json points = json::array();
  for (const auto& point : threshold.points) points.push_back({point.frequency_Hz, um_per_m * point.amplitude_m});
  return {{"source", threshold.source}, {"points", points}};
}

json spectrum_json(const std::vector<controller::HandleSpectrum::Band>& bands, bool of_truth,
                   const assessment::VibrationThreshold& threshold) {
  json list = json::array();
  for (const auto& band : bands) {
    const auto noticed = threshold.amplitude_m(band.centre_Hz);
    list.push_back({{"centre_Hz", band.centre_Hz},
                    {"amplitude_um", um_per_m * band.amplitude_m},
                    {"frequency_Hz", band.frequency_Hz},
                    {"threshold_um", noticed ? json(um_per_m * *noticed) : json(nullptr)}});
  }
  return {{"of", of_truth ? "steel" : "encoders"}, {"bands", list}};
}

}  // namespace proxarm::command_line
