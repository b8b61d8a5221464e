// Checks by the encoders whether tool and elbow keep the cell's limits, independent of the setpoints.
//
// The guards keep all setpoints within the limits. If the tool is beyond a limit by the encoders, something else moves
// it: a drive that runs off, a wrong encoder or gear ratio, a slipping brake.
//
//   tool_too_fast    Over the last W = 20 ms the tool has moved further than
//                      1.2 vW + v(mT + 2 t_f) + 0.1 mm,   v = limits.max_tool_speed_m_per_s
//   elbow_too_fast   The sum over W of the largest motion in each cycle of a joint from the third on exceeds this
//                    distance, with v = limits.max_elbow_speed_m_per_s.
//   tool_off_limits  The tool is more than 2 mm outside limits.workspace_m or inside a box of limits.keep_out_m.
//
// - The factor 1.2 allows for drives that overshoot. Overshoots of up to 5 % were measured
//   (tests/controller/closed_loop).
// - m = max_missed_feedback is the largest number of cycles without feedback, and t_f the time between answers on a
//   Modbus line. The next feedback shows all motion since the last one in one cycle.
// - 0.1 mm is far more than the rounding of encoders with 10⁶ counts per revolution.
// - At 0.5 m/s and 1 ms the bound is 13.6 mm in 20 ms. A tool at 1 m/s is detected after some 15 ms and 15 mm, a tool
//   at 0.7 m/s after 20 ms.
// - 2 mm are several times a drive's lag at 0.5 m/s (0.8 mm at 100 Hz), and a lag keeps the tool inside. A tool that
//   starts beyond a limit may stay there, but may go further out by at most 2 mm.
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
  double value = 0.0, limit = 0.0;  // a speed in m/s, or a distance off limits in mm
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
  // Call in each cycle in which the arm may move. tool_W: the tool's place by the encoders. elbow_moved_m: the elbow's
  // motion in this cycle. If the period changes, the window W begins anew at the present place, since the old places
  // belong to cycles of the old period.
  ToolVerdict step(const models::Vec3& tool_W, double elbow_moved_m, double period_s) noexcept;
  // Returns the distance of p outside workspace and keep-out limits, m; negative if p is within the limits.
  [[nodiscard]] double off_limits(const models::Vec3& p) const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  // Enough for W at periods of at least 0.25 ms. At shorter periods the window is shorter than W.
  static constexpr std::size_t most_places = 80;

  [[nodiscard]] double most_way_m(double speed_m_per_s, double window_s, double period_s) const noexcept;
  [[nodiscard]] ToolVerdict judge_speeds(const models::Vec3& tool_W, std::uint32_t window,
                                         double period_s) const noexcept;

  description::CellLimits limits_;
  double missed_cycles_, feedback_s_;
  std::array<models::Vec3, most_places> places_;     // ring of the tool's places
  std::array<double, most_places> elbow_moved_m_{};  // ring of the elbow's motion in each of these cycles
  std::uint32_t count_ = 0;                          // cycles since start(); see step() for large numbers
  double allowed_m_ = 0.0;                           // distance off limits at the start
  double period_s_ = 0.0;                            // period of the stored places
};

}  // namespace proxarm::controller
