#include "controller/extras/commissioning/proof_run.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "controller/extras/commissioning/arm_at_hand.hpp"
#include "controller/live/hardware_consent.hpp"
#include "controller/live/realtime.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/start_check.hpp"
#include "models/base/text.hpp"

namespace proxarm::command_line {
namespace {

using proof::Asked;

ProofOutcome outcome_of(const proof::ProofSession& session) {
  ProofOutcome outcome{session.readings(), session.complete(), session.not_pushed(), {}, session.slipped_rad(), false};
  outcome.fault = session.fault();
  return outcome;
}

// Runs cycles until the proof ends. If the process slept through some periods, they are skipped, and the proof ends,
// because by then the drives have stopped by themselves or are about to.
template <typename BeforeCycle>
void run(proof::ProofSession& proof, fieldbus::CanNetwork& network, double period_s, const BeforeCycle& before) {
  const std::int64_t period_ns = std::llround(1e9 * period_s);
  std::int64_t t_k_ns = network.now_ns() + period_ns;
  while (!proof.done()) {
    network.sleep_until(t_k_ns);
    before();
    proof.run_cycle(t_k_ns);
    if (proof.needs_plan()) proof.begin_plan();
    t_k_ns += period_ns;
    const std::int64_t late_ns = network.now_ns() - t_k_ns;
    if (late_ns <= 0) continue;
    t_k_ns += (late_ns / period_ns + 1) * period_ns;
    if (late_ns > 10 * period_ns) proof.request_stop();
  }
  proof.shut_down();
}

// Pushes the simulated arm's handle in the requested direction while the proof asks for it.
class SimulatedHand {
 public:
  explicit SimulatedHand(sim::SimulatedCell& arm) : arm_(arm) {}

  void heed(const proof::ProofSession& proof) {
    const bool asked = proof.asked() == Asked::push || pushed_at_ == proof.station();
    const bool pushes = proof.asked() != Asked::let_go && asked && proof.station() < proof.stations().size();
    if (!pushes) return arm_.plant().set_clamp({});
    if (pushed_at_ != proof.station()) {
      pushed_at_ = proof.station();
      from_W_ = arm_.truth().X_WT.translation();
    }
    const models::Vec3& along_W = proof.stations()[proof.station()].push_W;
    arm_.plant().set_clamp(along_W.isZero() ? sim::Clamp{} : sim::leaning(from_W_, along_W));
  }

 private:
  sim::SimulatedCell& arm_;
  std::size_t pushed_at_ = static_cast<std::size_t>(-1);
  models::Vec3 from_W_ = models::Vec3::Zero();
};

// Prints the proof's requests in a separate thread, so that the cycle doesn't wait for a terminal.
class Announcer {
 public:
  Announcer(const proof::ProofSession& proof) : proof_(proof), thread_([this] { loop(); }) {}
  Announcer(const Announcer&) = delete;
  Announcer& operator=(const Announcer&) = delete;
  ~Announcer() {
    ended_ = true;
    thread_.join();
  }

 private:
  void loop() {
    Asked before = Asked::nothing;
    while (!ended_) {
      const Asked asked = proof_.asked();
      if (asked != before) say(asked);
      before = asked;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  void say(Asked asked) const {
    if (asked == Asked::press) std::fprintf(stderr, "let go of the enabling switch, then press it and keep it so\n");
    if (asked == Asked::let_go) std::fprintf(stderr, "  that's it: take the hand off\n");
    if (asked != Asked::push) return;
    const models::Vec3& along = proof_.stations()[proof_.station()].push_W;
    std::fprintf(stderr, "push the handle along +%s of the world W, by some 15 N, and keep it so\n",
                 along.x() > 0.5 ? "x" : "y");
  }

  const proof::ProofSession& proof_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace

std::string failure_of(const controller::PreparedSession& session, const ProofOutcome& outcome) {
  using controller::Fault;
  if (outcome.fault.fault != Fault::none) {
    const bool of_joint = outcome.fault.where >= 0;
    const std::string where =
        of_joint ? session.cell.drives[static_cast<std::size_t>(outcome.fault.where) % session.cell.drives.size()].joint
                 : controller::standing_force_text(outcome.fault, session.cell.gravity_W_m_per_s2);
    return controller::describe(outcome.fault, where);
  }
  if (outcome.not_pushed) return "nobody pushed, or took the hand off again, within a minute";
  if (!outcome.complete) return "the session ended before all was read";
  if (!outcome.slipped_rad) return "the brakes were never seen closed";
  if (*outcome.slipped_rad <= session.cell.limits.following_error_rad) return "";
  return "the brakes don't hold: a joint moved by " + description::rounded_text(*outcome.slipped_rad) +
         " rad in a second without power";
}

ProofOutcome prove_simulated(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                             const controller::RunOptions& options, const proof::Task& task) {
  SimulatedArm simulated(arm, options, options.hand.empty() ? nobody() : arm.hand);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  proof::ProofSession proof(simulated.brought_up(session, scene), session.settings, session.cell, task);
  SimulatedHand hand(simulated.far_end);
  run(proof, simulated.network, session.settings.period_s, [&] { hand.heed(proof); });
  return outcome_of(proof);
}

ProofOutcome prove_on_interfaces(const controller::PreparedSession& session, const controller::RunOptions& options,
                                 const proof::Task& task) {
  ArmOnInterfaces arm(session, options);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  proof::ProofSession proof(arm.brought_up(session, scene), session.settings, session.cell, task);
  controller::SignalWatch signals([&] { proof.request_stop(); });
  {
    const Announcer announcer(proof);
    const controller::RealtimeThread realtime;
    run(proof, arm.network, session.settings.period_s, [] {});
  }
  ProofOutcome outcome = outcome_of(proof);
  outcome.real_arm = controller::is_real(session, arm.interfaces);
  return outcome;
}

controller::PreparedSession session_to_prove(const controller::RunOptions& options, const std::filesystem::path& arm,
                                             PrepareSession prepare) {
  controller::require_interface_for_hardware(options);
  if (!options.bus.simulated()) controller::refuse_simulated_options(options, arm);
  controller::PreparedSession session = prepare(options);
  controller::require_enabling_switch(session, options);
  controller::require_carried(session, options);
  return session;
}

controller::PreparedSession arm_to_prove(const controller::RunOptions& options, const std::filesystem::path& arm,
                                         PrepareSession prepare) {
  controller::RunOptions of_arm = options;
  if (!arm.empty()) of_arm.cell = arm;
  return prepare(of_arm);
}

ProofOutcome prove_arm(const controller::PreparedSession& session, const controller::RunOptions& options,
                       const std::filesystem::path& arm, PrepareSession prepare, const proof::Task& task) {
  if (!options.bus.simulated()) return prove_on_interfaces(session, options, task);
  return prove_simulated(session, arm_to_prove(options, arm, prepare), options, task);
}

}  // namespace proxarm::command_line
