// A request of a script, when it is due, and what became of it.
#pragma once

#include <cstdint>

namespace proxarm::controller {

template <typename T>
struct Scheduled {
  std::int64_t at_ns = 0;  // on the clock that whoever takes it names: since the first cycle, or of rendering
  T request;
  bool taken = false;             // its time came while the session ran
  const char* refusal = nullptr;  // why it did nothing then
};

}  // namespace proxarm::controller
