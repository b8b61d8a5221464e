// Provides the arm that commissioning moves: a simulated arm in this process and in virtual time, or an arm on
// interfaces.
#pragma once

#include <string>
#include <vector>

#include "controller/motion/cycle_parts.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "scenes/compiler/compile.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {

// Returns a simulated hand without mass, stiffness and damping.
description::HandDescription nobody();

// Precondition: `arm` outlives this object.
struct SimulatedArm {
  SimulatedArm(const controller::PreparedSession& arm, const controller::RunOptions& options,
               const description::HandDescription& hand = nobody());

  void power_on();
  // Brings the devices up, and returns the parts of a cycle for this arm. Precondition: `scene` outlives the returned
  // parts.
  controller::CycleParts brought_up(const controller::PreparedSession& session, scenes::CompiledScene& scene);

  fieldbus::SimulatedCanNetwork network;
  sim::SimulatedCell far_end;
};

struct ArmOnInterfaces {
  // Opens the interfaces. A real arm needs consent first (live/hardware_consent.hpp). Throws SetupError as `run` does.
  ArmOnInterfaces(const controller::PreparedSession& session, const controller::RunOptions& options);

  // Brings the devices up, and returns the parts of a cycle for this arm. Precondition: `scene` outlives the returned
  // parts.
  controller::CycleParts brought_up(const controller::PreparedSession& session, scenes::CompiledScene& scene);

  std::vector<std::string> interfaces;
  fieldbus::SocketCanNetwork network;
};

}  // namespace proxarm::command_line
