// `proxarm sim --view`: the simulated arm in a browser, with what its own process knows. That is the arm, its drives,
// the hand and the load on the sensor. A proxy and its contacts are the controller's, which is another process.
#pragma once

#include <cstdint>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/sessions/view_process.hpp"
#include "controller/record/black_box.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {

class SimView {
 public:
  // Starts the process that shows it. No other thread may run yet. Throws SetupError.
  SimView(const PreparedSession& session, const RunOptions& options);

  // From now on every millisecond of this arm is shown. It must not move any more after this object is gone.
  void watch(sim::SimulatedCell& cell);

 private:
  void add(const sim::Truth& truth) noexcept;

  controller::BlackBox box_;
  ViewProcess process_;
  sim::SimulatedCell* cell_ = nullptr;
  std::int64_t begun_ns_ = 0, next_ns_ = 0;  // the first that is shown, and the next
};

}  // namespace proxarm::command_line
