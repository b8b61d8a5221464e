// The record of one cycle: plain data of fixed size. The cycle pushes the record into a ring. Summary, files and plot
// read the record outside the cycle.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "controller/limits/step_limits.hpp"
#include "controller/stability/port_energies.hpp"
#include "controller/supervision/supervisor.hpp"
#include "fieldbus/cia402/cia402_period.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

enum class ContactPhase : std::uint8_t { free, stick, slip };

const char* contact_phase_name(ContactPhase phase) noexcept;

// What was out of the ordinary in a cycle. An active limit is no fault.
enum class RecordFlag : std::uint32_t {
  sample_held = 1u << 0,       // no new sensor sample: the last force was used again
  feedback_missing = 1u << 1,  // a drive's TPDO is missing: the drive's last position was used
  limit_speed = 1u << 2,
  limit_acceleration = 1u << 3,
  limit_workspace = 1u << 4,
  limit_joint = 1u << 5,
  limit_leash = 1u << 6,
  limit_orientation = 1u << 7,
  hands_off = 1u << 8,  // no hand is at the handle: the proxy comes to rest
  truth = 1u << 9,      // the fields of the simulation's true state are filled in
  overrun = 1u << 10,   // the cycle was late; depends on the wall clock, so it is in timing.json, not in signals.csv
  limit_power = 1u << 11,
  limit_keep_out = 1u << 12,
  limit_joint_speed = 1u << 13,
  limit_joint_acceleration = 1u << 14,
  // The inverse kinematics didn't reach the point: the arm is at the end of its reach, or nearly singular.
  limit_singularity = 1u << 15,
  limit_following_error = 1u << 16,  // setpoints waited for a drive that doesn't follow
  limit_joint_torque = 1u << 17,     // impedance type: the rendered torques were cut
  oscillation = 1u << 18,            // the tool oscillates above the hand's band (passivity.hpp)
  timestep = 1u << 19,               // a change of the timestep is in progress: the arm brakes or stands
  guard_speed = 1u << 20,            // the last guard changed the setpoints (tool_guard.hpp)
  guard_elbow = 1u << 21,
  guard_border = 1u << 22,
  guard_turning = 1u << 23,
  ramp_in = 1u << 24,  // only a share of the hand's force acts on the proxy
  slowed = 1u << 25,   // the tool's speed limit is below the cell's, because of a fault
  oscillation_lasts = 1u << 26,
  power_cut = 1u << 27,    // stop of category 0: the drives are ordered to cut their power at once
  unresolved = 1u << 28,   // no solution was found that keeps all laws of contact
  sample_late = 1u << 29,  // the sensor's sample belongs to the cycle before, in which it came too late
};

// Returns the flag's name in signals.csv.
const char* flag_name(RecordFlag flag) noexcept;

// The flag of a limit, and the limit itself, which has a parameter ("limits.leash_m").
struct LimitFlag {
  RecordFlag flag;
  Limit limit;
};
inline constexpr std::array limit_flags{LimitFlag{RecordFlag::limit_speed, Limit::speed},
                                        LimitFlag{RecordFlag::limit_acceleration, Limit::acceleration},
                                        LimitFlag{RecordFlag::limit_power, Limit::power},
                                        LimitFlag{RecordFlag::limit_workspace, Limit::workspace},
                                        LimitFlag{RecordFlag::limit_keep_out, Limit::keep_out},
                                        LimitFlag{RecordFlag::limit_joint, Limit::joint_range},
                                        LimitFlag{RecordFlag::limit_joint_speed, Limit::joint_speed},
                                        LimitFlag{RecordFlag::limit_joint_acceleration, Limit::joint_acceleration},
                                        LimitFlag{RecordFlag::limit_leash, Limit::leash},
                                        LimitFlag{RecordFlag::limit_singularity, Limit::singularity},
                                        LimitFlag{RecordFlag::limit_following_error, Limit::following_error},
                                        LimitFlag{RecordFlag::limit_joint_torque, Limit::joint_torque},
                                        LimitFlag{RecordFlag::guard_speed, Limit::guard_speed},
                                        LimitFlag{RecordFlag::guard_elbow, Limit::guard_elbow},
                                        LimitFlag{RecordFlag::guard_border, Limit::guard_border},
                                        LimitFlag{RecordFlag::guard_turning, Limit::guard_turning}};

// Three numbers. Unlike Eigen's vectors, this type is trivially copyable.
using Triple = std::array<double, 3>;

inline Triple triple(const models::Vec3& v) noexcept { return {v.x(), v.y(), v.z()}; }
inline models::Vec3 vec3(const Triple& v) noexcept { return {v[0], v[1], v[2]}; }

inline constexpr std::size_t max_axes = 8;

// A contact of the proxy with an object.
struct RecordedContact {
  // Index of the object in the scene; below 0: no object of the scene, or no contact.
  std::int32_t object = -1;
  // Index of the part of a tool with a shape; −1: a point tool.
  std::int32_t part = -1;
  bool slips = false;
  double friction = 0.0;  // μ at present
  double gap_m = 0.0;     // distance between tool and object at the contact
  Triple point_W_m{};     // material point of the tool
  Triple normal_W{};      // unit vector out of the object; zero: no contact
  Triple force_W_N{};     // force of the object on the tool
};
// Enough for a box on a table (four corners) or in a groove (eight). For a tool with a shape, the strongest contacts
// are recorded, the strongest first. For a point, contacts are in the scene's order.
inline constexpr std::size_t most_contacts = 8;

struct CycleRecord {
  std::uint64_t cycle = 0;     // k
  std::int64_t time_ns = 0;    // t_k as scheduled, since the session's first cycle
  std::int64_t period_ns = 0;  // T, from this cycle to the next one
  Phase phase = Phase::idle;
  ContactPhase contact = ContactPhase::free;
  std::uint8_t contact_count = 0;  // number of simultaneous contacts; may exceed most_contacts
  std::uint8_t axes = 0;
  ActiveLimits::Joints limited_joints{};  // for each limit of joints, the joints that it held, as bits
  std::uint32_t flags = 0;                // RecordFlag, as bits

  // The supervisor's findings. fault: the fault that stopped the arm; none: no such fault. held_for: the fault for
  // which the arm is held; none: no fault, or a requested hold.
  Fault fault = Fault::none, held_for = Fault::none;
  std::int32_t fault_where = -1;  // place of `fault`, else of `held_for`, as in FaultReport
  std::uint64_t fault_cycle = 0;
  double fault_value = 0.0, fault_limit = 0.0;

  Triple force_S_N{}, torque_S_Nm{};  // the sensor's wrench, as decoded
  Triple force_W_N{}, torque_W_Nm{};  // h(k): without bias and tool weight, in W, about the rendered point
  Triple p_hat_W_m{};                 // (26a)
  Triple proxy_W_m{};                 // q(k)
  Triple contact_force_W_N{};         // f(k), (25a): on the proxy
  // The contacts of a point have no place and no force before place_contacts() (signals/point_contacts.hpp).
  std::array<RecordedContact, most_contacts> contacts{};
  Triple tool_W_m{};               // the rendered point at t_k, by the encoders
  double proxy_clearance_m = 0.0;  // signed distance of the proxy to the nearest surface; below 0: inside
  // Signed distance of the tool to the nearest surface: in simulation of the true tool, else by the encoders.
  double tool_clearance_m = 0.0;
  std::array<std::int32_t, max_axes> target_counts{};  // 607A sent in this cycle; in torque mode 6071
  std::array<std::int32_t, max_axes> actual_counts{};  // 6064, sampled at this cycle's SYNC

  // M and B of this step; impedance type: 0.
  double proxy_mass_kg = 0.0, proxy_damping_Ns_per_m = 0.0;
  // Mass of the tool behind the sensor, which the hand feels in addition to the proxy's mass; 0: not recorded.
  double tool_mass_kg = 0.0;

  std::array<double, 4> proxy_q_W{0.0, 0.0, 0.0, 1.0};  // the proxy's orientation: x y z w
  Triple contact_torque_W_Nm{};                         // torque of the contacts on the proxy, about the rendered point
  double proxy_inertia_kg_m2 = 0.0;                     // felt inertia J of this step; 0: the orientation is held
  double proxy_turning_damping_Nms_per_rad = 0.0;       // rotational damping of this step

  // From PassivityObserver, if there is one.
  PortEnergies energies_J{};
  // For a tool that turns: sums of the displacements and rotations since rendering began, by the links.
  Triple links_W_m{}, links_W_rad{};
  // Work of the limits on the proxy since rendering began (limits_work.hpp).
  double limits_work_J = 0.0;
  double added_damping_Ns_per_m = 0.0, felt_damping_Ns_per_m = 0.0, oscillation_m_per_s = 0.0;

  std::int64_t refused_period_ns = 0;          // a timestep that was refused in this cycle; 0: none
  fieldbus::PeriodRefusal timestep_refusal{};  // which drive refused the timestep, and why

  // The simulation's true state at t_k; valid with the flag `truth`.
  Triple true_tool_W_m{};
  Triple hand_force_W_N{}, hand_torque_W_Nm{};              // wrench of the hand on the tool, about the rendered point
  std::array<double, 4> true_tool_q_W{0.0, 0.0, 0.0, 1.0};  // the tool's orientation: x y z w
  Triple true_acceleration_W_m_per_s2{};

  // Wall-clock time of the whole cycle without waiting; only for timing.json.
  std::int64_t compute_ns = 0;

  [[nodiscard]] std::size_t recorded_contacts() const noexcept {
    return std::min<std::size_t>(contact_count, most_contacts);
  }
  [[nodiscard]] bool has(RecordFlag flag) const noexcept { return (flags & static_cast<std::uint32_t>(flag)) != 0; }
  void set(RecordFlag flag, bool on = true) noexcept {
    const auto bit = static_cast<std::uint32_t>(flag);
    flags = on ? flags | bit : flags & ~bit;
  }
};

static_assert(std::is_trivially_copyable_v<CycleRecord>);

}  // namespace proxarm::controller
