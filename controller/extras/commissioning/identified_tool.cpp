#include "controller/extras/commissioning/identified_tool.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <regex>

#include "controller/extras/commissioning/cell_change.hpp"
#include "controller/preparation/proof_file.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using description::Cell;
using description::Json;
using description::SetupError;
using models::Vec3;

std::vector<double> list(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Json json(const std::vector<double>& values) {
  if (values.size() == 1) return values.front();
  Json all = Json::array();
  for (const double value : values) all.push_back(value);
  return all;
}

Json with_half(const std::vector<double>& values, const std::vector<double>& half) {
  return {{"value", json(values)}, {"uncertainty", json(half)}};
}

// Returns the number of decimals up to the second digit of the smallest uncertainty, as further digits have no meaning.
int decimals(const std::vector<double>& half) {
  const double least = *std::min_element(half.begin(), half.end());
  if (!(least > 0.0)) return 6;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(least))), 0, 7);
}

std::string words(const std::vector<double>& values, int digits) {
  std::string all;
  for (const double value : values) {
    std::array<char, 40> word{};
    std::snprintf(word.data(), word.size(), "%.*f", digits, value);
    all += (all.empty() ? "" : ", ") + std::string(word.data());
  }
  return values.size() == 1 ? all : "(" + all + ")";
}

std::string line(const char* name, const std::vector<double>& values, const std::vector<double>& half,
                 const char* unit) {
  const int digits = decimals(half);
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), "  %-16s %s %s, \u00b1 %s\n", name, words(values, digits).c_str(), unit,
                words(half, digits).c_str());
  return text.data();
}

// Returns the range in the text of the section whose key `key` is at the left margin: from that key to the next
// section's key.
std::pair<std::size_t, std::size_t> section(const std::string& text, const std::string& key) {
  std::size_t from = text.rfind(key + ":", 0) == 0 ? 0 : text.find("\n" + key + ":");
  if (from == std::string::npos) return {text.size(), text.size()};
  if (text[from] == '\n') ++from;
  static const std::regex next(R"(\n[A-Za-z_])");
  std::smatch match;
  const bool found = std::regex_search(text.begin() + static_cast<std::ptrdiff_t>(from), text.end(), match, next);
  return {from, found ? from + static_cast<std::size_t>(match.position(0)) : text.size()};
}

// Replaces the value of a key in the section `tool`. `value` is a regular expression for the old value.
void replace(std::string& text, const Cell& cell, const std::string& key, const std::string& value,
             const std::string& fresh) {
  const auto [from, to] = section(text, "tool");
  const std::regex pattern("(" + key + R"(:\s*)()" + value + ")");
  const auto begin = text.cbegin();
  for (std::sregex_iterator found(begin + static_cast<std::ptrdiff_t>(from), begin + static_cast<std::ptrdiff_t>(to),
                                  pattern);
       found != std::sregex_iterator(); ++found) {
    const std::size_t at = from + static_cast<std::size_t>(found->position(2));
    if (in_comment(text, at)) continue;
    text.replace(at, static_cast<std::size_t>(found->length(2)), fresh);
    return;
  }
  throw SetupError({.file = cell.file.string(),
                    .key = "tool." + key,
                    .message = "can't be changed in this file; write it by hand",
                    .expected = fresh});
}

std::string number(double value) {
  std::array<char, 40> word{};
  std::snprintf(word.data(), word.size(), "%.6g", value);
  return word.data();
}

std::string numbers(const std::array<double, 3>& values) {
  return "[" + number(values[0]) + ", " + number(values[1]) + ", " + number(values[2]) + "]";
}

controller::ZeroFile zero_of(const IdentifiedTool& tool, const std::string& of_cell_sha256) {
  const proof::Reading& last = tool.readings.back();
  const models::Wrench& zero_S = tool.fit.zero_S;
  const double samples = std::max(2, last.samples);
  const double noise_N = std::sqrt(last.step_squares_S.force.maxCoeff() / (2.0 * (samples - 1.0)));
  return {.cell_sha256 = of_cell_sha256,
          .real_arm = tool.real_arm,
          .date = controller::today(),
          .force_S_N = {zero_S.force.x(), zero_S.force.y(), zero_S.force.z()},
          .torque_S_Nm = {zero_S.torque.x(), zero_S.torque.y(), zero_S.torque.z()},
          .noise_N = noise_N,
          .spread_N = tool.fit.force.worst,
          .motor_rad = {last.motor_rad.data(), last.motor_rad.data() + last.motor_rad.size()}};
}

}  // namespace

bool ToolDifference::differs() const noexcept {
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (std::abs(found[i] - in_cell[i]) > half[i]) return true;
  }
  return false;
}

std::vector<ToolDifference> compare(const IdentifiedTool& tool, const Cell& cell,
                                    const std::optional<controller::ZeroFile>& zero) {
  const identification::ToolFit& fit = tool.fit;
  std::vector<ToolDifference> all;
  if (!tool.found()) return all;
  all.push_back({"tool.mass_kg", {cell.tool.mass_kg}, {fit.mass_kg}, {fit.mass_half_kg}});
  if (fit.centre_found) {
    const auto& centre = cell.tool.centre_of_mass_S_m;
    all.push_back(
        {"tool.centre_of_mass_S_m", {centre.begin(), centre.end()}, list(fit.centre_S_m), list(fit.centre_half_m)});
  }
  if (!zero) return all;
  all.push_back({"force_S_N of " + controller::zero_path(cell).filename().string(),
                 {zero->force_S_N.begin(), zero->force_S_N.end()},
                 list(fit.zero_S.force),
                 list(fit.zero_half_S.force)});
  return all;
}

std::string text(const IdentifiedTool& tool) {
  if (!tool.failure.empty()) return tool.failure + "\nNOT IDENTIFIED\n";
  std::string told;
  const identification::ToolFit& fit = tool.fit;
  if (fit.mass_found) {
    told += std::string("behind the sensor, of a ") + (tool.real_arm ? "real" : "simulated") + " arm, by " +
            std::to_string(tool.readings.size()) + " poses:\n" + line("mass", {fit.mass_kg}, {fit.mass_half_kg}, "kg");
    if (fit.centre_found) told += line("centre of mass", list(fit.centre_S_m), list(fit.centre_half_m), "m in S");
    told += line("zero, force", list(fit.zero_S.force), list(fit.zero_half_S.force), "N in S");
    if (fit.centre_found) {
      told += line("zero, torque", list(fit.zero_S.torque), list(fit.zero_half_S.torque), "Nm in S");
    }
    std::array<char, 240> allowed{};
    std::snprintf(
        allowed.data(), allowed.size(),
        "\u00b1: 95 %% interval, with a mounting error of %.2g degrees, a zero that drifts by %.3g N meanwhile, "
        "and gears allowed for\n",
        identification::mounting_deg, tool.allowances.zero_drift_N);
    told += allowed.data();
  }
  if (!tool.not_shown.empty()) told += "not identifiable: " + tool.not_shown + "\n";
  return told;
}

std::string text(const std::vector<ToolDifference>& differences) {
  std::string told;
  for (const ToolDifference& d : differences) {
    const int digits = decimals(d.half);
    told += d.key + ": " + words(d.in_cell, digits) + ", found " + words(d.found, digits) +
            (d.differs() ? ": DIFFERS by more than the interval\n" : ": agrees within the interval\n");
  }
  return told;
}

Json json(const IdentifiedTool& tool) {
  const identification::ToolFit& fit = tool.fit;
  Json told{{"identified", tool.whole()},    {"failure", tool.failure},   {"not_identifiable", tool.not_shown},
            {"poses", tool.readings.size()}, {"real_arm", tool.real_arm}, {"mass_kg", nullptr},
            {"centre_of_mass_S_m", nullptr}, {"zero_force_S_N", nullptr}, {"zero_torque_S_Nm", nullptr}};
  if (!tool.found()) return told;
  told["mass_kg"] = with_half({fit.mass_kg}, {fit.mass_half_kg});
  told["zero_force_S_N"] = with_half(list(fit.zero_S.force), list(fit.zero_half_S.force));
  told["left_over_N"] = fit.force.worst;
  told["mounting_error_deg"] = fit.turned_rad * 180.0 / std::numbers::pi;
  if (!fit.centre_found) return told;
  told["centre_of_mass_S_m"] = with_half(list(fit.centre_S_m), list(fit.centre_half_m));
  told["zero_torque_S_Nm"] = with_half(list(fit.zero_S.torque), list(fit.zero_half_S.torque));
  return told;
}

Json json(const std::vector<ToolDifference>& differences) {
  Json all = Json::array();
  for (const ToolDifference& d : differences) {
    all.push_back({{"key", d.key},
                   {"in_cell", json(d.in_cell)},
                   {"found", json(d.found)},
                   {"uncertainty", json(d.half)},
                   {"differs", d.differs()}});
  }
  return all;
}

std::string with_tool(const std::string& text, const Cell& cell, double mass_kg,
                      const std::array<double, 3>& centre_S_m) {
  std::string changed = text;
  replace(changed, cell, "mass_kg", R"([-+.0-9eE]+)", number(mass_kg));
  replace(changed, cell, "centre_of_mass_S_m", R"(\[[^\]]*\])", numbers(centre_S_m));
  return changed;
}

std::filesystem::path write_tool(const IdentifiedTool& tool, const controller::PreparedSession& session) {
  const double mass_kg = tool.fit.mass_kg;
  const Vec3& c = tool.fit.centre_S_m;
  const std::array<double, 3> centre_S_m{c.x(), c.y(), c.z()};
  const Cell& cell = session.cell;
  const auto edit = [&](const std::string& text) { return with_tool(text, cell, mass_kg, centre_S_m); };
  const auto check = [&](const Cell& written) {
    const auto& is = written.tool.centre_of_mass_S_m;
    // Six digits are written.
    constexpr double rounded = 1e-5;
    bool same = std::abs(written.tool.mass_kg - mass_kg) <= rounded * std::abs(mass_kg);
    for (std::size_t i = 0; i < 3; ++i) {
      same = same && std::abs(is[i] - centre_S_m[i]) <= rounded * std::abs(centre_S_m[i]);
    }
    if (same) return;
    throw SetupError({.file = cell.file.string(),
                      .key = "tool",
                      .message = "can't be changed in this file; write it by hand",
                      .expected = "mass_kg " + number(mass_kg) + ", centre_of_mass_S_m " + numbers(centre_S_m)});
  };
  const std::filesystem::path backup = change_cell(cell.file, "identify", edit, check);
  controller::write_zero(controller::zero_path(cell), zero_of(tool, controller::cell_sha256(session)));
  return backup;
}

}  // namespace proxarm::command_line
