#include "controller/library/session.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "controller/library/led_poses.hpp"
#include "controller/library/paced_run.hpp"
#include "controller/library/session_files.hpp"
#include "controller/library/session_summary.hpp"
#include "controller/live/live_parameters.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/session_loops.hpp"
#include "controller/preparation/start_check.hpp"
#include "controller/preparation/zero_file.hpp"

namespace proxarm {

using controller::PreparedSession;
using controller::RunOptions;

namespace {

using SteadyClock = std::chrono::steady_clock;
using LookAtRecord = std::function<void(const CycleRecord&)>;

PreparedSession prepared_session(const RunOptions& options) {
  PreparedSession session = controller::prepare(options);
  if (const auto kept = controller::kept_zero(session, false)) session.settings.zero_S_N = kept->force_S_N;
  controller::require_runnable(session, options);
  controller::require_changes(session, options);
  controller::require_plot_file(options.plot_file);
  return session;
}

[[noreturn]] void refuse_asking(const std::string& line) {
  throw SetupError({.found = description::in_quotes(line), .expected = "a session that runs to ask it of"});
}

// One session, from power on to power off.
class OneRun {
 public:
  OneRun(const PreparedSession& session, const RunOptions& options, const controller::OwnParts& own);

  // `before` is called before each cycle, `each` after.
  void run(const LookAtRecord& each, const std::function<void()>& before);
  [[nodiscard]] Summary summary();

  [[nodiscard]] controller::Cycle& cycle() noexcept { return loop_.cycle(); }
  [[nodiscard]] const controller::ControlHandlers& handlers() const noexcept { return *handlers_; }

 private:
  void look(CycleRecord record, const sim::Truth& truth, const LookAtRecord& each);
  void place_contacts(CycleRecord& record) const;

  const PreparedSession& session_;
  const RunOptions& options_;
  const OwnWorld* world_;
  const PreparedSession arm_;
  controller::BlackBox box_;
  controller::SimulatedLoop loop_;
  controller::SessionFiles files_;
  controller::SummaryBuilder builder_;
  std::optional<controller::LedPoses> poses_;
  std::optional<controller::ControlHandlers> handlers_;
  controller::PacedRun run_;
  std::int64_t rendered_ns_ = 0;
  SteadyClock::duration figures_{};  // time that the figures took
};

controller::Replay replay_of(const controller::OwnParts& own) {
  const bool replays = own.world == nullptr && !own.sensor && own.drives.empty();
  return replays ? controller::Replay::kept : controller::Replay::none;
}

OneRun::OneRun(const PreparedSession& session, const RunOptions& options, const controller::OwnParts& own)
    : session_(session),
      options_(options),
      world_(dynamic_cast<const OwnWorld*>(own.world)),
      arm_(controller::simulated_arm(session, options)),
      box_(controller::box_size(session, true).period_s, controller::box_size(session, true).frames_per_cycle),
      loop_(session, own, {.arm = &arm_, .faults = options.faults, .enabling = options.enabling}),
      files_(session, options, box_, replay_of(own)),
      builder_(controller::summary_config(session)) {
  if (!session.impedance()) poses_.emplace(session, options, files_.deriver());
  if (files_.keeps_frames()) {
    loop_.network().set_observer(
        [this](const fieldbus::WireFrame& wire) { files_.add_frame(wire.bus_name, wire.frame, wire.end_ns); });
  }
  loop_.start();
  cycle().write_to(box_);
  controller::schedule_changes(cycle(), session, options);
  handlers_ = controller::control_handlers(cycle(), session, options, box_);
}

void OneRun::run(const LookAtRecord& each, const std::function<void()>& before) {
  const auto socket = controller::control_socket(options_, *handlers_);
  run_ = controller::run_at_pace(
      loop_, session_, options_, [&](const CycleRecord& record, const sim::Truth& truth) { look(record, truth, each); },
      [&](std::int64_t) { before(); });
}

void OneRun::look(CycleRecord record, const sim::Truth& truth, const LookAtRecord& each) {
  if (record.phase == controller::Phase::rendering) rendered_ns_ += record.period_ns;
  const SteadyClock::time_point completes = SteadyClock::now();
  controller::add_truth(record, truth);
  box_.add_truth(record.true_tool_W_m, record.true_tool_q_W);
  controller::complete(record, session_, rendered_ns_);
  place_contacts(record);
  builder_.add(record);
  if (poses_) poses_->add(record);
  files_.add(record);
  figures_ += SteadyClock::now() - completes;
  if (each) each(record);
}

// The world still has the contacts of the record's step: each record is seen before the next step.
void OneRun::place_contacts(CycleRecord& record) const {
  if (world_ == nullptr) return;
  const std::span<const Vec3> points_W = world_->contact_points_W();
  const std::size_t count = std::min(points_W.size(), record.recorded_contacts());
  for (std::size_t i = 0; i < count; ++i) record.contacts[i].point_W_m = controller::triple(points_W[i]);
}

Summary OneRun::summary() {
  Summary summary = controller::session_summary(builder_, cycle(), run_.tally.end,
                                                {.reason = "asked", .text = "by the program"}, session_);
  controller::add_idle_orders(summary, cycle(), options_);
  summary.expected_swing = controller::slowest_swing(session_);
  if (poses_) summary.poses = poses_->summary();
  summary.figures_s = std::chrono::duration<double>(figures_).count();
  controller::add_figures(summary, run_, loop_, options_);
  files_.finish(summary);
  return summary;
}

}  // namespace

struct Session::State {
  RunOptions options;
  PreparedSession session;
  controller::OwnParts own;
  std::atomic<bool> stop_asked = false;
  std::exception_ptr thrown;  // by the hand, of which the physics must hear nothing
  std::mutex asking;
  OneRun* running = nullptr;  // guarded by `asking`

  // One session's run.
  Summary run(const LookAtRecord& each);
  void guard(sim::HandForce& force);
  void set_running(OneRun* run) {
    const std::lock_guard<std::mutex> nobody_asks(asking);
    running = run;
  }
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

Summary Session::State::run(const LookAtRecord& each) {
  controller::OwnParts parts = own;
  guard(parts.hand);
  thrown = nullptr;
  stop_asked = false;
  OneRun run(session, options, parts);
  // ask() must not reach a run that has ended, or has thrown.
  struct Running {
    State& state;
    Running(State& of, OneRun& one) : state(of) { state.set_running(&one); }
    ~Running() { state.set_running(nullptr); }
  } heard(*this, run);
  run.run(each, [&] {
    if (thrown || stop_asked) run.cycle().request_stop();
  });
  if (thrown) std::rethrow_exception(thrown);
  return run.summary();
}

Session::Session(const SessionOptions& options) : state_(std::make_unique<State>()) {
  state_->options = run_options(options);
  state_->session = prepared_session(state_->options);
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
  options.scene = controller::shipped_file("scenes/free.yaml");
  state_->session = prepared_session(options);
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

Summary Session::run(const LookAtRecord& each) { return state_->run(each); }

void Session::stop() noexcept { state_->stop_asked = true; }

std::string Session::ask(const std::string& line) {
  const std::lock_guard<std::mutex> it_runs_on(state_->asking);
  if (state_->running == nullptr) refuse_asking(line);
  const controller::ControlHandlers& handlers = state_->running->handlers();
  if (!line.starts_with("status")) controller::require_changeable(state_->session, line);
  if (const std::optional<std::string> done = handlers.order(line)) return *done;
  return handlers.change(line);
}

std::vector<std::string> Session::surprises() const { return controller::surprises(state_->session); }

std::vector<std::string> Session::objects() const {
  if (const auto* const world = dynamic_cast<const OwnWorld*>(state_->own.world)) return world->objects();
  std::vector<std::string> names;
  for (const scenes::Object& object : state_->session.scene.objects) names.push_back(object.name);
  return names;
}

const PreparedSession& Session::prepared() const noexcept { return state_->session; }

std::vector<std::string> axis_names(const Session& session) { return controller::joint_names(session.prepared().cell); }

}  // namespace proxarm
