// A force sensor of one's own in the place of the cell's: on a wire that proxarm doesn't know, such as Ethernet.
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "controller/library/session.hpp"

using proxarm::fieldbus::CanFrame;

class OwnSensor final : public proxarm::fieldbus::ForceSensor {
 public:
  explicit OwnSensor(proxarm::sim::SimulatedCell& arm) : arm_(arm) {}

  // Nothing of it is on a CAN bus: no identifiers, no frame to be polled by, and none that it waits for.
  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const override { return {}; }
  void start(proxarm::fieldbus::CanNetwork&, std::size_t, const proxarm::fieldbus::FrameHandler&) override {}
  [[nodiscard]] std::string identity() const override { return "a sensor of one's own"; }
  bool on_frame(const CanFrame&, std::int64_t) noexcept override { return false; }

  // Once a cycle: the newest reading. On a machine it would lie in memory by then, left there by another thread; here
  // it is the load on the simulated sensor.
  bool poll(std::int64_t now_ns, CanFrame&) noexcept override {
    const proxarm::models::Wrench load_S = arm_.truth().sensor_wrench_S;
    sample_.wrench_S = {load_S.force.x(),  load_S.force.y(),  load_S.force.z(),
                        load_S.torque.x(), load_S.torque.y(), load_S.torque.z()};
    sample_.time_ns = now_ns;
    sample_.healthy = true;
    ++sample_.number;
    return false;
  }
  [[nodiscard]] bool fresh() const noexcept override { return true; }
  [[nodiscard]] const proxarm::fieldbus::ForceSample& latest() const noexcept override { return sample_; }
  void archive(proxarm::fieldbus::StateArchive& state) noexcept override { state(sample_); }
  [[nodiscard]] std::string describe_status(std::uint32_t) const override { return "fine"; }

 private:
  proxarm::sim::SimulatedCell& arm_;
  proxarm::fieldbus::ForceSample sample_;
};

int main() try {
  proxarm::Session session({{"duration", 6.0}});
  session.set_sensor([](proxarm::controller::FarEnd& far_end) { return std::make_unique<OwnSensor>(far_end.cell); });
  const proxarm::Summary summary = session.run();
  std::printf("%s", proxarm::summary_text(summary).c_str());
  return summary.faults.empty() && summary.contacts == 1 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
