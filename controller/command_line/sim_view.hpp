// `proxarm sim --view`: shows the simulated arm in a browser, with what the simulation knows: arm, drives, hand and
// load on the sensor. The proxy and its contacts belong to the controller, which is another process.
#pragma once

#include <cstdint>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/sessions/view_process.hpp"
#include "controller/record/black_box.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {

class SimView {
 public:
  // Starts the process that shows the arm. Precondition: no other thread runs yet. Throws SetupError.
  SimView(const PreparedSession& session, const RunOptions& options);

  // Shows every millisecond of this arm from now on. Precondition: the arm doesn't move after this object is destroyed.
  void watch(sim::SimulatedCell& cell);

 private:
  void add(const sim::Truth& truth) noexcept;

  controller::BlackBox box_;
  ViewProcess process_;
  sim::SimulatedCell* cell_ = nullptr;
  std::int64_t begun_ns_ = 0, next_ns_ = 0;  // time of the first cycle shown, and of the next one
};

}  // namespace proxarm::command_line
