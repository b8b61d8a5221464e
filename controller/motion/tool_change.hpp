// Other figures of the tool behind the sensor, set while a session runs: its mass and centre of mass.
//
// They are for a tool that hung there when the sensor was tared, and that the cell has wrong. The reading y that was
// learnt as zero, with gravity g₀ in S, then had the wrong weight in it. With m, c instead of m₀, c₀ (both about S):
//   bias   += −(m − m₀) g₀                 what the tare would have found with them
//   hand_S += (m − m₀) d,  torque about S += (m c − m₀ c₀) × d,   d = g₀ − g: how gravity has turned in S since
// As the sensor was held when it was tared, nothing changes. g₀ follows where the bias does: what an empty handle at
// rest reads is learnt there (Measurement::follow_bias).
//
// The hand feels the tool's mass in full, so the proxy's mass changes by m₀ − m, and the felt one stays: at once, as a
// mass that is set. Weight and the arm's own model are faded in evenly, within
//   max(1 s, |ΔF|/(2 N/s), |Δτ|/(0.2 Nm/s))
// so a force that changes by ΔF is 2 N/s at most, and no setpoint jumps.
//
// What the sensor shows against them is refused (doubt()). Of a remembered zero: the tare would be further from it than
// the sensor drifts, and further than it was. Of the present reading: what changes is more than the tare leaves open of
// the zero, and doesn't bring the reading to half of itself or to as little, nor does it halve the tare's distance from
// the remembered zero. A force of 0.07 N, within an empty handle's band, may lead a handle 10 mm until it is told from
// a hand, and one with a load at it further; what the tare leaves open is there anyway.
//
// Neither allocates, locks nor throws after construction.
#pragma once

#include <array>

#include "controller/handle/hand_force.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/archive_fields.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The tool of a cell.
[[nodiscard]] HeldTool held_tool(const description::ToolDescription& tool) noexcept;

// Why the sensor denies figures of the tool.
struct ToolDoubt {
  enum class Why : std::uint8_t { none, zero, force, torque };
  Why why = Why::none;
  double would_be = 0.0;  // the zero's distance from the remembered one, or the reading about T: N or Nm
  double limit = 0.0;     // what that may be

  // For somebody who isn't told the numbers.
  [[nodiscard]] static const char* text(Why why) noexcept;
};

// The sensor's readings by which figures are judged; vectors are in S.
struct ToolEvidence {
  using Numbers = std::array<double, 17>;

  models::Wrench hand_S;                           // about T, with the present figures
  models::Vec3 turned_S = models::Vec3::Zero();    // d, m/s²
  models::Vec3 learnt_S = models::Vec3::Zero();    // g₀, m/s²; zero: the sensor hasn't been tared
  models::Vec3 zero_off_S = models::Vec3::Zero();  // N: the tare less the zero that is remembered
  double zero_limit_N = 0.0;                       // by which it may be off; infinite: none is remembered

  double open_N = 0.0;  // what the tare leaves open of the zero

  // By how much the hand's wrench about T changes.
  [[nodiscard]] models::Wrench change(const HeldTool& from, const HeldTool& to) const noexcept;
  [[nodiscard]] ToolDoubt doubt(const HeldTool& from, const HeldTool& to) const noexcept;

  [[nodiscard]] Numbers numbers() const noexcept;
  [[nodiscard]] static ToolEvidence of(const Numbers& numbers) noexcept;
};

class ToolChange {
 public:
  explicit ToolChange(const description::ToolDescription& tool);

  // Begins to fade in what is wanted. `change`: of the hand's wrench, about T.
  void take(const HeldTool& wanted, const models::Wrench& change) noexcept;
  // One period. Returns true if the present figures are others than before.
  bool step(double period_s) noexcept;
  [[nodiscard]] const HeldTool& wanted() const noexcept { return state_.wanted; }
  [[nodiscard]] const HeldTool& present() const noexcept { return state_.present; }
  // The inertia about T with these figures, the one about the centre of mass staying the cell's.
  [[nodiscard]] models::ToolInertia about_T(const HeldTool& figures) noexcept;

  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    HeldTool from, wanted, present;
    double share = 1.0, fade_s = 1.0;  // of the way from `from` to `wanted`, and how long all of it takes
  };

  description::ToolDescription tool_;
  State state_;
};

}  // namespace proxarm::controller
