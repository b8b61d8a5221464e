// What setpoints may ask of a drive's torque.
#pragma once

namespace proxarm::controller {

// The share of a drive's torque that a single setpoint may ask for. A quarter is taken by friction (3 % in the default
// cell), by the motors' extra motion while they bend their gears, and by the hand's pull (200 N at 1.5 m: 12 %). The
// rest is left for the gears: a torque that steps within a period makes them overshoot to twice their static twist.
// With 0.75, the default cell's simulated arm exceeded its limit by up to 1.32 times; 9 of 64 pulls exceeded 1.05
// times.
constexpr double strained_share = 0.4;

}  // namespace proxarm::controller
