// Judges whether (26) is stable while the hand leads and turns the tool at once, in free motion and in contact.
//
// stability.hpp judges position and rotation separately. On elastic gears, position and rotation are coupled: a mode of
// the links both moves and turns the handle, and the proxy drives the mode by yielding to force and by yielding to
// torque. (With 2 kg and 0.01 kg m², the default cell is stable in both separate checks, but swings at 15 Hz in free
// motion.) Here the tool's space has six dimensions, positions before rotations. The matrices of elastic_loop.hpp are
//   K_h = diag(K E, K_φ E), the same for D_h and m_h      of the hand, in position and rotation
//   m_t = [m E, −m [c]ₓ; m [c]ₓ, I]                       of what hangs behind the sensor, about T
//   A(w) with diag(M E, J E) − m_t in the place of M      of the proxy
//
// A contact takes directions away from the proxy. If the contact's point r, from T, may not move along n, then Nᵀ q = 0
// with N = (n, r × n), and (26b) is q = p̂ − K⁻¹N (Nᵀ K⁻¹ N)⁻¹ Nᵀ p̂. The contact doesn't hold the real arm. Free
// motion is judged, and each given contact alone: once sliding without friction (only n is held), once sticking (all
// directions at r are held). Two or three contacts at once change the smallest stable inertia by at most 12 % (random
// contacts within 0.03 m, default cell, 2 to 6 kg).
//
// If a point tool presses on elastic layers (loop.layers), the layers' springs are added to K_v, sliding and sticking.
// A tool with a shape touches no layers.
//
// Each case is judged with drives that lag and with drives that feed forward (elastic_loop.hpp), since the cell doesn't
// say which kind it has; stability.hpp does the same. For modes of the wrist at 60 to 80 Hz, the gain of feed-forward
// is 1.5 times the gain of a lag.
//
// Not modelled: all that elastic_loop.hpp doesn't model; contacts that come and go.
//
// For set-up, not for the cycle: takes one to two milliseconds per mass and contact; allocates.
#pragma once

#include <optional>
#include <vector>

#include "controller/stability/elastic_loop.hpp"
#include "controller/stability/stability.hpp"
#include "controller/stability/verdict.hpp"

namespace proxarm::controller {

// A point of the tool that is touched, from T in W, and the unit direction in which the contact holds it.
struct TouchedPlace {
  models::Vec3 r_W_m, n_W;
};

struct PoseLoopModel {
  // How the hand holds the tool. Units of `turning`: Nm/rad, Nms/rad, kg m².
  HandModel place, turning;
  models::Mat6 behind_sensor_W = models::Mat6::Zero();
  double turning_damping_Nms_per_rad = 0.0,
         turning_spring_Nm_per_rad = 0.0;  // the proxy's rotational damping and spring
  LoopModel loop{};                        // all times; the proxy's damping and spring for its position
  std::vector<TouchedPlace> touched{};
};

// Returns m_t of the part behind the cell's sensor, with the tool in this orientation.
models::Mat6 behind_sensor_W(const description::Cell& cell, const models::Mat3& R_WT);

class PoseLoop {
 public:
  // Precondition: the arm has six axes or more, the order is 1, and the hand twists the handle.
  PoseLoop(const ElasticArm& arm, const PoseLoopModel& model);
  // Returns whether the loop is stable in free motion and in all contacts, with elastic_margin. The felt mass and
  // inertia include the part behind the sensor.
  [[nodiscard]] bool stable(double mass_kg, double inertia_kg_m2) const;
  // Returns the inertia, kg m², above which every inertia up to `largest_kg_m2` is stable with this mass; nullopt if
  // `largest_kg_m2` itself is unstable. Unstable inertias between stable ones may be missed.
  [[nodiscard]] std::optional<double> smallest_inertia(double mass_kg) const;
  // Returns the swing that takes longest to die away, in free motion or in contact. (A faster mode with a lower damping
  // ratio may die away sooner.) Returns nullopt if a mode doesn't die away, or if no mode is faster than 3 Hz.
  [[nodiscard]] std::optional<Swing> slowest_swing(double mass_kg, double inertia_kg_m2) const;

  static constexpr double largest_kg_m2 = 10.0;

 private:
  // A contact of the proxy: the held directions N, and the spring of elastic layers.
  struct Touch {
    Eigen::MatrixXd forbidden;
    models::Mat6 spring = models::Mat6::Zero();
  };
  static std::vector<Touch> touches_of(const PoseLoopModel& model);
  [[nodiscard]] bool stable(const ElasticLoop& loop, const Touch& touch, double mass_kg, double inertia_kg_m2) const;
  [[nodiscard]] ProxyMatrices proxy(const Touch& touch, double mass_kg, double inertia_kg_m2, double margin) const;

  std::vector<ElasticLoop> loops_;  // one loop with drives that lag, one with drives that feed forward
  models::Mat6 behind_;
  ProxyMatrices own_;           // the proxy's damping and spring
  std::vector<Touch> touches_;  // the first one is free motion
  double period_s_;
};

// Returns the loop with the arm in this pose. The touched places of `model` are from T in T's axes.
// `model.behind_sensor_W` is ignored; the cell's tool replaces it. Horizon and order of `model.loop` are ignored, too:
// lookahead predicts only positions, and rotation and contacts are computed with order 1.
PoseLoop pose_loop_at(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell,
                      PoseLoopModel model);

// Throws description::SetupError about --inertia. The error names the smallest stable felt inertia, rounded up to two
// digits, or says that no inertia is stable with this mass.
[[noreturn]] void refuse_unstable_pose(double mass_kg, double inertia_kg_m2, const std::optional<double>& smallest);

}  // namespace proxarm::controller
