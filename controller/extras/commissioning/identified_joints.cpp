#include "controller/extras/commissioning/identified_joints.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <regex>

#include "controller/extras/commissioning/cell_change.hpp"
#include "models/arm/arm.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"
#include "models/files/yaml_insertion.hpp"

namespace proxarm::command_line {
namespace {

using description::Cell;
using description::DriveDescription;
using description::Json;
using description::SetupError;
using identification::Estimate;

constexpr const char* friction_key = "simulation.coulomb_friction_Nm";
constexpr const char* viscous_key = "simulation.viscous_friction_Nms_per_rad";
constexpr const char* rotor_key = "rotor_inertia_kg_m2";
constexpr const char* stiffness_key = "gear_stiffness_Nm_per_rad";
constexpr const char* damping_key = "gear_damping_Nms_per_rad";

std::string formatted(const char* format, double value) {
  std::array<char, 40> word{};
  std::snprintf(word.data(), word.size(), format, value);
  return word.data();
}

// Returns the value as text, rounded to the second digit of its uncertainty `half`, as further digits have no meaning.
std::string value_text(double value, double half) {
  const int decimals = half > 0.0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(half))), 0, 7) : 6;
  std::array<char, 40> word{};
  std::snprintf(word.data(), word.size(), "%.*f", decimals, value);
  return word.data();
}

std::string line(const JointFigure& figure, bool compare) {
  const Estimate& found = figure.estimate;
  std::array<char, 200> text{};
  if (!found.found) {
    std::snprintf(text.data(), text.size(), "  %-40s not identifiable: ", figure.key.c_str());
    return text.data() + found.reason + "\n";
  }
  std::snprintf(text.data(), text.size(), "  %-40s %s %s, \u00b1 %s", figure.key.c_str(),
                value_text(found.value, found.half).c_str(), figure.unit.c_str(),
                value_text(found.half, found.half).c_str());
  std::string told = text.data();
  if (compare) {
    told += "; the cell has " + description::rounded_text(figure.in_cell) +
            (figure.differs() ? ": DIFFERS by more than the interval" : ": agrees within the interval");
  }
  return told + "\n";
}

// Returns the range of a drive's entry in the cell's text: from the entry's `joint:` to the next `joint:`, or to the
// end of the section.
std::pair<std::size_t, std::size_t> entry_of(const std::string& text, const std::string& joint) {
  std::string pattern = R"(\bjoint:\s*["']?)";
  for (const char c : joint)
    pattern += std::isalnum(static_cast<unsigned char>(c)) != 0 ? std::string(1, c) : std::string("\\") + c;
  std::smatch match;
  if (!std::regex_search(text, match, std::regex(pattern + R"(["']?\s*[,\n}#])"))) return {text.size(), text.size()};
  const auto from = static_cast<std::size_t>(match.position(0));
  static const std::regex next(R"(\bjoint:|\n[A-Za-z_])");
  const auto begin = text.cbegin() + static_cast<std::ptrdiff_t>(from) + 6;
  std::smatch end;
  const bool ends = std::regex_search(begin, text.cend(), end, next);
  return {from, ends ? from + 6 + static_cast<std::size_t>(end.position(0)) : text.size()};
}

// Replaces the number behind each occurrence of the key in the joint's entry. Returns how many numbers were replaced.
int replace_all(std::string& text, const std::string& joint, const std::string& key, const std::string& fresh) {
  const std::regex pattern("\\b" + key + R"(:\s*([-+.0-9eE]+))");
  int replaced = 0;
  std::size_t at = entry_of(text, joint).first;
  while (true) {
    const std::size_t to = entry_of(text, joint).second;
    std::smatch match;
    const auto begin = text.cbegin() + static_cast<std::ptrdiff_t>(at),
               end = text.cbegin() + static_cast<std::ptrdiff_t>(to);
    if (at >= to || !std::regex_search(begin, end, match, pattern)) return replaced;
    const std::size_t value_at = at + static_cast<std::size_t>(match.position(1));
    const auto length = static_cast<std::size_t>(match.length(1));
    at = value_at + length;
    if (in_comment(text, value_at)) continue;
    text.replace(value_at, length, fresh);
    at = value_at + fresh.size();
    ++replaced;
  }
}

std::string bare(const std::string& key) {
  const std::size_t dot = key.rfind('.');
  return dot == std::string::npos ? key : key.substr(dot + 1);
}

[[noreturn]] void refuse(const Cell& cell, const JointFigure& figure, const std::string& fresh) {
  throw SetupError({.file = cell.file.string(),
                    .key = "drives (" + figure.joint + ")." + figure.key,
                    .message = "can't be changed in this file; write it by hand",
                    .expected = fresh});
}

// Adds a missing key to the entry of a joint's drive, or to the entry's `simulation` map. If the entry has no
// `simulation` map because all its values come from simulation_defaults, adds the map, too. Returns false if the key
// can't be added.
bool insert(std::string& text, const std::string& joint, const std::string& key, const std::string& fresh) {
  const std::vector<description::YamlStep> entry{{"drives"}, {"joint", joint}};
  const std::size_t dot = key.find('.');
  if (dot == std::string::npos) return description::insert_key(text, entry, key, fresh);
  const std::string map = key.substr(0, dot);
  if (!description::has_key(text, entry, map)) {
    return description::insert_key(text, entry, map, "{" + bare(key) + ": " + fresh + "}");
  }
  return description::insert_key(text, {entry[0], entry[1], {map}}, bare(key), fresh);
}

// Sets a key of simulation_defaults to a value of its own in the `simulation` map of one joint's drive, unless the map
// has that key already.
void own_simulation(std::string& text, const std::string& joint, const std::string& key, const std::string& fresh) {
  const bool is_own = description::has_key(text, {{"drives"}, {"joint", joint}, {"simulation"}}, key);
  if (is_own || !description::has_key(text, {{"simulation_defaults"}}, key)) return;
  static_cast<void>(insert(text, joint, "simulation." + key, fresh));
}

std::string with_joints(const std::string& text, const std::vector<JointFigure>& figures, const Cell& cell) {
  std::string changed = text;
  for (const JointFigure& figure : figures) {
    if (!figure.estimate.found) continue;
    const std::string fresh = formatted("%.6g", figure.estimate.value);
    const int replaced = replace_all(changed, figure.joint, bare(figure.key), fresh);
    // The damping must also be in the drive's own map, because the controller doesn't read the `simulation` map.
    const bool inserted =
        (replaced == 0 || figure.key == damping_key) && insert(changed, figure.joint, figure.key, fresh);
    if (replaced == 0 && !inserted) refuse(cell, figure, fresh);
    if (figure.key == damping_key) own_simulation(changed, figure.joint, damping_key, fresh);
    // The identified stiffness is the real one, so the simulation must no longer scale it.
    if (figure.key == stiffness_key && replace_all(changed, figure.joint, "gear_stiffness_ratio", "1") == 0) {
      own_simulation(changed, figure.joint, "gear_stiffness_ratio", "1");
    }
  }
  return changed;
}

double value_of(const DriveDescription& drive, const std::string& key) {
  if (key == rotor_key) return drive.rotor_inertia_kg_m2;
  if (key == stiffness_key) return drive.gear_stiffness_Nm_per_rad;
  if (key == damping_key) return drive.gear_damping_Nms_per_rad.value_or(0.0);
  return key == friction_key ? drive.simulation.coulomb_friction_Nm : drive.simulation.viscous_friction_Nms_per_rad;
}

const DriveDescription& drive_of(const Cell& cell, const std::string& joint) {
  return *std::find_if(cell.drives.begin(), cell.drives.end(),
                       [&](const DriveDescription& drive) { return drive.joint == joint; });
}

}  // namespace

bool IdentifiedJoints::found() const noexcept {
  return failure.empty() && std::any_of(fit.joints.begin(), fit.joints.end(), [](const auto& joint) {
           return joint.coulomb_Nm.found || joint.viscous_Nms_per_rad.found || joint.rotor_inertia_kg_m2.found ||
                  joint.stiffness_Nm_per_rad.found || joint.damping_Nms_per_rad.found;
         });
}

bool JointFigure::differs() const noexcept {
  return estimate.found && std::abs(estimate.value - in_cell) > estimate.half;
}

std::vector<JointFigure> figures(const IdentifiedJoints& joints, const Cell& cell) {
  std::vector<JointFigure> all;
  const models::Arm arm(cell);
  for (std::size_t i = 0; i < joints.fit.joints.size(); ++i) {
    const identification::JointEstimates& e = joints.fit.joints[i];
    const DriveDescription& drive = cell.drives[i];
    const bool slides = arm.slides(static_cast<int>(i));
    const auto add = [&](const char* key, const char* turning, const char* sliding, const Estimate& estimate) {
      all.push_back({drive.joint, key, slides ? sliding : turning, value_of(drive, key), estimate});
    };
    add(friction_key, "Nm", "N", e.coulomb_Nm);
    add(viscous_key, "Nms/rad", "Ns/m", e.viscous_Nms_per_rad);
    add(rotor_key, "kg m\u00b2", "kg", e.rotor_inertia_kg_m2);
    add(stiffness_key, "Nm/rad", "N/m", e.stiffness_Nm_per_rad);
    add(damping_key, "Nms/rad", "Ns/m", e.damping_Nms_per_rad);
  }
  return all;
}

std::string text(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare) {
  if (!joints.failure.empty()) return joints.failure + "\nNOT IDENTIFIED\n";
  std::string told = std::string("joints of a ") + (joints.real_arm ? "real" : "simulated") + " arm:\n", joint;
  for (const JointFigure& figure : figures) {
    if (figure.joint != joint) told += figure.joint + "\n";
    joint = figure.joint;
    told += line(figure, compare);
  }
  const identification::Allowed allowed;
  return told + "\u00b1: 95 % interval, with links whose inertias are " +
         description::rounded_text(200.0 * allowed.link_inertia) + " % others than the URDF's and torques that read " +
         description::rounded_text(200.0 * allowed.torque_scale) + " % otherwise allowed for\n";
}

Json json(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare) {
  Json told{{"identified", joints.found()},
            {"failure", joints.failure},
            {"real_arm", joints.real_arm},
            {"joints", Json::object()}};
  if (!joints.failure.empty()) return told;
  told["left_over_share"] = joints.fit.left_over_share;
  for (const JointFigure& figure : figures) {
    Json& of = told["joints"][figure.joint][figure.key];
    const Estimate& e = figure.estimate;
    if (!e.found) {
      of = {{"value", nullptr}, {"not_identifiable", e.reason}};
      continue;
    }
    of = {{"value", e.value}, {"uncertainty", e.half}};
    if (!compare) continue;
    of["in_cell"] = figure.in_cell;
    of["differs"] = figure.differs();
  }
  return told;
}

std::filesystem::path write_joints(const std::vector<JointFigure>& figures,
                                   const controller::PreparedSession& session) {
  const Cell& cell = session.cell;
  const auto edit = [&](const std::string& text) { return with_joints(text, figures, cell); };
  const auto check = [&](const Cell& written) {
    constexpr double rounded = 1e-5;  // six digits are written
    for (const JointFigure& figure : figures) {
      const double wanted = figure.estimate.found ? figure.estimate.value : figure.in_cell;
      const double is = value_of(drive_of(written, figure.joint), figure.key);
      if (std::abs(is - wanted) > rounded * std::abs(wanted)) refuse(cell, figure, formatted("%.6g", wanted));
    }
  };
  return change_cell(cell.file, "identify", edit, check);
}

}  // namespace proxarm::command_line
