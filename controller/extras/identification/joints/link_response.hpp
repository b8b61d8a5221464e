// Computes small motions of links and sensor about a pose, as a response to motions of the motors, for each line of a
// spectrum.
//
// θ are the motors' angles and φ the links' angles (rad at the joint; for linear joints m), at a frequency ω (rad/s):
//   (K + iωD − ω² S M S + G) φ = (K + iωD) θ                                                  (1)
//   K, D: diagonal, Nm/rad and Nms/rad;  M: links and tool without rotors, kg m²;  G = ∂τ_g/∂φ, Nm/rad;
//   S: diagonal, about 1: square root of the ratio of the links' true inertia to the URDF's
// The gears' torques drive the links:
//   τ_gear = (G − ω²M) φ                                                                      (2)
// The tool behind the sensor has the mass m, the centre of mass C and the inertia I about C. The sensor reads, in S,
//   F = m R_SW (ω² J_C φ − (J_ω φ) × g),   τ = c × F + ω² I R_SW J_ω φ                        (3)
// J_C and J_ω are the Jacobians of C and of the rotation, in W.
#pragma once

#include <Eigen/Core>
#include <complex>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

using ComplexJoints = Eigen::VectorXcd;
using ComplexWrench = Eigen::Matrix<std::complex<double>, 6, 1>;  // force, torque

struct Gears {
  Eigen::VectorXd stiffness_Nm_per_rad, damping_Nms_per_rad;
  Eigen::VectorXd inertia_root;  // S of (1)
};

class LinkResponse {
 public:
  // The links' inertias are the cell's inertias times `inertia_share`.
  LinkResponse(const description::Cell& cell, const models::Arm& arm, const models::JointVector& motor_rad,
               double inertia_share = 1.0);

  [[nodiscard]] ComplexJoints links(const Gears& gears, double omega, const ComplexJoints& motors) const;  // (1)
  [[nodiscard]] ComplexJoints gear_torques(double omega, const ComplexJoints& links) const;                // (2)
  [[nodiscard]] ComplexWrench reading(double omega, const ComplexJoints& links) const;                     // (3)
  [[nodiscard]] const Eigen::MatrixXd& mass_kg_m2() const noexcept { return mass_; }

 private:
  Eigen::MatrixXd mass_, gravity_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> per_acceleration_, per_angle_;  // parts of the reading: per −ω² φ, and per φ
};

}  // namespace proxarm::identification
