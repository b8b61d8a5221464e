#include "controller/library/session.hpp"

#include <chrono>
#include <utility>

#include "controller/command_line/preparation/data_files.hpp"
#include "controller/command_line/preparation/start_check.hpp"
#include "controller/library/session_summary.hpp"
#include "models/base/quantity.hpp"

namespace proxarm {

using command_line::PreparedSession;
using command_line::RunOptions;

namespace {

using SteadyClock = std::chrono::steady_clock;

// Numbers are read as the command line reads them, so that it is one place that says which are taken.
RunOptions run_options(const SessionOptions& given) {
  using description::number_text;
  RunOptions options;
  options.cell = given.cell;
  options.scene = given.scene;
  options.hand = given.hand;
  if (given.mass_kg) options.mass_kg = description::parse_mass(number_text(*given.mass_kg), "--mass");
  if (given.timestep_s) {
    options.period_s = description::parse_duration(number_text(*given.timestep_s) + "s", "--timestep");
  }
  options.duration_s = description::parse_duration(number_text(given.duration_s) + "s", "--duration");
  if (given.damping_Ns_per_m != 0.0) {
    options.damping_Ns_per_m = description::parse_damping(number_text(given.damping_Ns_per_m), "--damping");
  }
  options.settings.spring_N_per_m = description::parse_stiffness(number_text(given.spring_N_per_m), "--spring");
  if (given.order != 1 && given.order != 2) {
    throw SetupError({.key = "--order", .found = std::to_string(given.order), .expected = "1 or 2"});
  }
  options.settings.order = given.order;
  options.lookahead = command_line::LookaheadChoice::parse(given.lookahead, "--lookahead");
  options.force_unstable = given.force_unstable;
  return options;
}

}  // namespace

struct Session::State {
  RunOptions options;
  PreparedSession session;
  controller::OwnParts own;
  std::atomic<bool> stop_asked = false;
  std::exception_ptr thrown;  // by the hand, of which the physics must hear nothing

  // One session's run.
  Summary run(const std::function<void(const CycleRecord&)>& each);
  void guard(sim::HandForce& force);
};

// The simulation's step can't throw.
void Session::State::guard(sim::HandForce& force) {
  if (!force) return;
  force = [this, given = std::move(force)](double time_s, const Vec3& position_W, const Vec3& velocity_W) -> Vec3 {
    if (thrown) return Vec3::Zero();
    try {
      return given(time_s, position_W, velocity_W);
    } catch (...) {
      thrown = std::current_exception();
      return Vec3::Zero();
    }
  };
}

Summary Session::State::run(const std::function<void(const CycleRecord&)>& each) {
  controller::OwnParts parts = own;
  guard(parts.hand);
  thrown = nullptr;
  stop_asked = false;
  controller::SimulatedLoop loop(session, parts);
  controller::SummaryBuilder builder(controller::summary_config(session));
  std::int64_t rendered_ns = 0, exploded_at_ns = -1;
  SteadyClock::duration figures{};
  const SteadyClock::time_point begun = SteadyClock::now();
  const controller::SessionTally tally = loop.run([&](CycleRecord record, const sim::Truth& truth) {
    if (exploded_at_ns < 0 && !controller::is_possible(truth)) exploded_at_ns = truth.time_ns;
    if (exploded_at_ns >= 0 || thrown || stop_asked) loop.cycle().request_stop();
    if (record.phase == controller::Phase::rendering) rendered_ns += record.period_ns;
    const SteadyClock::time_point completes = SteadyClock::now();
    controller::add_truth(record, truth);
    controller::complete(record, session, rendered_ns);
    builder.add(record);
    figures += SteadyClock::now() - completes;
    if (each) each(record);
  });
  if (thrown) std::rethrow_exception(thrown);
  if (exploded_at_ns >= 0) controller::refuse_explosion(1e-9 * static_cast<double>(exploded_at_ns));
  Summary summary = controller::session_summary(builder, loop.cycle(), tally.end,
                                                {.reason = "asked", .text = "by the program"}, session);
  summary.wall_time_s = std::chrono::duration<double>(SteadyClock::now() - begun).count();
  summary.figures_s = std::chrono::duration<double>(figures).count();
  summary.overruns = tally.overruns;
  summary.virtual_time = true;
  if (loop.first_cycle_ns()) summary.first_cycle_s = 1e-9 * static_cast<double>(*loop.first_cycle_ns());
  summary.bus_load = loop.bus_load();
  return summary;
}

Session::Session(const SessionOptions& options) : state_(std::make_unique<State>()) {
  state_->options = run_options(options);
  state_->session = command_line::prepare(state_->options);
  command_line::require_runnable(state_->session, state_->options);
}

Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

Session& Session::set_world(GeometricAlgorithm<3>& world) {
  RunOptions options = state_->options;
  if (!options.scene.empty()) {
    throw SetupError({.key = "--scene", .found = "a world of one's own", .expected = "one of the two"});
  }
  // What the cell has as its scene isn't there then.
  options.scene = command_line::shipped_file("scenes/free.yaml");
  state_->session = command_line::prepare(options);
  command_line::require_runnable(state_->session, options);
  state_->session.scene.name = "a world of one's own";
  state_->own.world = &world;
  controller::require_own_world_fits(state_->session);
  return *this;
}

Session& Session::set_hand(sim::HandForce force) {
  state_->own.hand = std::move(force);
  return *this;
}

Session& Session::set_sensor(controller::MakeSensor make, const std::array<double, 3>& zero_S_N) {
  state_->own.sensor = std::move(make);
  state_->session.settings.zero_S_N = zero_S_N;
  return *this;
}

Session& Session::set_drive(const std::string& joint, controller::MakeDrive make) {
  state_->own.drives[joint] = std::move(make);
  return *this;
}

Summary Session::run(const std::function<void(const CycleRecord&)>& each) { return state_->run(each); }

void Session::stop() noexcept { state_->stop_asked = true; }

const PreparedSession& Session::prepared() const noexcept { return state_->session; }

std::vector<std::string> axis_names(const Session& session) { return controller::joint_names(session.prepared().cell); }

}  // namespace proxarm
