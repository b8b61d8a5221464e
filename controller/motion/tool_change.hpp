// Corrects mass and centre of mass of the tool behind the sensor during a session.
//
// The correction is for a tool that was mounted during the tare, with wrong figures in the cell: the zero, learnt with
// gravity g₀ (in S), then contains a wrong weight. With m, c in place of m₀, c₀ (both about S):
//   bias   += −(m − m₀) g₀                 as the tare would have found with m, c
//   hand_S += (m − m₀) d,  torque about S += (m c − m₀ c₀) × d,   d = g₀ − g: change of gravity in S since the tare
// In the orientation of the tare, nothing changes. g₀ moves along with the bias, which follows the reading of an empty
// handle at rest (Measurement::follow_bias).
//
// The hand feels the tool's full mass. So the proxy's mass changes by m₀ − m at once, and the felt mass stays. The
// weight and the arm's model change evenly, within
//   max(1 s, |ΔF|/(2 N/s), |Δτ|/(0.2 Nm/s))
// so the force changes by at most 2 N/s, and no setpoint jumps.
//
// doubt() refuses figures that contradict the sensor:
// - the remembered zero: the tare would differ from it by more than the sensor drifts, and by more than before;
// - the present reading: the change exceeds the tare's uncertainty, brings the reading neither to half nor within that
//   uncertainty, and doesn't halve the tare's distance from the remembered zero either. (Even 0.07 N, within the band
//   of an empty handle, may move the handle by 10 mm before it is distinguished from a hand, and further with a load.)
//
// No allocation, lock or throw after construction.
#pragma once

#include <array>

#include "controller/handle/hand_force.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/archive_fields.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

[[nodiscard]] HeldTool held_tool(const description::ToolDescription& tool) noexcept;

// The reason why the sensor's readings contradict figures of the tool.
struct ToolDoubt {
  enum class Why : std::uint8_t { none, zero, force, torque };
  Why why = Why::none;
  double would_be = 0.0;  // the zero's distance from the remembered one, or the reading about T: N or Nm
  double limit = 0.0;     // the largest accepted value

  // An explanation without numbers.
  [[nodiscard]] static const char* text(Why why) noexcept;
};

// Readings by which figures are judged; vectors are in S.
struct ToolEvidence {
  using Numbers = std::array<double, 17>;

  models::Wrench hand_S;                           // about T, with the present figures
  models::Vec3 turned_S = models::Vec3::Zero();    // d, m/s²
  models::Vec3 learnt_S = models::Vec3::Zero();    // g₀, m/s²; zero: no tare yet
  models::Vec3 zero_off_S = models::Vec3::Zero();  // N: the tare less the remembered zero
  double zero_limit_N = 0.0;                       // its limit; infinite: no zero is remembered

  double open_N = 0.0;  // uncertainty of the tare

  // Change of the hand's wrench about T.
  [[nodiscard]] models::Wrench change(const HeldTool& from, const HeldTool& to) const noexcept;
  [[nodiscard]] ToolDoubt doubt(const HeldTool& from, const HeldTool& to) const noexcept;

  [[nodiscard]] Numbers numbers() const noexcept;
  [[nodiscard]] static ToolEvidence of(const Numbers& numbers) noexcept;
};

class ToolChange {
 public:
  explicit ToolChange(const description::ToolDescription& tool);

  // Starts the change to `wanted`. `change`: of the hand's wrench, about T.
  void take(const HeldTool& wanted, const models::Wrench& change) noexcept;
  // One period. Returns true if the present figures have changed.
  bool step(double period_s) noexcept;
  [[nodiscard]] const HeldTool& wanted() const noexcept { return state_.wanted; }
  [[nodiscard]] const HeldTool& present() const noexcept { return state_.present; }
  // Inertia about T with these figures; the inertia about the centre of mass stays the cell's.
  [[nodiscard]] models::ToolInertia about_T(const HeldTool& figures) noexcept;

  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    HeldTool from, wanted, present;
    double share = 1.0, fade_s = 1.0;  // share of the way from `from` to `wanted`, and duration of the whole
  };

  description::ToolDescription tool_;
  State state_;
};

}  // namespace proxarm::controller
