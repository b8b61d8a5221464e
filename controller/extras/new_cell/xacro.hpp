// Finds the packages to which URDFs for ROS refer, and expands macros by the program xacro.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace proxarm::command_line {

// Knows the folders of ROS packages: those given by --package NAME=DIR, those in the folders of ROS_PACKAGE_PATH and
// AMENT_PREFIX_PATH, and the URDF's own package with the packages beside it.
class Packages {
 public:
  // Finds the packages. `given` are the values of --package. Throws SetupError for a value that isn't NAME=DIR, and for
  // a missing folder.
  Packages(const std::vector<std::string>& given, const std::filesystem::path& urdf);
  // Returns a package's folder; empty if the package is unknown.
  [[nodiscard]] std::filesystem::path folder(const std::string& name) const;
  [[nodiscard]] const std::map<std::string, std::filesystem::path>& all() const noexcept { return known_; }

 private:
  std::map<std::string, std::filesystem::path> known_;
};

// Returns the URDF's text: the file's content, or for a xacro the output of `xacro FILE NAME:=VALUE …`. The program
// xacro must be on the PATH, and finds the packages as it does in ROS 1 and ROS 2. Throws SetupError with xacro's
// error.
std::string urdf_text(const std::filesystem::path& file, const std::vector<std::string>& arguments,
                      const Packages& packages);

}  // namespace proxarm::command_line
