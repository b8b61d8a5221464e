// The meaning of a cycle's flags in words, for a session's summary and its viewers.
#pragma once

#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// What holds the arm back or is out of the ordinary while a flag is set.
struct FlagWords {
  RecordFlag flag;
  const char* words;
  bool holds_back;  // an active limit
};
[[nodiscard]] const std::vector<FlagWords>& flag_words();
[[nodiscard]] const char* words_of(RecordFlag flag) noexcept;

}  // namespace proxarm::controller
