// What sanitizers change for tests.
//   PROXARM_SANITIZED          one slows the program down: no place for limits on time
//   PROXARM_SANITIZED_MALLOC   it has a malloc of its own, which can't be replaced
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)  // g++
#define PROXARM_SANITIZED
#define PROXARM_SANITIZED_MALLOC
#elif defined(__has_feature)  // clang++
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PROXARM_SANITIZED
#define PROXARM_SANITIZED_MALLOC
#elif __has_feature(undefined_behavior_sanitizer)
#define PROXARM_SANITIZED
#endif
#endif
