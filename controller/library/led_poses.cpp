#include "controller/library/led_poses.hpp"

#include <algorithm>

#include "controller/preparation/session_loops.hpp"

namespace proxarm::controller {

LedPoses::LedPoses(const PreparedSession& session, const RunOptions& options, const SignalDeriver& deriver)
    : session_(session),
      options_(options),
      deriver_(deriver),
      watch_(PassedPoses(deriver.arm(), session.cell, hand_model(session), session.loop, turned_model(session))),
      loop_(session.loop) {
  if (options.view_place || !options.record_dir.empty()) watch_.find_smallest();
}

void LedPoses::add(const CycleRecord& record) {
  follow_timestep(record);
  follow_lateness(record);
  if (record.phase == Phase::rendering) pass(record);
}

void LedPoses::follow_timestep(const CycleRecord& record) {
  const bool refused = record.refused_period_ns > 0;
  if (refused || record.has(RecordFlag::timestep) || record.period_ns == period_ns_) return;
  if (period_ns_ > 0) {
    loop_ = with_timestep(session_, options_, 1e-9 * static_cast<double>(record.period_ns)).loop;
    watch_.change(judged_loop());
  }
  period_ns_ = record.period_ns;
}

// A sample that comes a cycle late is a cycle older when it acts.
LoopModel LedPoses::judged_loop() const {
  LoopModel loop = loop_;
  if (samples_late_) loop.delay_s += loop.period_s;
  return loop;
}

void LedPoses::follow_lateness(const CycleRecord& record) {
  constexpr double average_s = 0.25;
  const double period_s = 1e-9 * static_cast<double>(record.period_ns);
  const double late = record.has(RecordFlag::sample_late) ? 1.0 : 0.0;
  late_share_ += std::min(1.0, period_s / average_s) * (late - late_share_);
  if ((late_share_ > 0.5) == samples_late_) return;
  samples_late_ = !samples_late_;
  watch_.change(judged_loop());
}

void LedPoses::pass(const CycleRecord& record) {
  if (!(record.added_damping_Ns_per_m > 0.0)) user_damping_Ns_per_m_ = record.proxy_damping_Ns_per_m;
  const auto joints_rad = [&] { return deriver_.link_rad(record); };
  const bool turns = record.proxy_inertia_kg_m2 > 0.0;
  const PassedPoses::Felt felt{.mass_kg = record.proxy_mass_kg + record.tool_mass_kg,
                               .damping_Ns_per_m = user_damping_Ns_per_m_,
                               .inertia_kg_m2 = record.proxy_inertia_kg_m2,
                               .turning_damping_Nms_per_rad = record.proxy_turning_damping_Nms_per_rad};
  const models::ToolPose tool_W{vec3(record.tool_W_m),
                                turns ? models::Quaternion(record.proxy_q_W.data()) : models::Quaternion::Identity()};
  watch_.pass(1e-9 * static_cast<double>(record.time_ns), tool_W, felt, joints_rad);
}

}  // namespace proxarm::controller
