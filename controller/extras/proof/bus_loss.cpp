#include "controller/extras/proof/bus_loss.hpp"

#include <bit>
#include <cmath>

#include "fieldbus/canopen/canopen_nmt.hpp"

namespace proxarm::proof {
namespace {

using controller::Event;
using controller::Fault;
using controller::Phase;

constexpr std::int64_t standing_ns = 300'000'000, silent_ns = 1'000'000'000, farewell_ns = 500'000'000;

std::vector<description::DriveDescription> silenced_drives(const controller::CycleParts& parts) {
  std::vector<description::DriveDescription> drives;
  for (const controller::DriveOnBus& axis : parts.drives) drives.push_back(axis.drive.description());
  return drives;
}

}  // namespace

BusLossSession::BusLossSession(controller::CycleParts parts, const controller::SessionSettings& settings,
                               const description::Cell& cell)
    : parts_(std::move(parts)),
      settings_(settings),
      supervisor_(controller::reactions_of(parts_.supervision)),
      alarm_(supervisor_, cycle_),
      recorder_(1),
      bus_(parts_, recorder_, alarm_),
      measurement_(parts_.drives, *parts_.sensor, *parts_.arm, parts_.compensation, settings.period_s),
      faults_(parts_.drives, settings_, {cell.limits.max_force_N, parts_.supervision.max_bias_drift_N}, supervisor_,
              alarm_, controller::ToolMonitor(cell.limits, settings.max_missed_feedback, 0.0),
              controller::DriveMonitor(*parts_.arm, silenced_drives(parts_), cell.limits.following_error_rad)) {
  setpoints_.values = parts_.arm->start_rad();
  for (const fieldbus::DriveSlot& slot : parts_.can_drives) watches_.emplace_back(*slot.drive);
}

void BusLossSession::run_cycle(std::int64_t t_k_ns) noexcept {
  const std::int64_t period_ns = std::llround(1e9 * settings_.period_s);
  if (step_ == Step::silent) {
    listen(t_k_ns + period_ns / 2);
    if (t_k_ns - since_ns_ >= silent_ns) go_to(Step::farewell, t_k_ns);
    return;
  }
  recorder_.begin(t_k_ns, [](fieldbus::StateArchive&) noexcept {});
  if (cycle_ == 0) {
    since_ns_ = t_k_ns;
    asks_for_press_ = parts_.enabling.has_value();
    if (!parts_.enabling) go_to(Step::enabling, t_k_ns);
  }
  bus_.begin(t_k_ns);
  bus_.receive_until(t_k_ns + std::llround(0.45e9 * settings_.period_s), listener_);
  measurement_.take();
  if (step_ != Step::farewell) heed(t_k_ns);
  act(t_k_ns);
  if (step_ == Step::silent) return;
  fieldbus::CanFrame heartbeat;
  // The heartbeats of all buses start in the same cycle, so one bus shows when they are due.
  fieldbus::HeartbeatProducer same = parts_.drive_buses.front().heartbeat;
  heartbeat_was_last_ = same.due(t_k_ns, cycle_, heartbeat);
  bus_.send_setpoints(setpoints_, t_k_ns, cycle_);
  bus_.hand_over();
  last_word_ns_ = t_k_ns;
  ++cycle_;
}

// Judges faults and the enabling input before the silence. Any fault or hold ends the session: the drives are switched
// off.
void BusLossSession::heed(std::int64_t t_k_ns) noexcept {
  if (parts_.enabling) {
    parts_.enabling->on_cycle(t_k_ns);
    if (parts_.enabling->take_press() && step_ == Step::waiting) go_to(Step::enabling, t_k_ns);
  }
  faults_.judge({.measured = measurement_.now(),
                 .sample = parts_.sensor->latest(),
                 .enabling = parts_.enabling ? &*parts_.enabling : nullptr,
                 .buses = bus_.read_status()});
  const bool held = supervisor_.phase() == Phase::holding;
  if (stop_.load() || supervisor_.faulted() || held) go_to(Step::farewell, t_k_ns);
}

void BusLossSession::act(std::int64_t t_k_ns) noexcept {
  const std::int64_t in_step_ns = t_k_ns - since_ns_;
  switch (step_) {
    case Step::waiting:
      setpoints_.values = measurement_.now().motor_rad;
      if (1e-9 * static_cast<double>(in_step_ns) <= settings_.enabling_timeout_s) return;
      alarm_.raise(Fault::enabling_not_pressed);
      return go_to(Step::farewell, t_k_ns);
    case Step::enabling:
      return wait_for_drives(t_k_ns);
    case Step::taring:
      measurement_.add_tare_sample();
      if (1e-9 * static_cast<double>(in_step_ns) < settings_.tare_s) return;
      measurement_.finish_tare();
      supervisor_.handle(Event::tared);
      return go_to(Step::standing, t_k_ns);
    case Step::standing:
      // The silence begins right after a heartbeat, which is the worst time: drives that monitor the heartbeat then
      // wait longest.
      if (in_step_ns >= standing_ns && heartbeat_was_last_) go_to(Step::silent, t_k_ns);
      return;
    case Step::farewell:
      if (in_step_ns >= farewell_ns) go_to(Step::done, t_k_ns);
      return;
    default:
      return;
  }
}

void BusLossSession::wait_for_drives(std::int64_t t_k_ns) noexcept {
  const controller::Measured& measured = measurement_.now();
  for (Eigen::Index i = 0; i < measured.axes(); ++i) {
    if ((measured.following & 1u << i) == 0) setpoints_.values[i] = measured.motor_rad[i];
  }
  if (std::countr_one(measured.following) >= static_cast<int>(measured.axes())) {
    supervisor_.handle(Event::enabled);
    go_to(Step::taring, t_k_ns);
    return;
  }
  const double in_step_s = 1e-9 * static_cast<double>(t_k_ns - since_ns_);
  const auto overdue =
      controller::first_overdue(parts_.drives, measured.following, in_step_s, settings_.enable_timeout_s);
  if (overdue.drive < 0) return;
  alarm_.raise(Fault::drive_not_enabled, overdue.drive, in_step_s, overdue.limit_s);
  go_to(Step::farewell, t_k_ns);
}

// Receives frames during the silence. The first of them may come from the last cycle; no drive reacts to the silence in
// these.
void BusLossSession::listen(std::int64_t until_ns) noexcept {
  fieldbus::TimedFrame received;
  do {
    for (std::size_t bus = 0; bus < parts_.network.bus_count(); ++bus) {
      while (parts_.network.bus(bus).receive(received)) {
        for (std::size_t i = 0; i < watches_.size(); ++i) {
          if (parts_.can_drives[i].bus == bus) watches_[i].on_frame(received.frame, received.time_ns);
        }
      }
    }
  } while (parts_.network.wait_for_frame(until_ns));
}

void BusLossSession::go_to(Step step, std::int64_t t_k_ns) noexcept {
  step_ = step;
  since_ns_ = t_k_ns;
  if (step == Step::enabling) {
    asks_for_press_ = false;
    supervisor_.handle(Event::begin);
    bus_.request(fieldbus::DriveGoal::operation_enabled);
  } else if (step == Step::silent) {
    since_ns_ = silence_ns_ = last_word_ns_;
    bus_.request(fieldbus::DriveGoal::none);  // sends no frame; from now on, the drives' reports don't count as faults
  } else if (step == Step::farewell) {
    bus_.request(fieldbus::DriveGoal::none);
    send_nmt(fieldbus::NmtCommand::start);  // restarts drives that have left NMT operational
  }
}

void BusLossSession::send_nmt(fieldbus::NmtCommand command) noexcept {
  for (const fieldbus::DriveSlot& slot : parts_.can_drives) {
    bus_.send(slot.bus, fieldbus::nmt_frame(command, slot.drive->node()));
  }
}

void BusLossSession::ask_the_others() {
  for (const fieldbus::DriveSlot& slot : parts_.can_drives) {
    const fieldbus::DriveState told = slot.drive->state();
    last_states_.push_back(fieldbus::is_switched_off(told) ? told
                                                           : fieldbus::ask_for_states(parts_.network, {&slot, 1})[0]);
  }
}

std::vector<OwnStop> BusLossSession::own_stops() const {
  std::vector<OwnStop> stops;
  if (silence_ns_ < 0 || !done()) return stops;
  for (std::size_t i = 0; i < watches_.size(); ++i) {
    const fieldbus::SilenceWatch& watch = watches_[i];
    const auto after = [this](std::int64_t time_ns) {
      return time_ns < 0 ? -1.0 : 1e-9 * static_cast<double>(time_ns - silence_ns_);
    };
    stops.push_back({parts_.can_drives[i].drive->description().joint, after(watch.reacted_ns()), after(watch.off_ns()),
                     watch.signs(), i < last_states_.size() && fieldbus::is_switched_off(last_states_[i])});
  }
  return stops;
}

}  // namespace proxarm::proof
