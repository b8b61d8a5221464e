// Hours of simulated time, session after session in one process, each with something that fails every few seconds: most
// of it is to be ridden through, some of it ends a session, and the next one is the recovery.
//
//   soak --hours H [--checkpoint FILE] [--seed N]
// After each session the state goes to FILE; a soak that finds one goes on behind it. Ends with status 1, and the
// session's number, where a session doesn't end, ends for no reason, leaves drives on, loses time, commands a joint
// beyond its speed, or where memory grows.
#include <malloc.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>

#include "tests/controller/closed_loop_rig.hpp"
#include "tests/models/random_states.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::RigOptions;
using tests::Random;

struct State {
  std::uint64_t seed = 1, sessions = 0, cycles = 0;
  double simulated_s = 0.0;
  std::uint64_t ridden_through = 0;           // faults after which the session went on
  std::map<std::string, std::uint64_t> ends;  // sessions by the fault that ended them
};

State restored(const std::string& file, std::uint64_t seed) {
  State state;
  state.seed = seed;
  std::ifstream in(file);
  if (!(in >> state.seed >> state.sessions >> state.cycles >> state.simulated_s >> state.ridden_through)) {
    State fresh;
    fresh.seed = seed;
    return fresh;
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
    out << state.seed << ' ' << state.sessions << ' ' << state.cycles << ' ' << state.simulated_s << ' '
        << state.ridden_through << '\n';
    for (const auto& [name, count] : state.ends) out << name << ' ' << count << '\n';
  }
  std::rename((file + ".new").c_str(), file.c_str());
}

double resident_MB() {
  std::ifstream in("/proc/self/statm");
  double all = 0.0, resident = 0.0;
  in >> all >> resident;
  return resident * 4096e-6;
}

// To and fro, into the wall and along it, for as long as the session may last.
std::string wandering_hand(const tests::ScratchFolder& folder, Random& random, double duration_s) {
  const std::string file = folder / "hand.yaml";
  std::ofstream out(file);
  out << "name: wanders\nmass_kg: 1\nstiffness_N_per_m: " << random.log_uniform(200.0, 800.0)
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
  bool ends = false;           // whether one may
};

// Something every two to eight seconds: up to two lost frames, a sensor that stands still or is silent for two cycles.
// In a third of the sessions, one more that can't be ridden through.
Session session_of(const tests::ScratchFolder& folder, Random& random) {
  constexpr std::array scenes{"wall", "groove", "room", "free", "moving_plate", "honey"};
  constexpr std::array brief{"sensor:frozen", "sensor:samples", "sensor:half"};
  constexpr std::array grave{"sensor:silent", "sensor:status=0x4000", "axis_3:fault=0x4210", "axis_2:silent",
                             "axis_5:power"};
  Session session;
  RigOptions& o = session.options;
  o.duration_s = random.uniform(10.0, 60.0);
  o.scene = std::string("scenes/") + scenes[random.below(scenes.size())] + ".yaml";
  o.hand = wandering_hand(folder, random, o.duration_s);
  o.settings.mass_kg = random.uniform(4.0, 12.0);
  o.settings.order = random.chance(0.3) ? 2 : 1;
  o.settings.passivity = random.chance(0.5) ? Passivity::on : Passivity::off;
  for (double t = 2.0; t < o.duration_s; t += random.uniform(2.0, 8.0)) {
    ++session.harmless;
    if (random.chance(0.5)) {
      o.script.rules.push_back({.action = fieldbus::FaultAction::drop,
                                .from_ns = static_cast<std::int64_t>(1e9 * t),
                                .count = static_cast<std::uint64_t>(1 + random.below(2)),
                                .receiver = "controller"});
    } else {
      o.device_faults.push_back(std::string(brief[random.below(brief.size())]) + "@" + std::to_string(t) + "s.." +
                                std::to_string(t + 0.002) + "s");
    }
  }
  for (std::uint64_t cycle = 1000; cycle < 20'000; cycle += static_cast<std::uint64_t>(500 + random.below(5000))) {
    o.changes.push_back({cycle, {Parameter::mass, random.uniform(3.8, 12.0)}});
  }
  session.ends = random.chance(0.33);
  if (session.ends) {
    const double t = random.uniform(3.0, o.duration_s);
    o.device_faults.push_back(std::string(grave[random.below(grave.size())]) + "@" + std::to_string(t) + "s.." +
                              std::to_string(t + 1.0) + "s");
  }
  return session;
}

// What is wrong with it; empty: nothing.
std::string run(const Session& session, State& state) {
  ClosedLoopRig rig(session.options);
  Cycle cycle(rig.prepared_parts(rig.network), session.options.settings, rig.cell.limits, 64);
  cycle.schedule(session.options.changes);
  std::string wrong;
  CycleRecord record, before;
  std::int64_t begun_ns = 0;
  std::uint64_t seen = 0;
  const double T = session.options.settings.period_s;
  const SessionHooks hooks{
      [&](std::int64_t t_k_ns) {
        if (seen == 0) begun_ns = t_k_ns;
      },
      [&] {
        while (cycle.records().pop(record)) {
          ++seen;
          if (static_cast<double>(seen) * T > session.options.duration_s + 10.0) cycle.request_stop();
          for (std::size_t i = 0; i < record.axes && seen > 1; ++i) {
            const description::DriveDescription& drive = rig.cell.drives[i];
            const double step = record.target_counts[i] - before.target_counts[i];
            const double most = drive.max_speed_rad_per_s * T * std::abs(drive.counts_per_rad()) + 1.0;
            if (before.phase == Phase::rendering && record.phase == Phase::rendering && std::abs(step) > most) {
              wrong = drive.joint + " faster than its limit in cycle " + std::to_string(record.cycle);
            }
          }
          before = record;
        }
      }};
  const SessionTally tally = run_session(cycle, rig.network, T, session.options.duration_s, hooks);
  const double elapsed_s = 1e-9 * static_cast<double>(rig.network.now_ns() - begun_ns);
  const Fault fault = cycle.supervisor().report().fault;
  if (wrong.empty() && elapsed_s - static_cast<double>(tally.cycles) * T > 2.0 * T) wrong = "time was lost";
  if (wrong.empty() && fault != Fault::none && !session.ends) wrong = std::string("ended by ") + fault_name(fault);
  if (wrong.empty() && !cycle.drives_off() && fault != Fault::drive_silent) wrong = "drives that are still on";
  const auto wanted = static_cast<std::uint64_t>(session.options.duration_s / T);
  if (wrong.empty() && fault == Fault::none && cycle.rendered_cycles() < wanted) wrong = "it stopped early";
  cycle.shut_down();
  rig.network.sleep_until(rig.network.now_ns() + 100'000'000);
  ++state.sessions;
  state.cycles += tally.cycles;
  state.simulated_s += elapsed_s;
  if (fault == Fault::none) state.ridden_through += session.harmless;
  ++state.ends[fault_name(fault)];
  return wrong;
}

// 8 MB: some hundred times what a session's allocations differ by, and 3 kB a session over a day of them.
constexpr double most_growth_MB = 8.0;
#ifdef PROXARM_SANITIZED
constexpr bool judges_memory = false;  // a sanitizer keeps what is freed
#else
constexpr bool judges_memory = true;
#endif
constexpr std::uint64_t warm_up = 3;  // sessions; libraries and the heap's own tables have grown by then

int soak(double hours, const std::string& file, std::uint64_t seed) {
  const tests::ScratchFolder folder;
  State state = restored(file, seed);
  double base_MB = 0.0, most_MB = 0.0, base_heap_MB = 0.0;
  for (std::uint64_t here = 1; state.simulated_s < 3600.0 * hours; ++here) {
    const std::uint64_t number = state.sessions;
    Random random(1'000'003 * state.seed + number);
    const std::string wrong = run(session_of(folder, random), state);
    malloc_trim(0);
    const double now_MB = resident_MB(), heap_MB = 1e-6 * static_cast<double>(mallinfo2().uordblks);
    if (here == warm_up) base_MB = now_MB, base_heap_MB = heap_MB;
    if (here >= warm_up) most_MB = std::max(most_MB, now_MB);
    if (!wrong.empty()) {
      std::printf("session %llu of seed %llu: %s\n", static_cast<unsigned long long>(number),
                  static_cast<unsigned long long>(state.seed), wrong.c_str());
      return 1;
    }
    if (judges_memory && here > warm_up && (now_MB > base_MB + most_growth_MB || heap_MB > base_heap_MB + 1.0)) {
      std::printf("session %llu: memory has grown from %.1f to %.1f MB, the heap in use from %.2f to %.2f MB\n",
                  static_cast<unsigned long long>(number), base_MB, now_MB, base_heap_MB, heap_MB);
      return 1;
    }
    keep(file, state);
  }
  std::printf(
      "%.3f h simulated, %llu sessions, %llu cycles, %llu faults ridden through; memory from %.1f to at most "
      "%.1f MB\n",
      state.simulated_s / 3600.0, static_cast<unsigned long long>(state.sessions),
      static_cast<unsigned long long>(state.cycles), static_cast<unsigned long long>(state.ridden_through), base_MB,
      most_MB);
  for (const auto& [fault, sessions] : state.ends) {
    std::printf("  %s: %llu\n", fault.c_str(), static_cast<unsigned long long>(sessions));
  }
  return 0;
}

}  // namespace
}  // namespace proxarm::controller

int main(int argc, char** argv) {
  double hours = 0.08;
  std::string file;
  std::uint64_t seed = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--hours") == 0) hours = std::atof(argv[i + 1]);
    if (std::strcmp(argv[i], "--checkpoint") == 0) file = argv[i + 1];
    if (std::strcmp(argv[i], "--seed") == 0) seed = std::strtoull(argv[i + 1], nullptr, 10);
  }
  try {
    return proxarm::controller::soak(hours, file, seed);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "soak: %s\n", error.what());
    return 2;
  }
}
