// A scripted request, its time, and its outcome.
#pragma once

#include <cstdint>

namespace proxarm::controller {

template <typename T>
struct Scheduled {
  std::int64_t at_ns = 0;  // on the taker's clock: since the first cycle, or rendering time
  T request;
  bool taken = false;             // due while the session ran
  const char* refusal = nullptr;  // why it was refused; null: it wasn't
};

}  // namespace proxarm::controller
