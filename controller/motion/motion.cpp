#include "controller/motion/motion.hpp"

#include <array>

#include "controller/motion/admittance_motion.hpp"
#include "controller/motion/torque_motion.hpp"

namespace proxarm::controller {

void record_world(const WorldStep& step, CycleRecord& record) noexcept {
  record.p_hat_W_m = triple(step.p_hat_W);
  record.contact_force_W_N = triple(step.f_W);
  record.contact_torque_W_Nm = triple(step.torque_W);
  record.proxy_mass_kg = step.mass_kg;
  record.proxy_damping_Ns_per_m = step.damping_Ns_per_m;
  record.set(RecordFlag::unresolved, step.unresolved);
  record.contact_count = static_cast<std::uint8_t>(step.contacts);
  static_assert(std::tuple_size_v<Touches> == most_contacts);
  for (std::size_t i = 0; i < step.touches.size(); ++i) {
    const models::PoseContact& touch = step.touches[i];
    record.contacts[i] = {.object = touch.object,
                          .part = touch.part,
                          .slips = touch.slips,
                          .friction = touch.friction,
                          .gap_m = touch.gap_m,
                          .point_W_m = triple(touch.point_W),
                          .normal_W = triple(touch.normal_W),
                          .force_W_N = triple(touch.force_W)};
  }
  record.contact = step.contacts == 0 ? ContactPhase::free : step.slips ? ContactPhase::slip : ContactPhase::stick;
}

std::vector<description::DriveDescription> descriptions(const std::vector<DriveOnBus>& drives) {
  std::vector<description::DriveDescription> all;
  for (const DriveOnBus& axis : drives) all.push_back(axis.drive.description());
  return all;
}

std::unique_ptr<Motion> make_motion(CycleParts& parts, const SessionSettings& settings,
                                    const description::CellLimits& limits) {
  std::vector<description::DriveDescription> drives = descriptions(parts.drives);
  if (auto* const torque = std::get_if<std::unique_ptr<TorqueRendering>>(&parts.rendering)) {
    description::SupervisionDescription supervision = parts.supervision;
    if (settings.always_held) supervision.let_go = description::LetGo::coast;
    return std::make_unique<TorqueMotion>(std::move(*torque), *parts.arm, drives, supervision,
                                          parts.compensation.tool().mass_kg, settings.period_s);
  }
  return std::make_unique<AdmittanceMotion>(std::move(std::get<AdmittanceParts>(parts.rendering)), *parts.arm,
                                            std::move(drives), limits, parts.supervision, settings,
                                            parts.compensation.tool());
}

}  // namespace proxarm::controller
