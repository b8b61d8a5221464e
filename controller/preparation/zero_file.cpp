#include "controller/preparation/zero_file.hpp"

#include <cstdio>
#include <fstream>
#include <span>

#include "controller/preparation/proof_file.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

std::string word(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", number);
  return text;
}

std::string list(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : ", ") + word(number);
  return "[" + text + "]";
}

}  // namespace

fs::path zero_path(const description::Cell& cell) { return fs::path(cell.file.string() + ".zero"); }

void write_zero(const fs::path& file, const ZeroFile& zero) {
  std::ofstream out(file);
  out << "# Written by `proxarm zero`, and on a real arm after each session without a fault.\n"
      << "cell_sha256: \"" << zero.cell_sha256 << "\"\n"
      << "arm: " << (zero.real_arm ? "real" : "simulated") << "\n"
      << "date: \"" << zero.date << "\"\n"
      << "force_S_N: " << list(zero.force_S_N) << "\n"
      << "torque_S_Nm: " << list(zero.torque_S_Nm) << "\n"
      << "noise_N: " << word(zero.noise_N) << "\n"
      << "spread_N: " << word(zero.spread_N) << "\n"
      << "motor_rad: " << list(zero.motor_rad) << "\n";
  out.flush();
  if (!out) throw description::SetupError({.file = file.string(), .message = "the zero can't be written"});
}

std::optional<ZeroFile> kept_zero(const PreparedSession& session, bool real_arm) {
  constexpr double most_N = 1e6, most_rad = 1e4;
  const fs::path file = zero_path(session.cell);
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  const description::YamlNode root = description::YamlNode::load(file);
  ZeroFile zero;
  zero.cell_sha256 = root.string("cell_sha256");
  zero.real_arm = root.choice("arm", {"real", "simulated"}) == "real";
  zero.date = root.string("date");
  zero.force_S_N = root.vec3("force_S_N", description::between(-most_N, most_N));
  zero.torque_S_Nm = root.vec3("torque_S_Nm", description::between(-most_N, most_N));
  zero.noise_N = root.number("noise_N", 0.0, most_N);
  zero.spread_N = root.number("spread_N", 0.0, most_N);
  zero.motor_rad = root.numbers("motor_rad", 1, 16, description::between(-most_rad, most_rad));
  root.finish();
  if (zero.real_arm != real_arm || zero.cell_sha256 != cell_sha256(session)) return std::nullopt;
  return zero;
}

}  // namespace proxarm::controller
