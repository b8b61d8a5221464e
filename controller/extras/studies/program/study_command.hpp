// Runs `proxarm study`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::command_line {

struct StudyOptions {
  std::vector<std::string> words;  // a study's name; or "merge" and the folders of its parts
  std::filesystem::path out;
  bool quick = false;
  std::uint64_t seed = 1;
  std::string shard = "1/1";
  std::optional<double> runs;
  unsigned threads = 0;
  std::optional<std::uint64_t> replay;
  std::string command_line;  // the command as typed, for the study's JSON file
};

// Returns the help of a study, which says what the study measures and writes; empty if no study has that name.
std::string study_description(const std::string& name);
int study_command(const StudyOptions& options);

}  // namespace proxarm::command_line
