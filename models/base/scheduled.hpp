// Defines a scripted request with its time and its outcome.
#pragma once

#include <cstdint>

namespace proxarm::controller {

template <typename T>
struct Scheduled {
  // Time since the first cycle or since rendering began; the class that receives the requests defines which.
  std::int64_t at_ns = 0;
  T request;
  bool taken = false;             // whether the request was due while the session ran
  const char* refusal = nullptr;  // why the request was refused; null: it wasn't refused
};

}  // namespace proxarm::controller
