// The closed loop: the simulated arm, held by its hand, touches a wall.
#include <algorithm>
#include <cstdio>

#include "controller/library/session.hpp"

int main() {
  proxarm::Session session({{"scene", "scenes/wall.yaml"}, {"mass", 5.0}, {"duration", 6.0}});
  double deepest_m = 0.0;
  const proxarm::Summary summary =
      session.run([&](const proxarm::CycleRecord& cycle) { deepest_m = std::max(deepest_m, -cycle.tool_clearance_m); });
  std::printf("%sthe tool was %.3g um in the wall\n", proxarm::summary_text(summary).c_str(), 1e6 * deepest_m);
  return summary.faults.empty() ? 0 : 1;
}
