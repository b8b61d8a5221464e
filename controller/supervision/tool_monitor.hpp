// Checks the tool and elbow against the cell's limits by the encoders, independent of what is commanded.
//
// The guards keep all setpoints within the limits. If the tool is beyond them by the encoders, something else moves it:
// a drive that runs off, a wrong encoder or gear ratio, a slipping brake.
//
//   tool_too_fast   over the last W = 20 ms the tool has moved further than
//                     1.2 vW + v(mT + 2 t_f) + 0.1 mm,   v = limits.max_tool_speed_m_per_s
//   elbow_too_fast  the same for the joints from the third on, with limits.max_elbow_speed_m_per_s: the sum over W of
//                   the largest motion in each cycle
//   tool_off_limits the tool is more than 2 mm outside limits.workspace_m or inside a box of limits.keep_out_m
//
// The factor 1.2 allows for drives that overshoot (up to 5 % were seen, tests/controller/closed_loop). After up to m =
// max_missed_feedback cycles without feedback, or at t_f between answers on a Modbus line, one cycle shows all the
// motion since then. A tenth of a millimetre is far more than the rounding of encoders with 10⁶ counts per revolution.
// At 0.5 m/s and 1 ms the bound is 13.6 mm in 20 ms: a tool at 1 m/s is detected after some 15 ms and 15 mm, one at 0.7
// m/s after 20 ms. 2 mm are several times a drive's lag at 0.5 m/s (0.8 mm at 100 Hz), and the lag is inwards. A tool
// that starts outside may stay there, but go out by no more than another 2 mm.
#pragma once

#include <array>
#include <cstddef>

#include "controller/supervision/fault.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

inline constexpr double monitored_s = 0.02, off_limits_m = 2e-3;

struct ToolVerdict {
  Fault fault = Fault::none;
  double value = 0.0, limit = 0.0;  // m/s, or mm out of bounds
};

class ToolMonitor {
 public:
  // missed_cycles: m. feedback_s: longest t_f of the cell's drives.
  ToolMonitor(const description::CellLimits& limits, unsigned missed_cycles, double feedback_s)
      : limits_(limits), missed_cycles_(missed_cycles), feedback_s_(feedback_s) {
    places_.fill(models::Vec3::Zero());
  }

  // Call when the arm begins to move.
  void start() noexcept { count_ = 0; }
  // Call in each cycle in which the arm may move, with the tool by the encoders and the elbow's motion in this cycle.
  // Another period restarts the window at the present place, since the old places don't match its cycles.
  ToolVerdict step(const models::Vec3& tool_W, double elbow_moved_m, double period_s) noexcept;
  // Distance of p outside the limits, m; negative within.
  [[nodiscard]] double off_limits(const models::Vec3& p) const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t most_places = 80;  // enough for W down to 0.25 ms; with shorter periods the window is
                                                  // shorter

  [[nodiscard]] double most_way_m(double speed_m_per_s, double window_s, double period_s) const noexcept;
  [[nodiscard]] ToolVerdict judge_speeds(const models::Vec3& tool_W, std::uint32_t window,
                                         double period_s) const noexcept;

  description::CellLimits limits_;
  double missed_cycles_, feedback_s_;
  std::array<models::Vec3, most_places> places_;     // ring of the tool's places
  std::array<double, most_places> elbow_moved_m_{};  // ring of the elbow's motion in these cycles
  std::uint32_t count_ = 0;                          // cycles since start()
  double allowed_m_ = 0.0;                           // distance off limits at the start
  double period_s_ = 0.0;                            // period of the stored places
};

}  // namespace proxarm::controller
