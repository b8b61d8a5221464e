// `proxarm sim --view`: shows the simulated arm in a browser, with what the simulation knows: arm, drives, hand and
// load on the sensor. The proxy and its contacts aren't shown, because the controller that knows them is another
// process.
#pragma once

#include <cstdint>

#include "controller/command_line/sessions/view_process.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {

class SimView {
 public:
  // Starts the process that shows the arm. Precondition: no other thread runs yet. Throws SetupError.
  SimView(const controller::PreparedSession& session, const controller::RunOptions& options);

  // Shows this arm's state once a millisecond from now on. Precondition: `cell` doesn't move after this view is
  // destroyed.
  void watch(sim::SimulatedCell& cell);

 private:
  void add(const sim::Truth& truth) noexcept;

  controller::BlackBox box_;
  ViewProcess process_;
  sim::SimulatedCell* cell_ = nullptr;
  // Times of the first cycle that was shown, and of the next cycle to show.
  std::int64_t begun_ns_ = 0, next_ns_ = 0;
};

}  // namespace proxarm::command_line
