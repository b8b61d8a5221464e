// Defines PROXARM_SANITIZED where a sanitizer slows the program down: no place for limits on time.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)  // g++
#define PROXARM_SANITIZED
#elif defined(__has_feature)  // clang++
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(undefined_behavior_sanitizer)
#define PROXARM_SANITIZED
#endif
#endif
