// Archives a plain struct without a list of the struct's members, because a list could omit a member.
//
//   struct State { double angle_rad = 0.0; models::Vec3 q_W = models::Vec3::Zero(); };
//   void archive(StateArchive& state) noexcept { archive_fields(state, state_); }
//
// The number of members is the number of initialisers that the aggregate accepts. A structured binding of that number
// accesses the members. A member must have a type that StateArchive accepts, or be a plain struct. The struct may have
// at most 16 members, no base classes and no C arrays.
#pragma once

#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

#include "models/base/state_archive.hpp"

namespace proxarm::fieldbus {
namespace detail {

// Converts to a member of any type. The conversion is only declared, never defined.
struct AnyMember {
  template <typename T>
  operator T() const noexcept;  // NOLINT(google-explicit-constructor)
};

template <typename T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return requires { T{(static_cast<void>(I), AnyMember{})...}; };
}

template <typename T, std::size_t N = 0>
constexpr std::size_t count_fields() {
  static_assert(std::is_aggregate_v<T>);
  if constexpr (takes<T>(std::make_index_sequence<N + 1>{})) {
    return count_fields<T, N + 1>();
  } else {
    return N;
  }
}

// A struct without an archive() function. An array isn't a PlainStruct; it is archived as a whole.
template <typename T>
concept PlainStruct = std::is_class_v<T> && std::is_aggregate_v<T> && !requires {
  std::tuple_size<T>::value;
}
&&!requires(T & object, StateArchive& state) { object.archive(state); };

}  // namespace detail

template <typename T>
inline constexpr std::size_t field_count = detail::count_fields<T>();

// Calls visit(member) for each member of the struct, in the order of their declaration.
template <typename T, typename Visit>
constexpr void for_each_field(T& object, Visit&& visit) noexcept {
  const auto each = [&](auto&... member) { (visit(member), ...); };
  constexpr std::size_t n = field_count<T>;
  static_assert(n >= 1 && n <= 16, "split the struct");
  if constexpr (n == 1) {
    auto& [a] = object;
    each(a);
  } else if constexpr (n == 2) {
    auto& [a, b] = object;
    each(a, b);
  } else if constexpr (n == 3) {
    auto& [a, b, c] = object;
    each(a, b, c);
  } else if constexpr (n == 4) {
    auto& [a, b, c, d] = object;
    each(a, b, c, d);
  } else if constexpr (n == 5) {
    auto& [a, b, c, d, e] = object;
    each(a, b, c, d, e);
  } else if constexpr (n == 6) {
    auto& [a, b, c, d, e, f] = object;
    each(a, b, c, d, e, f);
  } else if constexpr (n == 7) {
    auto& [a, b, c, d, e, f, g] = object;
    each(a, b, c, d, e, f, g);
  } else if constexpr (n == 8) {
    auto& [a, b, c, d, e, f, g, h] = object;
    each(a, b, c, d, e, f, g, h);
  } else if constexpr (n == 9) {
    auto& [a, b, c, d, e, f, g, h, i] = object;
    each(a, b, c, d, e, f, g, h, i);
  } else if constexpr (n == 10) {
    auto& [a, b, c, d, e, f, g, h, i, j] = object;
    each(a, b, c, d, e, f, g, h, i, j);
  } else if constexpr (n == 11) {
    auto& [a, b, c, d, e, f, g, h, i, j, k] = object;
    each(a, b, c, d, e, f, g, h, i, j, k);
  } else if constexpr (n == 12) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l] = object;
    each(a, b, c, d, e, f, g, h, i, j, k, l);
  } else if constexpr (n == 13) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m] = object;
    each(a, b, c, d, e, f, g, h, i, j, k, l, m);
  } else if constexpr (n == 14) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, o] = object;
    each(a, b, c, d, e, f, g, h, i, j, k, l, m, o);
  } else if constexpr (n == 15) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, o, p] = object;
    each(a, b, c, d, e, f, g, h, i, j, k, l, m, o, p);
  } else {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, o, p, q] = object;
    each(a, b, c, d, e, f, g, h, i, j, k, l, m, o, p, q);
  }
}

template <typename T>
void archive_fields(StateArchive& state, T& object) noexcept {
  for_each_field(object, [&state](auto& member) {
    if constexpr (detail::PlainStruct<std::remove_cvref_t<decltype(member)>>) {
      archive_fields(state, member);
    } else {
      state(member);
    }
  });
}

}  // namespace proxarm::fieldbus
