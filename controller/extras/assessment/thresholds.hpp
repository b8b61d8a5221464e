// Thresholds of contact force and of vibration for a person, read from a file that names its sources.
//
//   source: "…"                    # standard, year, table, and where it was read; printed with each figure
//   regions:
//     - {name: hands and fingers, stiffness_N_per_mm: 75, quasi_static_N: 140, transient_N: 280}
//   vibration:                     # optional
//     source: "…"
//     points:                      # 2 to 100, by frequency
//       - {frequency_Hz: 10, amplitude_um: 3}
//
// A region is judged by trials with a body of the region's stiffness. Pressures aren't judged: they depend on the
// shapes of the arm's parts, which a cell file doesn't have.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::assessment {

struct Region {
  std::string name;
  double stiffness_N_per_m = 0.0;
  double transient_N = 0.0;     // threshold for the first half second of a contact
  double quasi_static_N = 0.0;  // threshold after the first half second
};

// The amplitudes from which on a hand notices a vibration of what it grasps.
struct VibrationThreshold {
  struct Point {
    double frequency_Hz = 0.0;
    double amplitude_m = 0.0;  // half of the peak-to-peak amplitude
  };
  std::string source;
  std::vector<Point> points;  // at least two, by ascending frequency

  // Returns the amplitude, interpolated between the points on two logarithmic axes; nullopt beyond the points.
  [[nodiscard]] std::optional<double> amplitude_m(double frequency_Hz) const;
};

struct Thresholds {
  std::filesystem::path file;
  std::string source;
  std::vector<Region> regions;
  std::optional<VibrationThreshold> vibration = std::nullopt;
};

// A contact counts as quasi-static from this time after its beginning on, s.
inline constexpr double quasi_static_from_s = 0.5;

// Throws SetupError, which names the file, the line and the key.
Thresholds load_thresholds(const std::filesystem::path& file);

}  // namespace proxarm::assessment
