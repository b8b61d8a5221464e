// Judges whether (26) is stable while the hand leads the tool and turns it at once, in free motion and in contact.
//
// stability.hpp judges position and rotation separately. On elastic gears the two are coupled: a mode of the links
// moves and turns the handle, and the proxy's yielding to force and to torque both drive it. (The default cell with 2
// kg and 0.01 kg m² passes both checks, and swings at 15 Hz in free motion.) Here the tool's space has six dimensions,
// positions before rotations, and elastic_loop.hpp's matrices are
//   K_h = diag(K E, K_φ E), the same for D_h and m_h      of the hand, in position and rotation
//   m_t = [m E, −m [c]ₓ; m [c]ₓ, I]                       of what hangs behind the sensor, about T
//   A(w) with diag(M E, J E) − m_t in the place of M      of the proxy
//
// A contact removes directions from the proxy: if its point r, from T, may not move along n, then Nᵀ q = 0 with N = (n,
// r × n), and (26b) is q = p̂ − K⁻¹N (Nᵀ K⁻¹ N)⁻¹ Nᵀ p̂. The contact doesn't hold the real arm. Free motion is judged,
// and each given contact alone, sliding without friction (n) and sticking (all directions at r). Two or three contacts
// at once change the smallest stable inertia by at most 12 % (random contacts within 0.03 m, default cell, 2 to 6 kg).
//
// For a point tool that presses on elastic layers (loop.layers), their springs are added to K_v, sliding and sticking.
// A tool with a shape touches no layers.
//
// Each case, like the masses of stability.hpp, is judged with drives that lag and with drives that feed forward
// (elastic_loop.hpp), since the cell doesn't say which it has. For modes of the wrist at 60 to 80 Hz, feed-forward has
// 1.5 times the gain of a lag.
//
// Not modelled: what elastic_loop.hpp leaves out; contacts that come and go.
//
// For set-up: one to two milliseconds per mass and contact; allocates; not for the cycle.
#pragma once

#include <optional>
#include <vector>

#include "controller/stability/elastic_loop.hpp"
#include "controller/stability/stability.hpp"
#include "controller/stability/verdict.hpp"

namespace proxarm::controller {

// A touched point of the tool, from T in W, and the unit direction in which it is held.
struct TouchedPlace {
  models::Vec3 r_W_m, n_W;
};

struct PoseLoopModel {
  HandModel place, turning;  // turning: Nm/rad, Nms/rad, kg m²
  models::Mat6 behind_sensor_W = models::Mat6::Zero();
  double turning_damping_Nms_per_rad = 0.0, turning_spring_Nm_per_rad = 0.0;  // of the proxy
  LoopModel loop{};  // all times, and the proxy's damping and spring for its position
  std::vector<TouchedPlace> touched{};
};

// m_t of the tool behind the cell's sensor, in this orientation of the tool.
models::Mat6 behind_sensor_W(const description::Cell& cell, const models::Mat3& R_WT);

class PoseLoop {
 public:
  // Precondition: an arm of six axes or more, order 1, a hand that twists the handle.
  PoseLoop(const ElasticArm& arm, const PoseLoopModel& model);
  // Whether the loop is stable in free motion and in all contacts, with elastic_margin. Felt mass and inertia include
  // what hangs behind the sensor.
  [[nodiscard]] bool stable(double mass_kg, double inertia_kg_m2) const;
  // Returns the inertia, kg m², above which every one up to `largest_kg_m2` is stable with this mass; nullopt if the
  // largest itself is unstable. Unstable inertias between stable ones may be missed.
  [[nodiscard]] std::optional<double> smallest_inertia(double mass_kg) const;
  // Returns the swing that takes longest to die away, free or in contact. (A fast mode with a lower damping ratio may
  // be gone sooner.) Absent if a mode doesn't die away, or if none is faster than 3 Hz.
  [[nodiscard]] std::optional<Swing> slowest_swing(double mass_kg, double inertia_kg_m2) const;

  static constexpr double largest_kg_m2 = 10.0;

 private:
  // A contact of the proxy: the directions N that are held, and the spring of layers.
  struct Touch {
    Eigen::MatrixXd forbidden;
    models::Mat6 spring = models::Mat6::Zero();
  };
  static std::vector<Touch> touches_of(const PoseLoopModel& model);
  [[nodiscard]] bool stable(const ElasticLoop& loop, const Touch& touch, double mass_kg, double inertia_kg_m2) const;
  [[nodiscard]] ProxyMatrices proxy(const Touch& touch, double mass_kg, double inertia_kg_m2, double margin) const;

  std::vector<ElasticLoop> loops_;  // with drives that lag, and with drives that feed forward
  models::Mat6 behind_;
  ProxyMatrices own_;           // the proxy's damping and spring
  std::vector<Touch> touches_;  // the first one is free motion
  double period_s_;
};

// Builds the loop with the arm in this pose. The touched places of `model` are from T in T's axes; its behind_sensor_W
// is replaced by the cell's. Horizon and order of `model.loop` are ignored: only positions are predicted, and rotation
// and contacts are computed with order 1.
PoseLoop pose_loop_at(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell,
                      PoseLoopModel model);

// Throws description::SetupError about --inertia, which names the smallest stable felt inertia, rounded up to two
// digits, or says that none is stable with this mass.
[[noreturn]] void refuse_unstable_pose(double mass_kg, double inertia_kg_m2, const std::optional<double>& smallest);

}  // namespace proxarm::controller
