// A drive of one's own for one joint, beside the cell's drives on CAN: on a wire that proxarm doesn't know.
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "controller/library/session.hpp"
#include "fieldbus/cia402/cia402_units.hpp"

namespace fieldbus = proxarm::fieldbus;
using fieldbus::DriveGoal;
using fieldbus::DriveState;

class OwnDrive final : public fieldbus::CyclicDrive {
 public:
  OwnDrive(proxarm::sim::Plant& arm, std::size_t axis, const proxarm::description::DriveDescription& description,
           double period_s)
      : arm_(arm), axis_(axis), description_(description), scale_(description) {
    arm_.servo(axis_).set_interpolation_period_ns(std::llround(1e9 * period_s));
  }

  // Once a cycle, with the SYNC of the others: what was set in the last one goes out, and the position comes in. Here
  // the wire's far end is the simulated arm's servo.
  void on_sync(std::int64_t now_ns) noexcept override {
    proxarm::sim::ServoLoop& servo = arm_.servo(axis_);
    if (goal_ == DriveGoal::operation_enabled) {
      if (!servo.powered()) arm_.enable(axis_, now_ns);
      if (target_) servo.set_target(*target_, now_ns);
    } else if (servo.powered()) {
      if (goal_ == DriveGoal::quick_stop && !servo.at_rest()) {
        servo.stop(description_.max_acceleration_rad_per_s2, now_ns);
      } else {
        arm_.switch_off(axis_);
      }
    }
    enabled_ = servo.powered();
    if (!enabled_) target_.reset();
    actual_counts_ = servo.position_counts();
  }

  void request(DriveGoal goal) noexcept override { goal_ = goal; }
  bool set_target_rad(double angle_rad) noexcept override {
    const std::optional<std::int32_t> counts = scale_.counts(angle_rad);
    if (!following() || !counts) return false;
    target_ = counts;
    return true;
  }

  // No frame of a CAN bus comes or goes.
  bool on_frame(const fieldbus::CanFrame&, std::int64_t) noexcept override { return false; }
  bool encode_rpdo(fieldbus::CanFrame&) noexcept override { return false; }

  [[nodiscard]] bool fresh() const noexcept override { return true; }
  [[nodiscard]] std::uint32_t cycles_without_tpdo() const noexcept override { return 0; }
  [[nodiscard]] bool following() const noexcept override { return enabled_ && goal_ == DriveGoal::operation_enabled; }
  [[nodiscard]] DriveState state() const noexcept override {
    return enabled_ ? DriveState::operation_enabled : DriveState::switch_on_disabled;
  }
  [[nodiscard]] std::int32_t actual_counts() const noexcept override { return actual_counts_; }
  [[nodiscard]] double actual_rad() const noexcept override { return scale_.angle_rad(actual_counts_); }
  [[nodiscard]] std::int32_t target_counts() const noexcept override { return target_.value_or(actual_counts_); }
  [[nodiscard]] double target_rad() const noexcept override { return scale_.angle_rad(target_counts()); }
  [[nodiscard]] fieldbus::DriveFault fault() const noexcept override { return fieldbus::DriveFault::none; }
  void forget_fault() noexcept override {}
  [[nodiscard]] std::string describe() const override { return "a drive of one's own"; }
  [[nodiscard]] const proxarm::description::DriveDescription& description() const noexcept override {
    return description_;
  }
  void archive(fieldbus::StateArchive& state) noexcept override { state(goal_, enabled_, actual_counts_); }

 private:
  proxarm::sim::Plant& arm_;
  std::size_t axis_;
  proxarm::description::DriveDescription description_;
  fieldbus::CountScale scale_;
  DriveGoal goal_ = DriveGoal::none;
  std::optional<std::int32_t> target_;
  std::int32_t actual_counts_ = 0;
  bool enabled_ = false;
};

int main() try {
  proxarm::Session session({{"duration", 6.0}});
  const double period_s = session.prepared().settings.period_s;
  session.set_drive("axis_6", [=](proxarm::controller::FarEnd& far_end, std::size_t axis,
                                  const proxarm::description::DriveDescription& description) {
    return std::make_unique<OwnDrive>(far_end.cell.plant(), axis, description, period_s);
  });
  const proxarm::Summary summary = session.run();
  std::printf("%s", proxarm::summary_text(summary).c_str());
  return summary.faults.empty() && summary.contacts == 1 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
