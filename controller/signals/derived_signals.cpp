#include "controller/signals/derived_signals.hpp"

#include <algorithm>

namespace proxarm::controller {

SignalDeriver::SignalDeriver(const description::Cell& cell) : cell_(cell), arm_(cell) {}

DerivedSignals SignalDeriver::derive(const CycleRecord& record) const {
  DerivedSignals out;
  for (std::size_t i = 0; i < cell_.drives.size() && i < max_axes; ++i) {
    const description::DriveDescription& drive = cell_.drives[i];
    out.torques = out.torques || drive.mode == "cst";
    out.target_rad[i] = drive.angle_rad(record.target_counts[i]);
    out.actual_rad[i] = drive.angle_rad(record.actual_counts[i]);
    // 6071h is in thousandths of the rated torque, with the sign of the counts.
    out.target_Nm[i] = 1e-3 * drive.direction * record.target_counts[i] * drive.rated_torque_Nm;
  }
  const Eigen::Quaterniond q(arm_.tool_pose(link_rad(record)).linear());
  out.tool_q_W = {q.x(), q.y(), q.z(), q.w()};
  return out;
}

models::JointVector SignalDeriver::link_rad(const CycleRecord& record) const {
  models::JointVector motor(static_cast<Eigen::Index>(cell_.drives.size()));
  for (std::size_t i = 0; i < cell_.drives.size() && i < max_axes; ++i) {
    motor[static_cast<Eigen::Index>(i)] = cell_.drives[i].angle_rad(record.actual_counts[i]);
  }
  return arm_.link_from_motor(motor);
}

}  // namespace proxarm::controller
