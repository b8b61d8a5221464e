// What a URDF of the ROS world names: packages, and macros that the program xacro expands.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace proxarm::command_line {

// Where ROS packages are: as --package NAME=DIR says, in a folder of ROS_PACKAGE_PATH or AMENT_PREFIX_PATH, or the one
// that the URDF itself is in, and its neighbours.
class Packages {
 public:
  // Throws SetupError for words that aren't NAME=DIR, and folders that aren't there.
  Packages(const std::vector<std::string>& given, const std::filesystem::path& urdf);
  // Empty: not known.
  [[nodiscard]] std::filesystem::path folder(const std::string& name) const;
  [[nodiscard]] const std::map<std::string, std::filesystem::path>& all() const noexcept { return known_; }

 private:
  std::map<std::string, std::filesystem::path> known_;
};

// The URDF's text: the file's own, or what `xacro FILE NAME:=VALUE …` writes. The program must be on the path; it finds
// the packages as ROS 1 and ROS 2 look for them. Throws SetupError with what it says.
std::string urdf_text(const std::filesystem::path& file, const std::vector<std::string>& arguments,
                      const Packages& packages);

}  // namespace proxarm::command_line
