// Defines the orders from a person to a running session; the order to end the session is CycleStatus::request_stop().
// Orders enter the cycle from another thread or from a script.
#pragma once

#include <cstdint>

#include "models/base/scheduled.hpp"

namespace proxarm::controller {

enum class Order : std::uint8_t {
  none,
  hold,      // in rendering: a controlled stop, after which the drives stay enabled. In freeing: ends freeing
  resume,    // in a hold: rendering continues; the force rises over ramp_in_s
  release,   // in a hold: the arm follows the hand slowly, without the scene
  back_off,  // in a hold: the tool moves `value` metres along the last contact's normal
  reset,     // after a fault: the drives are enabled again, and a hold begins
};

struct Command {
  Order order = Order::none;
  double value = 0.0;
};

using ScheduledCommand = Scheduled<Command>;  // times count from the first cycle

}  // namespace proxarm::controller
