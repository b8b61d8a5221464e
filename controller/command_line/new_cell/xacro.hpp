// Resolves what URDFs for ROS refer to: packages, and macros that the program xacro expands.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace proxarm::command_line {

// Finds ROS packages: as given by --package NAME=DIR, in the folders of ROS_PACKAGE_PATH and AMENT_PREFIX_PATH, or the
// URDF's own package and its neighbours.
class Packages {
 public:
  // Throws SetupError for words that aren't NAME=DIR, and for missing folders.
  Packages(const std::vector<std::string>& given, const std::filesystem::path& urdf);
  // Empty: unknown package.
  [[nodiscard]] std::filesystem::path folder(const std::string& name) const;
  [[nodiscard]] const std::map<std::string, std::filesystem::path>& all() const noexcept { return known_; }

 private:
  std::map<std::string, std::filesystem::path> known_;
};

// Returns the URDF's text: the file's own, or the output of `xacro FILE NAME:=VALUE …`. xacro must be on the PATH; it
// finds the packages as in ROS 1 and ROS 2. Throws SetupError with xacro's error.
std::string urdf_text(const std::filesystem::path& file, const std::vector<std::string>& arguments,
                      const Packages& packages);

}  // namespace proxarm::command_line
