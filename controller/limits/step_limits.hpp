// The limits of one step of the proxy, as convex sets around its position.
//
//   ball        ‖q − c‖ ≤ r       speed, acceleration, power, leash
//   half-space  n·(q − q₁) ≤ b    workspace, keep-out boxes, joint ranges, joint speeds
//   steps that the joints can follow (followable_step.hpp)
//
// The proxy's next position is the point of contacts ∩ sets nearest to p̂, found in one solve (limited_algorithm.hpp).
// If the sets conflict, they give way in this order: friction, contact, leash and power. Ranges, speeds and
// acceleration never give way. The limited q becomes q(k−1), so nothing winds up behind a limit.
//
// - Speed: ‖q − q₁‖ ≤ vT, v = 0.9 limits.max_tool_speed_m_per_s. Power: v = max_power_W/‖h‖, which bounds the power
//   that the arm exchanges with the hand.
// - Acceleration: of the commanded point behind the setpoint filter (elastic_setpoint.hpp) with state x, v:
//   ‖ω²(q − x) − 2ωv‖ ≤ a, a ball around x + 2v/ω. A proxy that meets a wall below a·e/ω (e = 2.718…; 0.34 m/s with the
//   default cell) needs no more than a. Without a filter: ‖q − 2q₁ + q₂‖ ≤ aT².
// - Border at distance d, less a setback: n·(q − q₁) ≤ d T/(T + v/a). The speed towards a border decreases with d,
//   slowly enough that braking straight along the present velocity keeps all borders at once: from u ≤ d/(T + v/a) and
//   a deceleration of a follows (1 − aT/v)(T + v/a) ≤ v/a. The filter doesn't overshoot, so the commanded point keeps
//   convex borders, too.
// - Keep-out box: the half-space of the face whose plane lies furthest ahead of the proxy. The commanded point lags by
//   2v/ω (some millimetres) and may cut corners by as much, so a box must include that margin.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// Bits of ActiveLimits::kinds.
enum class Limit : std::uint16_t {
  leash = 1u << 0,
  power = 1u << 1,
  workspace = 1u << 2,
  keep_out = 1u << 3,
  joint_range = 1u << 4,
  joint_speed = 1u << 5,
  joint_acceleration = 1u << 6,
  speed = 1u << 7,
  acceleration = 1u << 8,
  singularity = 1u << 9,       // inverse kinematics didn't converge
  following_error = 1u << 10,  // a drive doesn't follow, and its setpoint waits for it
  joint_torque = 1u << 11,     // impedance type: the rendered force is reduced
  // Changes of setpoints by the tool guard (controller/setpoints/tool_guard.hpp):
  guard_speed = 1u << 12,    // of the tool
  guard_elbow = 1u << 13,    // of elbow or wrist
  guard_border = 1u << 14,   // workspace or keep-out zones
  guard_turning = 1u << 15,  // angle, tilt, twist or turning speed
};

inline constexpr std::array all_limits{
    Limit::leash,        Limit::power,       Limit::workspace,          Limit::keep_out,
    Limit::joint_range,  Limit::joint_speed, Limit::joint_acceleration, Limit::speed,
    Limit::acceleration, Limit::singularity, Limit::following_error,    Limit::joint_torque,
    Limit::guard_speed,  Limit::guard_elbow, Limit::guard_border,       Limit::guard_turning};

// Limits that hold single joints.
inline constexpr std::array limits_of_joints{Limit::joint_range, Limit::joint_speed, Limit::joint_acceleration,
                                             Limit::following_error, Limit::joint_torque};

// Key or keys that set a limit: "limits.leash_m", "drives[].range_rad".
const char* limit_parameter(Limit limit) noexcept;

// The limits that were active in a cycle.
struct ActiveLimits {
  // Joints held by each of limits_of_joints, as bits.
  using Joints = std::array<std::uint8_t, limits_of_joints.size()>;

  std::uint16_t kinds = 0;  // bits of Limit
  Joints joints{};

  static ActiveLimits of(Limit limit) noexcept {
    ActiveLimits out;
    out.set(limit);
    return out;
  }
  void set(Limit limit, std::uint8_t joint_bits = 0) noexcept {
    kinds = static_cast<std::uint16_t>(kinds | static_cast<std::uint16_t>(limit));
    for (std::size_t i = 0; i < joints.size(); ++i) {
      if (limits_of_joints[i] == limit) joints[i] = static_cast<std::uint8_t>(joints[i] | joint_bits);
    }
  }
  [[nodiscard]] bool has(Limit limit) const noexcept { return (kinds & static_cast<std::uint16_t>(limit)) != 0; }
  void add(const ActiveLimits& other) noexcept {
    kinds = static_cast<std::uint16_t>(kinds | other.kinds);
    for (std::size_t i = 0; i < joints.size(); ++i) joints[i] = static_cast<std::uint8_t>(joints[i] | other.joints[i]);
  }
};

// Balls and half-spaces in n dimensions, relative to q₁.
template <int N>
struct LimitBall {
  models::Vec<N> centre = models::Vec<N>::Zero();
  double radius_m = 0.0;
  Limit limit = Limit::speed;
};
template <int N>
struct LimitPlane {
  models::Vec<N> normal = models::Vec<N>::Zero();  // unit, outwards
  double bound_m = 0.0;
  ActiveLimits limits{};  // the limits that form it
  double share = 0.0;     // part of a step towards the plane by which its bound shrinks for the next step; 0 for a
                          // speed
};

class FollowableStep;

struct StepLimits {
  static constexpr std::size_t max_planes = 40;
  std::array<LimitBall<3>, 2> soft{};  // leash, power: may give way
  std::size_t soft_count = 0;
  std::array<LimitPlane<3>, max_planes> planes{};
  std::size_t plane_count = 0;
  std::array<LimitBall<3>, 2> hard{};  // speed, acceleration
  std::size_t hard_count = 0;
  FollowableStep* arm = nullptr;               // steps that the arm can follow; null: all
  models::Vec3 q_k1_W = models::Vec3::Zero();  // origin of all sets
};

// The proxy stops at this distance before a border; in a box thinner than four times that, at a quarter of the
// thickness. Motors lead the links that they accelerate. While the tool slides along a border, setpoints therefore go
// up to 0.23 mm beyond the proxy on six and seven axes (0.4 m/s, 2 m/s²), and 0.55 mm on the rail. The tool guard
// allows another 0.08 mm. Nobody sees where a border is to half a millimetre.
inline constexpr double longest_setback_m = 5e-4;
inline double border_setback_m(double thickness_m) noexcept { return std::min(longest_setback_m, 0.25 * thickness_m); }

// State at the start of a step, in W.
struct StepStart {
  models::Vec3 q_k1_W = models::Vec3::Zero(), q_k2_W = models::Vec3::Zero();
  models::Vec3 filtered_W = models::Vec3::Zero(), filtered_velocity_W = models::Vec3::Zero();  // x, v above
  models::Vec3 measured_W = models::Vec3::Zero();
  double force_N = 0.0;                                                // the hand's
  double max_speed_m_per_s = std::numeric_limits<double>::infinity();  // the tool's, if lower than the cell's
};

class StepLimiter {
 public:
  StepLimiter(const description::CellLimits& limits, double period_s);

  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Makes the sets of one step, around the proxy or around the commanded point (sent_point.hpp), given as q_k1_W and
  // q_k2_W of `start`. Neither allocates nor throws.
  void make(const StepStart& start, FollowableStep* arm, StepLimits& out) const noexcept;
  // Impedance type: makes only workspace and keep-out boxes, as walls for a proxy whose tool is at q_W. Walls don't
  // slow the tool before they are reached; beyond, they push it back. Joint ranges: rendering/joint_coupling.hpp.
  void make_walls(const models::Vec3& q_W, StepLimits& out) const noexcept;

 private:
  enum class Borders : std::uint8_t { slow_down, walls };
  void add_borders(const models::Vec3& q_W, Borders borders, StepLimits& out) const noexcept;
  void add_balls(const StepStart& start, StepLimits& out) const noexcept;

  description::CellLimits limits_;
  double period_s_;
  double omega_rad_per_s_;
};

}  // namespace proxarm::controller
