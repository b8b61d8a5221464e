#include "controller/command_line/sim_view.hpp"

namespace proxarm::command_line {
namespace {

constexpr std::int64_t period_ns = 1'000'000;

// Returns the session phase that fits the number of powered drives.
controller::Phase phase_of(const sim::Plant& plant) noexcept {
  std::size_t powered = 0;
  for (std::size_t axis = 0; axis < plant.axis_count(); ++axis) powered += plant.servo(axis).powered() ? 1 : 0;
  if (powered == plant.axis_count()) return controller::Phase::rendering;
  return powered > 0 ? controller::Phase::enabling : controller::Phase::idle;
}

}  // namespace

SimView::SimView(const controller::PreparedSession& session, const controller::RunOptions& options)
    : box_(1e-9 * static_cast<double>(period_ns), 1, controller::BlackBox::Memory::by_descriptor),
      process_(session, options, box_.descriptor(), ViewProcess::Shows::simulated_arm) {}

void SimView::watch(sim::SimulatedCell& cell) {
  cell_ = &cell;
  cell.set_observer([this](const sim::Truth& truth) {
    if (truth.time_ns < next_ns_) return;
    next_ns_ = truth.time_ns + period_ns;
    if (box_.cycles() == 0) begun_ns_ = truth.time_ns;
    add(truth);
  });
}

void SimView::add(const sim::Truth& truth) noexcept {
  const sim::Plant& plant = cell_->plant();
  controller::BoxCycle& entry = box_.begin(truth.time_ns);
  controller::CycleRecord record;
  record.cycle = box_.cycles();
  record.time_ns = truth.time_ns - begun_ns_;
  record.period_ns = period_ns;
  record.phase = phase_of(plant);
  record.axes = static_cast<std::uint8_t>(plant.axis_count());
  record.force_S_N = controller::triple(truth.sensor_wrench_S.force);
  record.torque_S_Nm = controller::triple(truth.sensor_wrench_S.torque);
  record.force_W_N = record.hand_force_W_N = controller::triple(truth.hand_force_W);
  // There is no proxy. Its place is set to the tool's, so a line drawn from tool to proxy has length 0.
  record.tool_W_m = record.proxy_W_m = record.p_hat_W_m = controller::triple(truth.X_WT.translation());
  for (std::size_t axis = 0; axis < plant.axis_count() && axis < controller::max_axes; ++axis) {
    record.actual_counts[axis] = plant.servo(axis).position_counts();
    record.target_counts[axis] = plant.servo(axis).demand_counts();
  }
  entry.record = record;
  entry.rendered_ns = truth.hand_started ? truth.time_ns - truth.hand_start_ns : 0;
  box_.finish();
}

}  // namespace proxarm::command_line
