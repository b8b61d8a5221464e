#include "controller/signals/derived_signals.hpp"

#include <algorithm>

namespace proxarm::controller {

SignalDeriver::SignalDeriver(const description::Cell& cell) : cell_(cell), arm_(cell) {}

DerivedSignals SignalDeriver::derive(const CycleRecord& record) const {
  DerivedSignals out;
  models::JointVector motor(static_cast<Eigen::Index>(cell_.drives.size()));
  for (std::size_t i = 0; i < cell_.drives.size() && i < max_axes; ++i) {
    const description::DriveDescription& drive = cell_.drives[i];
    out.torques = out.torques || drive.mode == "cst";
    out.target_rad[i] = drive.angle_rad(record.target_counts[i]);
    out.actual_rad[i] = drive.angle_rad(record.actual_counts[i]);
    // 6071h: thousandths of the rated torque, by the sense of the counts.
    out.target_Nm[i] = 1e-3 * drive.direction * record.target_counts[i] * drive.rated_torque_Nm;
    motor[static_cast<Eigen::Index>(i)] = out.actual_rad[i];
  }
  const Eigen::Quaterniond q(arm_.tool_pose(arm_.link_from_motor(motor)).linear());
  out.tool_q_W = {q.x(), q.y(), q.z(), q.w()};
  return out;
}

}  // namespace proxarm::controller
