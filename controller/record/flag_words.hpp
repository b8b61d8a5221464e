// The meaning of a cycle's flags in words, for a session's summary and the session's viewers.
#pragma once

#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// Words for a flag: what holds the arm back, or what is out of the ordinary, while the flag is set.
struct FlagWords {
  RecordFlag flag;
  const char* words;
  bool holds_back;  // whether the flag is an active limit
};
[[nodiscard]] const std::vector<FlagWords>& flag_words();
[[nodiscard]] const char* words_of(RecordFlag flag) noexcept;

}  // namespace proxarm::controller
