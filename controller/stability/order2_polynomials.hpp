// Order 2's weights as polynomials in w, one period of delay. They are written from the equations, independently of the
// proxy's weights in controller/proxies/force_weights.cpp, so that a test that compares both is meaningful.
#pragma once

#include <array>

namespace proxarm::controller {

inline constexpr std::array<double, 4> order2_weights{8.0 / 27.0, 12.0 / 27.0, 6.0 / 27.0, 1.0 / 27.0};  // W
inline constexpr std::array<double, 3> order2_difference{1.5, -2.0, 0.5};                                // D T
inline constexpr std::array<double, 3> order2_force{13.0 / 12.0, -2.0 / 12.0, 1.0 / 12.0};               // S

}  // namespace proxarm::controller
