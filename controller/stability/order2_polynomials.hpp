// Order 2 as polynomials in w, one period of delay. What the proxy itself computes stands in
// controller/proxies/force_weights.cpp; these are written from its equations, so that a test of the one by the other
// means something.
#pragma once

#include <array>

namespace proxarm::controller {

inline constexpr std::array<double, 4> order2_weights{8.0 / 27.0, 12.0 / 27.0, 6.0 / 27.0, 1.0 / 27.0};  // W
inline constexpr std::array<double, 3> order2_difference{1.5, -2.0, 0.5};                                // D T
inline constexpr std::array<double, 3> order2_force{13.0 / 12.0, -2.0 / 12.0, 1.0 / 12.0};               // S

}  // namespace proxarm::controller
