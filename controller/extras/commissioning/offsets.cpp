#include "controller/extras/commissioning/offsets.hpp"

#include <cmath>
#include <limits>
#include <regex>

#include "controller/extras/commissioning/cell_change.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using description::SetupError;

// Returns where the first `joint: NAME` after `from` that isn't in a comment ends; npos if there is none.
std::size_t end_of_joint(const std::string& text, const std::string& joint, std::size_t from) {
  const std::regex key(R"((^|[\s{,-])joint:\s*["']?)" + joint + R"(["']?(?=[\s,}#]|$))");
  std::smatch match;
  std::size_t at = from;
  while (std::regex_search(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(), match, key)) {
    const std::size_t begin = at + static_cast<std::size_t>(match.position(0));
    const std::size_t line = text.rfind('\n', begin + 1);
    const std::string before = text.substr(line + 1, begin - line);
    at = begin + static_cast<std::size_t>(match.length(0));
    if (before.find('#') == std::string::npos) return at;
  }
  return std::string::npos;
}

// Returns where the next drive after `from` begins, or where the section ends.
std::size_t end_of_drive(const std::string& text, std::size_t from) {
  static const std::regex next(R"((^|\n)\s*-\s*\{?\s*joint:|\n[A-Za-z_])");
  std::smatch match;
  if (!std::regex_search(text.begin() + static_cast<std::ptrdiff_t>(from), text.end(), match, next)) return text.size();
  return from + static_cast<std::size_t>(match.position(0));
}

}  // namespace

std::int32_t offset_by(const description::DriveDescription& drive, double angle_rad, std::int32_t counts) {
  const double offset = std::nearbyint(counts - angle_rad * drive.counts_per_rad());
  if (std::abs(offset) <= std::numeric_limits<std::int32_t>::max()) return static_cast<std::int32_t>(offset);
  throw SetupError({.key = "offset_counts of " + drive.joint,
                    .found = description::number_text(offset),
                    .expected = "a number of 32 bits; are gear_ratio and counts_per_motor_revolution right?"});
}

double off_by(const description::DriveDescription& drive, std::int32_t offset, double angle_rad, std::int32_t counts) {
  return (static_cast<double>(counts) - offset) / drive.counts_per_rad() - angle_rad;
}

std::string with_offsets(const std::string& text, const description::Cell& cell,
                         const std::vector<std::int32_t>& offsets) {
  std::string changed = text;
  std::size_t from = changed.find("drives:");
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    const std::string value = std::to_string(offsets[i]);
    const std::size_t joint = from == std::string::npos ? from : end_of_joint(changed, cell.drives[i].joint, from);
    if (joint == std::string::npos) {
      throw SetupError({.file = cell.file.string(),
                        .key = "drives",
                        .found = "no line `joint: " + cell.drives[i].joint + "`",
                        .expected = "one, to write offset_counts behind it"});
    }
    static const std::regex key(R"(offset_counts:\s*[-+0-9A-Fa-fx]+)");
    const std::string block = changed.substr(joint, end_of_drive(changed, joint) - joint);
    std::smatch match;
    if (std::regex_search(block, match, key)) {
      changed.replace(joint + static_cast<std::size_t>(match.position(0)), static_cast<std::size_t>(match.length(0)),
                      "offset_counts: " + value);
    } else {
      const std::size_t line = changed.rfind('\n', joint - 1) + 1;
      const std::string head = changed.substr(line, joint - line);
      const bool flow = head.find('{') != std::string::npos;
      const std::string indent(head.find("joint:"), ' ');
      changed.insert(joint, flow ? ", offset_counts: " + value : "\n" + indent + "offset_counts: " + value);
    }
    from = joint;
  }
  return changed;
}

std::filesystem::path write_offsets(const description::Cell& cell, const std::vector<std::int32_t>& offsets) {
  const auto check = [&](const description::Cell& written) {
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      if (written.drives.size() == offsets.size() && written.drives[i].offset_counts == offsets[i]) continue;
      throw SetupError({.file = cell.file.string(),
                        .key = "offset_counts of " + cell.drives[i].joint,
                        .message = "can't be changed in this file; write it by hand",
                        .expected = std::to_string(offsets[i])});
    }
  };
  return change_cell(
      cell.file, "calibration", [&](const std::string& text) { return with_offsets(text, cell, offsets); }, check);
}

}  // namespace proxarm::command_line
