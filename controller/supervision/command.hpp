// Orders from a person to a running session, except its end. They enter the cycle from another thread or a script.
#pragma once

#include <cstdint>

#include "models/base/scheduled.hpp"

namespace proxarm::controller {

enum class Order : std::uint8_t {
  none,
  hold,      // rendering: controlled stop, drives stay enabled. Freeing: ends it
  resume,    // from a hold: continue rendering; the force rises over ramp_in_s
  release,   // from a hold: the arm follows the hand slowly, without the scene
  back_off,  // from a hold: the tool moves `value` metres along the last contact's normal
  reset,     // after a fault: enable the drives again, into a hold
};

struct Command {
  Order order = Order::none;
  double value = 0.0;
};

using ScheduledCommand = Scheduled<Command>;  // times count from the first cycle

}  // namespace proxarm::controller
