// Makes the limits of one step of the proxy, as convex sets around the proxy's position.
//
//   ball        ‖q − c‖ ≤ r       speed, acceleration, power, leash
//   half-space  n·(q − q₁) ≤ b    workspace, keep-out boxes, joint ranges, joint speeds
//   places that the arm can reach in this step (followable_step.hpp)
//
// The proxy's next position is the point of contacts ∩ sets that is nearest to p̂ (limited_algorithm.hpp). If contacts
// and sets conflict, they give way in this order: friction, contact, leash and power. Ranges, speeds and acceleration
// never give way. The limited q becomes q(k−1), so nothing winds up behind a limit.
//
// - Speed: ‖q − q₁‖ ≤ vT with v = 0.9 limits.max_tool_speed_m_per_s.
// - Power: ‖q − q₁‖ ≤ vT with v = max_power_W/‖h‖. This bounds the power that the arm exchanges with the hand.
// - Acceleration: bounds the acceleration of the commanded point behind the setpoint filter (elastic_setpoint.hpp),
//   whose state is x, v: ‖ω²(q − x) − 2ωv‖ ≤ a, a ball around x + 2v/ω. If a wall stops the proxy from a speed of at
//   most a·e/ω (e = 2.718…; 0.34 m/s with the default cell), the commanded point needs an acceleration of at most a.
//   Without a filter: ‖q − 2q₁ + q₂‖ ≤ aT².
// - Border of the workspace: n·(q − q₁) ≤ d T/(T + v/a), where d is the distance from the border less a setback. So
//   the speed u towards the border is at most d/(T + v/a). This bound falls slowly enough that braking straight along
//   the present velocity keeps all borders at once:
//     1. Braking at a multiplies u by at most 1 − aT/v in a step, since the tool's speed is at most v.
//     2. (1 − aT/v)(T + v/a) ≤ v/a, so u after the step satisfies u (T + v/a) ≤ u₁ v/a, where u₁ is u before the step.
//     3. u₁ v/a = u₁ (T + v/a) − u₁T ≤ d − u₁T, which is the new distance. So the new u keeps the border.
//   The filter doesn't overshoot, so the commanded point keeps convex borders, too.
// - Keep-out box: the half-space of the box's face whose plane is furthest from the proxy, with the border's bound. The
//   commanded point lags behind the proxy by 2v/ω (some millimetres) and may cut corners by this lag, so a box must
//   include this margin.
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
  // The tool guard has changed setpoints (controller/setpoints/tool_guard.hpp), because of:
  guard_speed = 1u << 12,    // the tool's speed
  guard_elbow = 1u << 13,    // the speed of elbow or wrist
  guard_border = 1u << 14,   // the workspace or a keep-out box
  guard_turning = 1u << 15,  // the tool's angle, tilt, twist or turning speed
};

inline constexpr std::array all_limits{
    Limit::leash,        Limit::power,       Limit::workspace,          Limit::keep_out,
    Limit::joint_range,  Limit::joint_speed, Limit::joint_acceleration, Limit::speed,
    Limit::acceleration, Limit::singularity, Limit::following_error,    Limit::joint_torque,
    Limit::guard_speed,  Limit::guard_elbow, Limit::guard_border,       Limit::guard_turning};

// Limits that act on single joints.
inline constexpr std::array limits_of_joints{Limit::joint_range, Limit::joint_speed, Limit::joint_acceleration,
                                             Limit::following_error, Limit::joint_torque};

// Returns the key or keys that set a limit, such as "drives[].range_rad"; of a limit without a key: its name.
const char* limit_parameter(Limit limit) noexcept;

// The limits that were active in a cycle.
struct ActiveLimits {
  // The joints on which each of limits_of_joints acts, as bits.
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

// Balls and half-spaces in N dimensions, relative to q₁.
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
  ActiveLimits limits{};  // the limits that form this half-space
  double share = 0.0;     // after a step towards the plane, the next step's bound is smaller by this share of the step;
                          // 0 for a limit of speed
};

class FollowableStep;

struct StepLimits {
  static constexpr std::size_t max_planes = 40;
  std::array<LimitBall<3>, 2> soft{};  // leash and power, which may give way
  std::size_t soft_count = 0;
  std::array<LimitPlane<3>, max_planes> planes{};
  std::size_t plane_count = 0;
  std::array<LimitBall<3>, 2> hard{};  // speed, acceleration
  std::size_t hard_count = 0;
  FollowableStep* arm = nullptr;               // places that the arm can reach; null: every place
  models::Vec3 q_k1_W = models::Vec3::Zero();  // origin of all sets
};

// The setback, the distance before a border at which the proxy stops. If the workspace is thinner than four times
// longest_setback_m, the setback is a quarter of this thickness. Reason: motors lead the links that they accelerate. So
// while the tool slides along a border, setpoints go beyond the proxy by up to 0.23 mm on six and seven axes (0.4 m/s,
// 2 m/s²), and by up to 0.55 mm on the rail. The tool guard allows another 0.08 mm. Nobody can see a border's place to
// half a millimetre.
inline constexpr double longest_setback_m = 5e-4;
inline double border_setback_m(double thickness_m) noexcept { return std::min(longest_setback_m, 0.25 * thickness_m); }

// State at the start of a step, in W.
struct StepStart {
  models::Vec3 q_k1_W = models::Vec3::Zero(), q_k2_W = models::Vec3::Zero();
  models::Vec3 filtered_W = models::Vec3::Zero(), filtered_velocity_W = models::Vec3::Zero();  // x, v of the filter
  models::Vec3 measured_W = models::Vec3::Zero();                                              // the tool's place
  double force_N = 0.0;                                                                        // the hand's, ‖h‖
  // Another limit of the tool's speed; acts if it is lower than the cell's.
  double max_speed_m_per_s = std::numeric_limits<double>::infinity();
};

class StepLimiter {
 public:
  StepLimiter(const description::CellLimits& limits, double period_s);

  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Makes the sets of one step around the proxy, or around the commanded point (sent_point.hpp) if its last two places
  // are q_k1_W and q_k2_W of `start`. Doesn't allocate or throw.
  void make(const StepStart& start, FollowableStep* arm, StepLimits& out) const noexcept;
  // Impedance type: makes only workspace and keep-out boxes, as walls for a proxy whose tool is at q_W. Walls don't
  // slow a tool that hasn't reached them, but push back a tool that is beyond them. rendering/joint_coupling.hpp keeps
  // the joint ranges.
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
