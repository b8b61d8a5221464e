// Takes requests to the cycle (enabling input, commands, changes of parameters and timestep), and decides when the
// cycle may fulfil them.
#include <cmath>
#include <utility>

#include "controller/cycle/cycle.hpp"

namespace proxarm::controller {
namespace {

// Time from the end of a hold's cause until the arm may move again.
constexpr double clear_of_cause_s = 0.1;

}  // namespace

// ---- when the arm may move

std::uint64_t Cycle::cycles_of(double time_s) const noexcept {
  return static_cast<std::uint64_t>(std::ceil(time_s / settings_.period_s));
}

bool Cycle::may_move() const noexcept {
  return (!parts_.enabling || parts_.enabling->pressed()) &&
         !supervisor_.cause_lasts(state_.cycle, cycles_of(clear_of_cause_s));
}

bool Cycle::stands_in_hold() const noexcept {
  return supervisor_.phase() == Phase::holding && state_.entered_phase == Phase::holding && motion_->stands();
}

void Cycle::supervise_hold(std::int64_t t_k_ns) noexcept {
  if (supervisor_.phase() != Phase::holding || state_.entered_phase != Phase::holding) return;
  if (awaits_rest() && motion_->stands()) start_freeing(std::exchange(state_.awaits_rest, {}));
  if (state_.wants_resume && motion_->stands() && may_move() && !timestep_.under_way()) {
    supervisor_.handle(Event::resume);
  } else if (in_phase_s(t_k_ns) > parts_.supervision.hold_s) {
    supervisor_.give_up_hold();
  }
}

// ---- the enabling input

void Cycle::heed_enabling_input(std::int64_t t_k_ns) noexcept {
  if (!parts_.enabling) return;
  parts_.enabling->on_cycle(t_k_ns);
  const bool anew = parts_.enabling->take_press();
  if (!parts_.enabling->pressed()) {
    state_.wants_resume = false;
    state_.awaits_rest = {};
    timestep_.stay_in_hold();
  }
  if (!anew) return;
  if (supervisor_.phase() == Phase::holding) state_.wants_resume = true;
  if (supervisor_.phase() == Phase::idle) supervisor_.handle(Event::begin);
}

// ---- commands

// Takes a command. If a script's command has no effect, keeps the reason for the report at the end of the session.
void Cycle::take_command(std::int64_t t_k_ns) noexcept {
  Command command;
  if (!requests_.commands.take(t_k_ns - state_.first_cycle_ns, command)) return;
  recorder_.entry().command = command;
  const char* refusal = status_.refusal(command.order);
  state_.awaits_rest = {};  // an order replaces the previous one
  obey(command);
  if (refusal == nullptr && command.order == Order::back_off && supervisor_.phase() != Phase::freeing &&
      !awaits_rest()) {
    refusal = "nothing says which way";
  }
  requests_.commands.note_refusal(refusal);
}

void Cycle::obey(const Command& command) noexcept {
  const Phase phase = supervisor_.phase();
  switch (command.order) {
    case Order::hold:
      if (!motion_->can_hold()) return;
      if (phase == Phase::rendering) supervisor_.hold();
      if (phase == Phase::freeing) supervisor_.handle(Event::freed);
      if (!timestep_.under_way()) return;
      state_.wants_resume = false;
      return timestep_.stay_in_hold();
    case Order::resume:
      if (phase == Phase::holding && may_move()) state_.wants_resume = true;
      return;
    case Order::release:
    case Order::back_off:
      return start_freeing(command);
    case Order::reset:
      if (phase == Phase::faulted && may_move() && !timestep_.under_way()) reset();
      return;
    case Order::none:
      return;
  }
}

// Starts a release or a back-off. The order waits until the arm stands, so that a person who is pinned needn't repeat
// the order.
void Cycle::start_freeing(const Command& command) noexcept {
  if (supervisor_.phase() != Phase::holding || !may_move() || timestep_.under_way()) return;
  state_.wants_resume = false;
  if (!stands_in_hold()) {
    state_.awaits_rest = command;
    return;
  }
  if (motion_->prepare_freeing(command, measurement_.now())) supervisor_.handle(Event::free);
}

void Cycle::reset() noexcept {
  past_faults_.add(supervisor_.report());
  if (supervisor_.escalation().fault != Fault::none) past_faults_.add(supervisor_.escalation());
  supervisor_.reset();
  bus_.forget_faults();
  faults_.forget(bus_.status());
}

// ---- parameters and timestep

void Cycle::take_change() noexcept {
  // A change that was checked for another timestep waits until a due change of the timestep is over.
  const Change* const due = requests_.changes.due(state_.rendered_ns);
  const bool of_another = due != nullptr && due->period_s != 0.0 && due->period_s != settings_.period_s;
  if (of_another && (timestep_.under_way() || requests_.timesteps.due(state_.rendered_ns) != nullptr)) return;
  Change change;
  if (!requests_.changes.take(state_.rendered_ns, change)) return;
  recorder_.entry().change = change;
  timestep_.wait_again();
  if (change.period_s != 0.0 && change.period_s != settings_.period_s) {
    return requests_.changes.note_refusal("the timestep that it was checked for wasn't taken");
  }
  // A proxy's mass may have been computed for tool figures that were refused later. It is corrected, so that the felt
  // mass is the intended one.
  const double tool_kg = tool_.wanted().mass_kg;
  if (change.parameter == Parameter::mass && change.tool_mass_kg > 0.0 && change.tool_mass_kg != tool_kg) {
    change.value += change.tool_mass_kg - tool_kg;
  }
  if (change.parameter == Parameter::tool) {
    if (const char* const refusal = take_tool(change)) return requests_.changes.note_refusal(refusal);
  } else {
    motion_->set(change);
  }
  look_ahead(change.parameter == Parameter::lookahead ? change.value : change.horizon_s);
}

// Takes the tool's new figures. Returns the reason if the figures can't be true and aren't taken; else nullptr.
const char* Cycle::take_tool(const Change& change) noexcept {
  const HeldTool now = tool_.wanted();
  const HeldTool wanted{change.tool_mass_kg, models::Vec3(change.position_m.data()), now.handle_S};
  const ToolEvidence seen = measurement_.tool_evidence(now, settings_);
  const ToolDoubt doubt = seen.doubt(now, wanted);
  if (doubt.why != ToolDoubt::Why::none) return ToolDoubt::text(doubt.why);
  tool_.take(wanted, seen.change(now, wanted));
  motion_->hang(change.value, tool_.about_T(wanted));
  return nullptr;
}

void Cycle::fade_tool() noexcept {
  const bool stands_by = state_.entered_phase == Phase::rendering || state_.entered_phase == Phase::holding;
  if (!stands_by || !tool_.step(settings_.period_s)) return;
  measurement_.set_tool(tool_.present());
  carry_tool();
}

// Sets the tool's present figures in the models of arm and hand.
void Cycle::carry_tool() noexcept {
  const HeldTool& present = tool_.present();
  parts_.arm->set_tool(present.mass_kg, present.centre_S);
  motion_->carry(present, tool_.about_T(present));
}

void Cycle::take_timestep() noexcept {
  const Phase phase = supervisor_.phase();
  if ((phase != Phase::rendering && phase != Phase::holding) || timestep_.under_way()) return;
  Timestep wanted;
  if (!requests_.timesteps.take(state_.rendered_ns, wanted)) return;
  recorder_.entry().timestep = wanted;
  if (wanted.period_s == settings_.period_s || !plausible(wanted) || status_.keeps_timestep()) return;
  timestep_.begin(timestep_of(settings_), wanted, phase == Phase::rendering || state_.wants_resume, alarm_);
  if (phase == Phase::rendering) supervisor_.hold();
}

void Cycle::change_timestep(std::int64_t t_k_ns) noexcept {
  const TimestepChange::Surroundings surroundings{.held = supervisor_.phase() == Phase::holding,
                                                  .stands = stands_in_hold()};
  const TimestepChange::Step step = timestep_.step(t_k_ns, surroundings, alarm_, recorder_.record());
  if (step.now) apply(*step.now);
  if (step.resumes) state_.wants_resume = true;
}

}  // namespace proxarm::controller
