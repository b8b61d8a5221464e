// What the encoders say of the tool and the elbow, held against the cell's limits: independent of what is commanded.
//
// The setpoints' guard keeps all that is sent within the limits. If the tool by its encoders isn't within them,
// something else moves it: a drive that runs off, a wrong encoder or gear ratio, a brake that slips.
//
//   tool_too_fast   over the last W = 20 ms the tool has moved further than
//                     1.2 vW + v(mT + 2 t_f) + 0.1 mm,   v = limits.max_tool_speed_m_per_s
//   elbow_too_fast  the same of the joints from the third on, with limits.max_elbow_speed_m_per_s: the sum of what the
//                   furthest of them has gone in each cycle of W
//   tool_off_limits it is further out of limits.workspace_m, or deeper in a zone of limits.keep_out_m, than 2 mm
//
// The additional fifth is for drives that overshoot (up to 5 % were seen, tests/controller/closed_loop). A drive whose
// feedback was missing for up to m = max_missed_feedback cycles, or that answers every t_f on a Modbus line, makes up
// in one cycle for what the tool has moved meanwhile. A tenth of a millimetre is far more than the rounding of encoders
// of 10⁶ counts per revolution. At 0.5 m/s and 1 ms the bound is 13.6 mm in 20 ms: a tool at 1 m/s is found after some
// 15 ms and 15 mm, and one at 0.7 m/s after 20 ms. 2 mm are several times the lag of a drive at 0.5 m/s (0.8 mm at 100
// Hz), and the lag is inwards. A tool that starts outside may be there, but not 2 mm further out.
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
  // `missed_cycles`: m. `feedback_s`: the longest t_f of the cell's drives.
  ToolMonitor(const description::CellLimits& limits, unsigned missed_cycles, double feedback_s)
      : limits_(limits), missed_cycles_(missed_cycles), feedback_s_(feedback_s) {
    places_.fill(models::Vec3::Zero());
  }

  // Called when the arm begins to move.
  void start() noexcept { count_ = 0; }
  // Each cycle in which it may move: the tool by the encoders, and how far the elbow has gone since the cycle before.
  // With another period the window begins where it is now: places of the old one are older than they count.
  ToolVerdict step(const models::Vec3& tool_W, double elbow_moved_m, double period_s) noexcept;
  // How far p is off limits, m; below zero: within them.
  [[nodiscard]] double off_limits(const models::Vec3& p) const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t most_places = 80;  // enough for W down to 0.25 ms; below that the window is shorter

  [[nodiscard]] double most_way_m(double speed_m_per_s, double window_s, double period_s) const noexcept;
  [[nodiscard]] ToolVerdict judge_speeds(const models::Vec3& tool_W, std::uint32_t window,
                                         double period_s) const noexcept;

  description::CellLimits limits_;
  double missed_cycles_, feedback_s_;
  std::array<models::Vec3, most_places> places_;     // of the tool: a ring
  std::array<double, most_places> elbow_moved_m_{};  // to where it was in each of these cycles: a ring
  std::uint32_t count_ = 0;                          // since start()
  double allowed_m_ = 0.0;                           // off limits at the start
  double period_s_ = 0.0;                            // of the places
};

}  // namespace proxarm::controller
