// What a cycle's flags mean, in words: for the summary of a session and for whoever looks at it.
#pragma once

#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// What holds the arm back, or is otherwise out of the ordinary, while a flag is set.
struct FlagWords {
  RecordFlag flag;
  const char* words;
  bool holds_back;  // it is a limit that acts
};
[[nodiscard]] const std::vector<FlagWords>& flag_words();
// Of one of them.
[[nodiscard]] const char* words_of(RecordFlag flag) noexcept;

}  // namespace proxarm::controller
