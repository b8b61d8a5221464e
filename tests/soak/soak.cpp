// Hours of simulated time, session after session in one process, each with something that fails every few seconds: most
// of it is to be ridden through, some of it stops the arm until a person resets it, some of it ends the session, and
// the next one is the recovery.
//
//   soak [--hours H] [--seed N] [--checkpoint FILE]
// After each session the state goes to FILE; a soak that finds one goes on behind it, and ends as one that was never
// interrupted: each session follows from the seed and its number alone. Ends with status 1, and the session's number,
// where a session doesn't end, ends for no reason, leaves drives on, loses time, commands a joint beyond its speed or
// acceleration, where memory grows, or where a session that is repeated every hour commands anything else than before.
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::RigOptions;
using tests::Random;

// FNV-1a over setpoints: the same number, the same motion.
struct Digest {
  std::uint64_t value = 14695981039346656037u;
  void add(const CycleRecord& record) {
    for (std::size_t i = 0; i < record.axes; ++i) {
      value = (value ^ static_cast<std::uint32_t>(record.target_counts[i])) * 1099511628211u;
    }
  }
};

struct State {
  std::uint64_t seed = 1, sessions = 0, cycles = 0;
  double simulated_s = 0.0;
  std::uint64_t ridden_through = 0;           // faults after which the session went on
  std::uint64_t resets = 0;                   // faults that stopped the arm, and were reset
  std::uint64_t reference = 0;                // digest of the session that is repeated; 0: not run yet
  Digest digest;                              // of all others
  std::map<std::string, std::uint64_t> ends;  // sessions by the fault that ended them
};

// What was injected into a session, and as what it may be told: a fault by another name, or at another time, is a false
// alarm, though one of its name was to come.
struct Injected {
  std::vector<Fault> faults;
  double from_s = 0.0, until_s = 0.0;  // since power on
};

// Nothing where there is no such file.
std::optional<State> restored(const std::string& file) {
  std::ifstream in(file);
  if (file.empty() || !in) return std::nullopt;
  State state;
  if (!(in >> state.seed >> state.sessions >> state.cycles >> state.simulated_s >> state.ridden_through >>
        state.resets >> state.reference >> state.digest.value)) {
    throw std::runtime_error(file + ": not a soak's checkpoint");
  }
  std::string name;
  std::uint64_t count = 0;
  while (in >> name >> count) state.ends[name] = count;
  return state;
}

void keep(const std::string& file, const State& state) {
  if (file.empty()) return;
  {
    std::ofstream out(file + ".new");
    out.precision(std::numeric_limits<double>::max_digits10);
    out << state.seed << ' ' << state.sessions << ' ' << state.cycles << ' ' << state.simulated_s << ' '
        << state.ridden_through << ' ' << state.resets << ' ' << state.reference << ' ' << state.digest.value << '\n';
    for (const auto& [name, count] : state.ends) out << name << ' ' << count << '\n';
    if (!out.flush()) throw std::runtime_error(file + ".new: can't be written");
  }
  if (std::rename((file + ".new").c_str(), file.c_str()) != 0) throw std::runtime_error(file + ": can't be replaced");
}

#ifdef PROXARM_SANITIZED
constexpr bool judges_memory = false;  // a sanitizer keeps what is freed
#else
constexpr bool judges_memory = true;
#endif

double heap_MB() { return 1e-6 * static_cast<double>(mallinfo2().uordblks); }

double resident_MB() {
  std::ifstream in("/proc/self/statm");
  double all = 0.0, resident = 0.0;
  in >> all >> resident;
  return resident * 4096e-6;
}

// To and fro, into the wall and along it, for as long as the session may last.
std::string wandering_hand(const tests::ScratchFolder& folder, Random& random, double duration_s,
                           double stiffness_N_per_m) {
  const std::string file = folder / "hand.yaml";
  std::ofstream out(file);
  out << "name: wanders\nmass_kg: 1\nstiffness_N_per_m: " << stiffness_N_per_m
      << "\ndamping_Ns_per_m: 20\nwaypoints:\n  - {time_s: 0.5, offset_m: [0, 0, 0]}\n";
  for (double time_s = 2.0; time_s < duration_s; time_s += random.uniform(0.8, 3.0)) {
    out << "  - {time_s: " << time_s << ", offset_m: [" << random.uniform(-0.1, 0.24) << ", "
        << random.uniform(-0.2, 0.2) << ", " << random.uniform(-0.1, 0.1) << "]}\n";
  }
  return file;
}

struct Session {
  RigOptions options;
  std::uint64_t harmless = 0;  // faults that mustn't end it
  std::vector<Injected> injected;
  bool ends = false;      // whether one of them is to end it
  double pauses_s = 0.0;  // for which it may be held, at most
  double hand_N_per_m = 0.0;
};

std::string span_of(const char* fault, double from_s, double duration_s) {
  return std::string(fault) + "@" + std::to_string(from_s) + "s.." + std::to_string(from_s + duration_s) + "s";
}

// Up to two lost frames, a sensor that stands still or is silent for two cycles.
void add_brief_fault(Session& session, Random& random, double t) {
  constexpr std::array brief{"sensor:frozen", "sensor:samples", "sensor:half"};
  ++session.harmless;
  if (random.chance(0.5)) {
    session.options.script.rules.push_back({.action = fieldbus::FaultAction::drop,
                                            .from_ns = static_cast<std::int64_t>(1e9 * t),
                                            .count = static_cast<std::uint64_t>(1 + random.below(2)),
                                            .receiver = "controller"});
  } else {
    session.options.device_faults.push_back(span_of(brief[random.below(brief.size())], t, 0.002));
  }
}

// A few times, as a person does until it is heard: an order is dropped while a cause lasts.
void order(Session& session, double t, Command command) {
  for (const double later_s : {0.0, 0.3, 0.6}) {
    session.options.commands.push_back({static_cast<std::int64_t>(1e9 * (t + later_s)), command});
  }
}

// A device fails for a second, and what that may be told as: within five cycles at 4 ms, or while it lasts where
// nothing moved at first.
struct Failure {
  const char* device_fault;
  Fault fault;
};

void inject(Session& session, const Failure& failure, double t) {
  session.options.device_faults.push_back(span_of(failure.device_fault, t, 1.0));
  // A drive that was without power, or heard nothing, isn't operational any more: it is silent at every reset of the
  // session, which doesn't set drives up anew.
  const double until_s = failure.fault == Fault::drive_silent ? std::numeric_limits<double>::infinity() : t + 1.05;
  session.injected.push_back({{failure.fault}, t, until_s});
  // Who says nothing doesn't say that it is off, either; a second after the stop.
  if (failure.fault == Fault::drive_silent) session.injected.push_back({{Fault::drive_not_disabled}, t, until_s + 1.0});
}

// Stops the arm by a fault that goes away; a reset and a resume later it moves again.
void add_reset(Session& session, Random& random, double t) {
  constexpr std::array passing{
      Failure{"sensor:silent", Fault::sensor_lost}, Failure{"sensor:status=0x4000", Fault::sensor_status},
      Failure{"axis_3:fault=0x4210", Fault::drive_fault}, Failure{"axis_6:fault=0x4210", Fault::drive_fault}};
  inject(session, passing[random.below(passing.size())], t);
  order(session, t + 1.4, {Order::reset});
  order(session, t + 2.8, {Order::resume});
  session.pauses_s += 5.0;
}

// A hold by order, out of which the tool backs off, or is let go, or neither.
void add_hold(Session& session, Random& random, double t) {
  order(session, t, {Order::hold});
  if (random.chance(0.6)) {
    const bool backs_off = random.chance(0.5);
    order(session, t + 1.0,
          {backs_off ? Order::back_off : Order::release, backs_off ? random.uniform(0.001, 0.02) : 0.0});
    order(session, t + 2.2, {Order::hold});
  }
  order(session, t + 3.4, {Order::resume});
  session.pauses_s += 5.0;
}

// A CAN message's bit as enabling input, let go now and then: a hold each.
void add_enabling_input(Session& session, Random& random) {
  session.options.edit_cell = [](description::Cell& cell) {
    description::EnablingInputDescription input;
    input.bus = "sensor";
    input.identifier = 0x1A0;
    cell.enabling_input = input;
  };
  double from_s = 0.1;
  while (from_s < 2.0 * session.options.duration_s) {
    const double until_s = from_s + random.uniform(3.0, 15.0);
    session.options.enabling.push_back(
        {static_cast<std::int64_t>(1e9 * from_s), static_cast<std::int64_t>(1e9 * until_s)});
    from_s = until_s + random.uniform(0.2, 2.0);
    session.pauses_s += 2.5;
  }
  session.options.enabling.back().until_ns = std::numeric_limits<std::int64_t>::max();
}

// Every five to thirty seconds another timestep, or the same again.
void add_timesteps(Session& session, Random& random) {
  constexpr std::array periods_s{1e-3, 2e-3, 4e-3};
  for (double t = 3.0; t < session.options.duration_s; t += random.uniform(5.0, 30.0)) {
    const Timestep to{.period_s = periods_s[random.below(3)], .max_missed_samples = 3, .max_repeated_samples = 20};
    session.options.timesteps.push_back({static_cast<std::int64_t>(1e9 * t), to});
    session.pauses_s += 0.5;
  }
}

// Something every two to eight seconds that is ridden through. In a third of the sessions a person holds and resets, in
// another the enabling input is let go; and in a third of all something ends them.
Session session_of(const tests::ScratchFolder& folder, Random& random) {
  constexpr std::array scenes{"wall", "groove", "room", "free", "moving_plate", "honey"};
  constexpr std::array grave{
      Failure{"sensor:silent", Fault::sensor_lost}, Failure{"sensor:status=0x4000", Fault::sensor_status},
      Failure{"axis_3:fault=0x4210", Fault::drive_fault}, Failure{"axis_2:silent", Fault::drive_silent},
      Failure{"axis_5:power", Fault::drive_silent}};
  Session session;
  RigOptions& o = session.options;
  o.duration_s = random.chance(0.9) ? random.uniform(10.0, 60.0) : random.log_uniform(60.0, 1200.0);
  o.scene = std::string("scenes/") + scenes[random.below(scenes.size())] + ".yaml";
  const int kind = random.below(3);
  // Where the arm is held, the hand moves on without it: by up to 0.5 m, and 200 N are a fault.
  // A wall holds it, too, 0.33 m before where it wants to be: at 550 N/m that is 180 N.
  session.hand_N_per_m = std::min(550.0, random.log_uniform(200.0, kind == 2 ? 800.0 : 300.0));
  o.hand = wandering_hand(folder, random, o.duration_s, session.hand_N_per_m);
  o.settings.mass_kg = random.uniform(4.0, 12.0);
  o.settings.order = random.chance(0.3) ? 2 : 1;
  o.settings.passivity = random.chance(0.5) ? Passivity::on : Passivity::off;
  for (double t = 2.0; t < o.duration_s; t += random.uniform(2.0, 8.0)) add_brief_fault(session, random, t);
  for (std::uint64_t cycle = 1000; cycle < 20'000; cycle += static_cast<std::uint64_t>(500 + random.below(5000))) {
    o.changes.push_back({static_cast<std::int64_t>(cycle) * 1'000'000, {Parameter::mass, random.uniform(3.8, 12.0)}});
  }
  if (kind == 0) {
    o.settings.wait_after_fault_s = 4.0;
    for (double t = 3.0; t < o.duration_s; t += random.uniform(7.0, 20.0)) {
      random.chance(0.5) ? add_reset(session, random, t) : add_hold(session, random, t);
    }
  } else if (kind == 1) {
    add_enabling_input(session, random);
  }
  session.ends = random.chance(0.33);
  if (session.ends) {
    const double t = random.uniform(3.0, o.duration_s);
    inject(session, grave[random.below(grave.size())], t);
  }
  Random apart = random;  // what was added later leaves all else of a seed's sessions as it was
  if (apart.chance(0.3)) add_timesteps(session, apart);
  if (apart.chance(0.6)) o.settings.passivity = Passivity::automatic;  // the default of the program
  return session;
}

const char* passivity_name(Passivity passivity) {
  return passivity == Passivity::on ? "on" : passivity == Passivity::automatic ? "auto" : "off";
}

// Sees every record of a session, and what is wrong with them.
class Watch {
 public:
  // `injected`: faults with these may be told; any other is a false alarm.
  Watch(const ClosedLoopRig& rig, const std::vector<Injected>& injected, bool enabling)
      : rig_(rig), injected_(injected), enabling_(enabling) {}

  void see(const CycleRecord& record, std::int64_t now_ns, Digest& digest) {
    digest.add(record);
    judge_fault(record, 1e-9 * static_cast<double>(now_ns));
    if (seen_ >= 2) judge_motion(record);
    k2_ = k1_;
    k1_ = record;
    if (record.phase == Phase::rendering) rendered_ = record;
    ++seen_;
    seen_ns_ += record.period_ns;
    // After the hand's first ten seconds nothing more is wanted from the heap.
    if (seen_ == heap_every) base_MB_ = heap_MB();
    if (judges_memory && seen_ % heap_every == 0 && heap_MB() > base_MB_ + 1.0) {
      wrong_ = "the heap grows while it runs: from " + std::to_string(base_MB_) + " to " + std::to_string(heap_MB()) +
               " MB in " + std::to_string(seen_) + " cycles";
    }
  }
  [[nodiscard]] std::uint64_t seen() const { return seen_; }
  // Their time, as it was planned.
  [[nodiscard]] double seen_s() const { return 1e-9 * static_cast<double>(seen_ns_); }
  [[nodiscard]] const std::string& wrong() const { return wrong_; }
  // For whoever looks into what went wrong.
  [[nodiscard]] std::string last_state(const Session& session) const {
    char text[128];
    std::snprintf(text, sizeof text, ", a hand of %.4g N/m, %.4g kg, %.4g ms, order %d, passivity %s",
                  session.hand_N_per_m, rendered_.proxy_mass_kg + rig_.cell.tool.mass_kg,
                  1e-6 * static_cast<double>(rendered_.period_ns), session.options.settings.order,
                  passivity_name(session.options.settings.passivity));
    return session.options.scene + text;
  }

 private:
  static constexpr std::uint64_t heap_every = 10'000;  // cycles

  // As in the property test of whole sessions; the setpoint of a drive that is off by itself follows it.
  void judge_motion(const CycleRecord& record) {
    const std::array<const CycleRecord*, 3> three{&k2_, &k1_, &record};
    for (const CycleRecord* r : three) {
      if (r->phase < Phase::rendering || r->phase > Phase::stopping) return;
    }
    for (std::size_t axis = 0; axis < record.axes; ++axis) {
      bool follows = false;
      for (const CycleRecord* r : three) {
        follows |= r->target_counts[axis] == r->actual_counts[axis];
      }
      if (follows || testing::step_within_limits(rig_, axis, k2_, k1_, record)) continue;
      wrong_ = rig_.cell.drives[axis].joint + " beyond its limits in cycle " + std::to_string(record.cycle);
    }
  }

  // The fault that stops the arm, or that it is held for, reset ones and released switches included.
  void judge_fault(const CycleRecord& record, double now_s) {
    for (const auto& [fault, before] : {std::pair(record.fault, k1_.fault), std::pair(record.held_for, k1_.held_for)}) {
      if (fault == Fault::none || fault == before) continue;
      if (fault == Fault::enabling_released && enabling_) continue;
      const auto explains = [&, fault = fault](const Injected& i) {
        return std::find(i.faults.begin(), i.faults.end(), fault) != i.faults.end() && now_s > i.from_s &&
               now_s < i.until_s;
      };
      if (std::any_of(injected_.begin(), injected_.end(), explains)) continue;
      wrong_ = std::string(fault_name(fault)) + " at " + std::to_string(now_s) + " s, in cycle " +
               std::to_string(record.cycle) + ", by which nothing failed";
    }
  }

  const ClosedLoopRig& rig_;
  const std::vector<Injected>& injected_;
  bool enabling_;                   // a switch is let go now and then
  CycleRecord k1_, k2_, rendered_;  // the last two, and the last of rendering
  std::uint64_t seen_ = 0;
  std::int64_t seen_ns_ = 0;
  double base_MB_ = 0.0;
  std::string wrong_;
};

// A fault that the session went on with, by which nothing failed; samples and feedback are lost in all of them.
Fault false_notice(const Supervisor& supervisor, const Session& session) {
  for (std::size_t i = 1; i < fault_count; ++i) {
    const auto fault = static_cast<Fault>(i);
    if (supervisor.notice(fault).times == 0 || fault == Fault::sensor_late || fault == Fault::feedback_late) continue;
    const auto names = [&](const Injected& injected) {
      return std::find(injected.faults.begin(), injected.faults.end(), fault) != injected.faults.end();
    };
    if (std::any_of(session.injected.begin(), session.injected.end(), names)) continue;
    if (fault != Fault::enabling_released || session.options.enabling.empty()) return fault;
  }
  return Fault::none;
}

// What is wrong with it; empty: nothing.
std::string run(const Session& session, State& state, Digest& digest) {
  ClosedLoopRig rig(session.options);
  Cycle cycle(rig.prepared_parts(rig.network), session.options.settings, rig.cell.limits, 64);
  cycle.changes().schedule(session.options.changes);
  cycle.commands().schedule(session.options.commands);
  cycle.timesteps().schedule(session.options.timesteps);
  Watch watch(rig, session.injected, !session.options.enabling.empty());
  CycleRecord record;
  std::int64_t begun_ns = 0;
  constexpr double longest_period_s = 4e-3;
  const double patience_s = session.options.duration_s + session.pauses_s + 10.0;
  const SessionHooks hooks{[&](std::int64_t t_k_ns) {
                             if (watch.seen() == 0) begun_ns = t_k_ns;
                           },
                           [&] {
                             while (cycle.records().pop(record)) watch.see(record, rig.network.now_ns(), digest);
                             if (watch.seen_s() > patience_s) cycle.request_stop();
                           }};
  const SessionTally tally = run_session(cycle, rig.network, {session.options.duration_s}, hooks);
  const double elapsed_s = 1e-9 * static_cast<double>(rig.network.now_ns() - begun_ns);
  const Fault fault = cycle.supervisor().report().fault;
  const double rendered_s = 1e-9 * static_cast<double>(cycle.rendered_ns());
  std::string wrong = watch.wrong();
  if (!wrong.empty()) {
  } else if (elapsed_s - watch.seen_s() > 2.0 * longest_period_s) {
    wrong = "time was lost";
  } else if (fault != Fault::none && !session.ends) {
    wrong = "ended by " + describe(cycle.supervisor().report(), "");
  } else if (const Fault noticed = false_notice(cycle.supervisor(), session); noticed != Fault::none) {
    wrong = std::string("noticed ") + fault_name(noticed) + ", which nothing explains";
  } else if (fault == Fault::none && session.ends && session.options.settings.wait_after_fault_s == 0.0) {
    wrong = "not ended by what was to end it";
  } else if (!cycle.drives_off() && fault != Fault::drive_silent) {
    wrong = "drives that are still on";
  } else if (fault == Fault::none && rendered_s < session.options.duration_s - longest_period_s) {
    wrong = "it rendered for " + std::to_string(rendered_s) + " s of " + std::to_string(session.options.duration_s);
  }
  if (!wrong.empty()) wrong += "; " + watch.last_state(session);
  cycle.shut_down();
  rig.network.sleep_until(rig.network.now_ns() + 100'000'000);
  ++state.sessions;
  state.cycles += tally.cycles;
  state.simulated_s += elapsed_s;
  state.resets += cycle.past_fault_count();
  if (fault == Fault::none) state.ridden_through += session.harmless;
  ++state.ends[fault_name(fault)];
  return wrong;
}

// The same session every hour: what earlier ones leave behind in the process, it would show.
std::string run_reference(const tests::ScratchFolder& folder, State& state) {
  Random random(state.seed);
  Session session = session_of(folder, random);
  session.options.duration_s = 10.0;
  State apart;
  Digest digest;
  const std::string wrong = run(session, apart, digest);
  if (!wrong.empty()) return "the repeated session: " + wrong;
  if (state.reference == 0) state.reference = digest.value;
  return state.reference == digest.value ? "" : "the repeated session commanded something else than at first";
}

// Bounds on what is left when a session has ended: 8 MB resident is some hundred times what sessions differ by.
class Memory {
 public:
  // After each session; what is wrong with it.
  std::string judge() {
    malloc_trim(0);
    const double now = resident_MB(), heap = heap_MB();
    ++sessions_;
    if (sessions_ == warm_up) base_ = now, base_heap_ = heap;
    if (sessions_ >= warm_up) most_ = std::max(most_, now);
    const bool grown = now > base_ + most_growth_MB || heap > base_heap_ + 1.0;
    if (!judges_memory || sessions_ <= warm_up || !grown) return "";
    return "memory has grown from " + std::to_string(base_) + " to " + std::to_string(now) +
           " MB, the heap in use from " + std::to_string(base_heap_) + " to " + std::to_string(heap) + " MB";
  }
  void print() const {
    std::printf("memory: %.1f MB, at most %.1f; the heap in use %.2f MB, %.2f now\n", base_, most_, base_heap_,
                heap_MB());
  }

 private:
  static constexpr double most_growth_MB = 8.0;
  static constexpr std::uint64_t warm_up = 3;  // sessions; libraries and the heap's own tables have grown by then
  std::uint64_t sessions_ = 0;
  double base_ = 0.0, most_ = 0.0, base_heap_ = 0.0;
};

void print(const State& state) {
  std::printf("%.3f h simulated, %llu sessions, %llu cycles, %llu faults ridden through, %llu reset\n",
              state.simulated_s / 3600.0, static_cast<unsigned long long>(state.sessions),
              static_cast<unsigned long long>(state.cycles), static_cast<unsigned long long>(state.ridden_through),
              static_cast<unsigned long long>(state.resets));
  std::fflush(stdout);
}

int soak(double hours, const std::string& file, State state) {
  const tests::ScratchFolder folder;
  Memory memory;
  const auto hour = [&] { return static_cast<std::uint64_t>(state.simulated_s / 3600.0); };
  bool repeats = true;
  while (state.simulated_s < 3600.0 * hours) {
    const std::uint64_t number = state.sessions, hour_before = hour();
    std::string wrong = repeats ? run_reference(folder, state) : "";
    Random random(1'000'003 * state.seed + number);
    if (wrong.empty()) wrong = run(session_of(folder, random), state, state.digest);
    if (wrong.empty()) wrong = memory.judge();
    if (!wrong.empty()) {
      std::printf("session %llu of seed %llu: %s\n", static_cast<unsigned long long>(number),
                  static_cast<unsigned long long>(state.seed), wrong.c_str());
      return 1;
    }
    keep(file, state);
    repeats = hour() > hour_before;
    if (!repeats) continue;
    print(state);
    memory.print();
  }
  print(state);
  for (const auto& [fault, sessions] : state.ends) {
    std::printf("  %s: %llu\n", fault.c_str(), static_cast<unsigned long long>(sessions));
  }
  std::printf("setpoints: %016llx\n", static_cast<unsigned long long>(state.digest.value));

  return 0;
}

int main_of(int argc, char** argv) {
  CLI::App app{"Hours of simulated time with faults and recoveries, judged."};
  double hours = 0.08;
  std::string file;
  State fresh;
  app.add_option("--hours", hours, "of simulated time, those of the checkpoint included")
      ->check(CLI::Range(0.0, 1e5))
      ->capture_default_str();
  const CLI::Option* seed = app.add_option("--seed", fresh.seed)->capture_default_str();
  app.add_option("--checkpoint", file, "kept here after each session; one that is there is gone on with");
  CLI11_PARSE(app, argc, argv);
  const State state = restored(file).value_or(fresh);
  if (seed->count() > 0 && state.seed != fresh.seed) {
    throw std::runtime_error(file + " is of seed " + std::to_string(state.seed));
  }
  return soak(hours, file, state);
}

}  // namespace
}  // namespace proxarm::controller

int main(int argc, char** argv) {
  try {
    return proxarm::controller::main_of(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "soak: %s\n", error.what());
    return 2;
  }
}
