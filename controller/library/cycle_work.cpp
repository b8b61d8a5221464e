#include "controller/library/cycle_work.hpp"

#include <algorithm>
#include <cstdint>
#include <sstream>

#include "controller/library/simulated_loop.hpp"

namespace proxarm::controller {

MotionWork count_work(const PreparedSession& session) {
  return run_quietly(session, [](const CycleRecord&, const sim::Truth&) {}).work;
}

std::string work_text(const PreparedSession& session, const MotionWork& work) {
  std::ostringstream out;
  out.precision(3);
  out << "a cycle goes through, around that (" << session.cell.name << ", held by " << session.hand.name << ", "
      << work.steps << " steps)\n";
  const auto line = [&](const char* what, const auto&... why) {
    out << "  " << what << ": ";
    (out << ... << why);
    out << "\n";
  };
  line("the tool behind the setpoints' filter, and what its gears carry", "one pass outwards along the arm");
  line("limits of speed, acceleration, power, leash and borders", "spheres and half-spaces that hold 𝒢's answer");
  if (session.settings.looks_ahead) line("lookahead", "the proxy is stepped on by the horizon");
  line("inverse kinematics",
       static_cast<double>(work.joint_steps) / static_cast<double>(std::max<std::uint64_t>(1, work.steps)),
       " steps in the mean, from the pose that the last cycle left");
  line("the last guard", "its quick bounds");
  out << "skipped\n";
  const auto seldom = [&](const char* what, std::uint64_t done, const char* why) {
    line(what, "in ", work.steps - std::min(work.steps, done), " of these steps, ", why);
  };
  seldom("limits of the joints", work.programs, "which joints can follow to the pose that is wanted");
  seldom("the nearest point of all limits", work.limited, "in which none acts");
  seldom("the last guard's exact test", work.guarded, "which keep well within its bounds");
  if (!session.settings.looks_ahead) line("lookahead", "without --lookahead");
  return out.str();
}

}  // namespace proxarm::controller
