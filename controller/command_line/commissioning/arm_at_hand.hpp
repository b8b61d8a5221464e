// The arm that commissioning moves: a simulated one in this process and in virtual time, or one on interfaces.
#pragma once

#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/motion/cycle_parts.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "scenes/compiler/compile.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {

// A simulated hand without mass, stiffness and damping.
description::HandDescription nobody();

// Precondition: `arm` outlives this object.
struct SimulatedArm {
  SimulatedArm(const PreparedSession& arm, const RunOptions& options,
               const description::HandDescription& hand = nobody());

  void power_on();
  // Brings the devices up and returns the parts of a cycle for this arm. Precondition: `scene` outlives the parts.
  controller::CycleParts brought_up(const PreparedSession& session, scenes::CompiledScene& scene);

  fieldbus::SimulatedCanNetwork network;
  sim::SimulatedCell far_end;
};

struct ArmOnInterfaces {
  // Opens the interfaces, for a real arm after consent. Throws SetupError as `run` does.
  ArmOnInterfaces(const PreparedSession& session, const RunOptions& options);

  // As above.
  controller::CycleParts brought_up(const PreparedSession& session, scenes::CompiledScene& scene);

  std::vector<std::string> interfaces;
  fieldbus::SocketCanNetwork network;
};

}  // namespace proxarm::command_line
