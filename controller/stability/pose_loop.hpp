// Whether (26) is stable while the hand leads the tool and turns it at once, also where the tool touches something.
//
// stability.hpp judges the tool's place with its orientation held, and its rotation with its place held. On elastic
// gears the two aren't apart: a mode of the links moves and turns the handle, so the proxy's yielding to the force and
// to the torque both drive it. (The default cell with 2 kg and 0.01 kg m² passes both checks, and swings at 15 Hz in
// free motion.) Here the tool's space has six dimensions, places before rotations, and elastic_loop.hpp's matrices are
//   K_h = diag(K E, K_φ E), D_h and m_h likewise          of the hand, in place and rotation
//   m_t = [m E, −m [c]ₓ; m [c]ₓ, I]                       of what hangs behind the sensor, about T
//   A(w) with diag(M E, J E) − m_t in the place of M      of the proxy
//
// A contact takes directions from the proxy: where its place r from T may not move along n, Nᵀ q = 0 with
// N = (n, r × n), and (26b) is q = p̂ − K⁻¹N (Nᵀ K⁻¹ N)⁻¹ Nᵀ p̂. The steel isn't held by it: it is on its gears, and in
// the hand. Judged are free motion, and each of the contacts that are given alone, sliding without friction (n) and
// sticking (all directions at r). A tool that lies on an edge or a face has several at once; swept over such (two and
// three at random places within 0.03 m, default cell, 2 to 6 kg), the smallest stable inertia was within 12 % of that
// of the one or the other.
//
// A point tool that presses on elastic layers (loop.layers) has their springs in K_v, and sticks or slides there
// likewise; a tool with a shape touches nothing that has one.
//
// Each is judged with drives that lag and with drives that feed forward (elastic_loop.hpp), since the cell doesn't say
// which it has. A hand that turns stiffly makes modes of the wrist swing at 60 to 80 Hz, where feed-forward gives half
// as much gain again as a lag. For masses (stability.hpp) both are taken likewise: with the default hand at 1 ms the
// two are within 5 % on the default cell and the collaborative arm, 17 on the linear axis. Over random hands and places
// of touch, 56 in all, feed-forward asked for up to an eighth more also where modes are slow and the tool touches.
//
// Not modelled: what elastic_loop.hpp leaves out, and contacts that come and go.
//
// For set-up: takes one to two milliseconds per mass and contact, allocates, never runs in the cycle.
#pragma once

#include <optional>
#include <vector>

#include "controller/stability/elastic_loop.hpp"
#include "controller/stability/stability.hpp"
#include "controller/stability/verdict.hpp"

namespace proxarm::controller {

// A place of the tool, from T in W, and the direction in which something holds it, unit.
struct TouchedPlace {
  models::Vec3 r_W_m, n_W;
};

struct PoseLoopModel {
  HandModel place, turning;  // turning: Nm/rad, Nms/rad, kg m²
  models::Mat6 behind_sensor_W = models::Mat6::Zero();
  double turning_damping_Nms_per_rad = 0.0, turning_spring_Nm_per_rad = 0.0;  // of the proxy; those of its place …
  LoopModel loop{};                                                           // … are here, with all times
  std::vector<TouchedPlace> touched{};
};

// m_t of the tool behind the cell's sensor, turned so.
models::Mat6 behind_sensor_W(const description::Cell& cell, const models::Mat3& R_WT);

class PoseLoop {
 public:
  // Precondition: an arm of six axes or more, order 1, a hand that twists the handle.
  PoseLoop(const ElasticArm& arm, const PoseLoopModel& model);
  // Of felt mass and inertia, that behind the sensor included: whether the loop is stable, free and in all contacts.
  // With the margin of elastic loops (elastic_margin).
  [[nodiscard]] bool stable(double mass_kg, double inertia_kg_m2) const;
  // The inertia above which every one up to `largest_kg_m2` is stable with this mass; none: that one isn't itself. What
  // isn't stable between others that are may stay unseen.
  [[nodiscard]] std::optional<double> smallest_inertia(double mass_kg) const;
  // The swing that takes longest to die away, free or in touch: not the one with the least damping ratio, which a fast
  // mode has that is gone sooner. Absent: one doesn't die away, or none is faster than 3 Hz.
  [[nodiscard]] std::optional<Swing> slowest_swing(double mass_kg, double inertia_kg_m2) const;

  static constexpr double largest_kg_m2 = 10.0;

 private:
  // What the proxy touches: the directions N that are held, and the spring of layers.
  struct Touch {
    Eigen::MatrixXd forbidden;
    models::Mat6 spring = models::Mat6::Zero();
  };
  static std::vector<Touch> touches_of(const PoseLoopModel& model);
  [[nodiscard]] bool stable(const ElasticLoop& loop, const Touch& touch, double mass_kg, double inertia_kg_m2) const;
  [[nodiscard]] ProxyMatrices proxy(const Touch& touch, double mass_kg, double inertia_kg_m2, double margin) const;

  std::vector<ElasticLoop> loops_;  // with drives that lag, and with drives that feed forward
  models::Mat6 behind_;
  ProxyMatrices own_;           // its damping and spring
  std::vector<Touch> touches_;  // beginning with none
  double period_s_;
};

// With the arm in this pose. `model`: its touched places from T in T's own axes; what hangs behind the sensor is the
// cell's, and of its loop neither horizon nor order count: only a place is predicted, and rotation and contacts are
// computed with order 1.
PoseLoop pose_loop_at(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell,
                      PoseLoopModel model);

// Throws description::SetupError about --inertia that names the smallest stable felt inertia, rounded up to two digits,
// or says that none is with this mass.
[[noreturn]] void refuse_unstable_pose(double mass_kg, double inertia_kg_m2, const std::optional<double>& smallest);

}  // namespace proxarm::controller
