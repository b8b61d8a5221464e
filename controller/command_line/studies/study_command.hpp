// `proxarm study`: its options, and the function that runs it.
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
  std::string command_line;  // for the record
};

// Returns what a study measures and writes, for its help; empty if there is no study of that name.
std::string study_description(const std::string& name);
int study_command(const StudyOptions& options);

}  // namespace proxarm::command_line
