#include "controller/extras/assessment/thresholds.hpp"

#include <algorithm>
#include <cmath>

#include "models/files/yaml_file.hpp"

namespace proxarm::assessment {
namespace {

// Stiffnesses from softer than any tissue to harder than a skull. Forces from hardly felt to bone-breaking.
constexpr description::Range stiffness_range = description::between(1.0, 1000.0);
constexpr description::Range force_range = description::between(1.0, 10'000.0);
constexpr double per_mm = 1000.0;  // N/m in 1 N/mm
// Frequencies from slow swinging to those that are heard rather than felt. Amplitudes in µm from below any threshold to
// shaking the arm.
constexpr description::Range frequency_range = description::between(1.0, 2000.0);
constexpr description::Range amplitude_range = description::between(1e-4, 1e4);
constexpr double per_um = 1e-6;

Region read_region(const description::YamlNode& node) {
  Region region;
  region.name = node.string("name");
  region.stiffness_N_per_m = per_mm * node.number("stiffness_N_per_mm", stiffness_range);
  region.quasi_static_N = node.number("quasi_static_N", force_range);
  region.transient_N = node.number("transient_N", force_range);
  if (region.transient_N < region.quasi_static_N) {
    throw node.error_at("transient_N", "at least quasi_static_N: a short contact may be as hard as a long one");
  }
  return region;
}

VibrationThreshold read_vibration(const description::YamlNode& node) {
  VibrationThreshold read;
  read.source = node.string("source");
  for (const description::YamlNode& point : node.list("points", 2, 100)) {
    read.points.push_back(
        {point.number("frequency_Hz", frequency_range), per_um * point.number("amplitude_um", amplitude_range)});
    const std::size_t count = read.points.size();
    if (count > 1 && !(read.points[count - 1].frequency_Hz > read.points[count - 2].frequency_Hz)) {
      throw point.error_at("frequency_Hz", "more than that of the point before: points are sorted by frequency");
    }
  }
  return read;
}

}  // namespace

std::optional<double> VibrationThreshold::amplitude_m(double frequency_Hz) const {
  const auto above = std::find_if(points.begin(), points.end(),
                                  [frequency_Hz](const Point& point) { return point.frequency_Hz >= frequency_Hz; });
  if (above == points.end()) return std::nullopt;
  if (above->frequency_Hz == frequency_Hz) return above->amplitude_m;
  if (above == points.begin()) return std::nullopt;
  const Point &low = above[-1], &high = *above;
  const double share = std::log(frequency_Hz / low.frequency_Hz) / std::log(high.frequency_Hz / low.frequency_Hz);
  return low.amplitude_m * std::pow(high.amplitude_m / low.amplitude_m, share);
}

Thresholds load_thresholds(const std::filesystem::path& file) {
  const description::YamlNode root = description::YamlNode::load(file);
  Thresholds thresholds;
  thresholds.file = file;
  thresholds.source = root.string("source");
  for (const description::YamlNode& node : root.list("regions", 1, 100)) {
    thresholds.regions.push_back(read_region(node));
  }
  if (const auto vibration = root.find_map("vibration")) thresholds.vibration = read_vibration(*vibration);
  root.finish();
  return thresholds;
}

}  // namespace proxarm::assessment
