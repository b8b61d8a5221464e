// A scripted request, its time, and its outcome.
#pragma once

#include <cstdint>

namespace proxarm::controller {

template <typename T>
struct Scheduled {
  std::int64_t at_ns = 0;  // time since the first cycle, or since rendering began; the receiver of requests says which
  T request;
  bool taken = false;             // due while the session ran
  const char* refusal = nullptr;  // why it was refused; null: it wasn't
};

}  // namespace proxarm::controller
