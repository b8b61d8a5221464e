#include "models/description/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/description/sensor_sources.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

using Matrix = std::array<std::array<double, 6>, 6>;

// Returns the condition number of a 6×6 matrix, which tells whether the matrix's inverse keeps digits in single
// precision. Computes it by Gauss-Jordan inversion with partial pivoting, in the ∞-norm of the row-scaled matrix. (Rows
// are scaled because they differ in their units.)
double condition(Matrix a) {
  Matrix inverse{};
  double norm = 0.0, inverse_norm = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    double largest = 0.0, sum = 0.0;
    for (const double x : a[i]) largest = std::max(largest, std::abs(x));
    if (largest == 0.0) return std::numeric_limits<double>::infinity();
    for (double& x : a[i]) sum += std::abs(x /= largest);
    norm = std::max(norm, sum);
    inverse[i][i] = 1.0;
  }
  for (std::size_t k = 0; k < 6; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < 6; ++i) pivot = std::abs(a[i][k]) > std::abs(a[pivot][k]) ? i : pivot;
    if (a[pivot][k] == 0.0) return std::numeric_limits<double>::infinity();
    std::swap(a[k], a[pivot]);
    std::swap(inverse[k], inverse[pivot]);
    const double p = a[k][k];
    for (std::size_t j = 0; j < 6; ++j) a[k][j] /= p, inverse[k][j] /= p;
    for (std::size_t i = 0; i < 6; ++i) {
      if (i == k) continue;
      const double factor = a[i][k];
      for (std::size_t j = 0; j < 6; ++j) a[i][j] -= factor * a[k][j], inverse[i][j] -= factor * inverse[k][j];
    }
  }
  for (const auto& row : inverse) {
    double sum = 0.0;
    for (const double x : row) sum += std::abs(x);
    inverse_norm = std::max(inverse_norm, sum);
  }
  const double result = norm * inverse_norm;
  return std::isfinite(result) ? result : std::numeric_limits<double>::infinity();
}

SensorSimulation read_simulation(const YamlNode& node) {
  SensorSimulation s;
  const auto rows = node.list("matrix", 6, 6);
  for (std::size_t i = 0; i < 6; ++i) {
    const auto row = rows[i].as_numbers(6, 6, between(-1e9, 1e9));
    for (std::size_t j = 0; j < 6; ++j) s.matrix[i][j] = static_cast<double>(static_cast<float>(row[j]));
  }
  // Above a condition of 1e4, coefficients in single precision (6e-8) leave less than three digits of the smallest
  // component.
  if (const double c = condition(s.matrix); !(c < 1e4)) {
    throw node.error_at("matrix", "an invertible matrix of condition below 10000",
                        "one of condition " + number_text(c));
  }
  s.counts_per_N = static_cast<std::uint32_t>(node.integer_or("counts_per_N", s.counts_per_N, 1, 0xffffffff));
  s.counts_per_Nm = static_cast<std::uint32_t>(node.integer_or("counts_per_Nm", s.counts_per_Nm, 1, 0xffffffff));
  if (node.has("bias_counts")) {
    const auto bias = node.numbers("bias_counts", 6, 6, between(-32768.0, 32767.0));
    std::copy(bias.begin(), bias.end(), s.bias_counts.begin());
  }
  return s;
}

constexpr double drifting_share = 0.01;  // fraction of the range

}  // namespace

double zero_drift_N(const SensorDescription& sensor) noexcept {
  return drifting_share * *std::max_element(sensor.force_range_N.begin(), sensor.force_range_N.end());
}

std::array<double, 3> simulated_zero_S_N(const SensorDescription& sensor) noexcept {
  const SensorSimulation& s = sensor.simulation;
  std::array<double, 3> zero_S_N{};
  for (std::size_t row = 0; row < zero_S_N.size(); ++row) {
    for (std::size_t gauge = 0; gauge < s.bias_counts.size(); ++gauge) {
      zero_S_N[row] += s.matrix[row][gauge] * s.bias_counts[gauge] / static_cast<double>(s.counts_per_N);
    }
  }
  return zero_S_N;
}

SensorSources read_sensor_sources(const YamlNode& root) {
  SensorSources sources;
  if (root.has("sources")) {
    for (const YamlNode& source : root.list("sources", 1, 16)) sources.sources.push_back(source.as_string());
  }
  sources.one_source_only = text_up_to(root, "one_source_only", "", 400);
  return sources;
}

SensorDescription load_sensor(const std::filesystem::path& file, const SensorChoices& choices) {
  return read_sensor(YamlNode::load(file), choices);
}

SensorDescription read_sensor(const YamlNode& root, const SensorChoices& choices) {
  const std::filesystem::path& file = root.file();
  SensorDescription sensor;
  sensor.file = std::filesystem::absolute(file).lexically_normal();
  sensor.name = root.string("name");
  sensor.protocol = root.choice("protocol", {"ati_net_can_oem", "described"});
  sensor.force_range_N = root.vec3("force_range_N", above(0.0, 1e6));
  sensor.torque_range_Nm = root.vec3("torque_range_Nm", above(0.0, 1e6));
  if (choices.force_range_N) sensor.force_range_N = *choices.force_range_N;
  if (choices.torque_range_Nm) sensor.torque_range_Nm = *choices.torque_range_Nm;
  if (sensor.protocol == "described") {
    sensor.described = read_sensor_protocol(root, choices);
    for (std::size_t i = 0; i < 6; ++i) sensor.simulation.matrix[i][i] = 1.0;
  } else if (!choices.settings.empty()) {
    throw SetupError({.file = choices.file.string(),
                      .line = choices.settings.front().line,
                      .key = "sensor.settings",
                      .found = "a setting",
                      .expected = "none: " + sensor.name + " has no settings"});
  } else {
    sensor.simulation = read_simulation(root.map("simulation"));
  }
  static_cast<void>(read_sensor_sources(root));
  root.finish();
  return sensor;
}

}  // namespace proxarm::description
