#include "controller/report/latency.hpp"

#include <optional>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sync.hpp"
#include "fieldbus/sensors/force_sensor.hpp"

namespace proxarm::controller {
namespace {

bool is_setpoint(const fieldbus::CanFrame& frame) {
  return !frame.extended && frame.id > fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, 0) &&
         frame.id <= fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, 127);
}

}  // namespace

LatencySummary latency_summary(const LatencyHistogram& times) {
  LatencySummary summary{times.quantile_us(0.5), times.quantile_us(0.99), times.quantile_us(0.999), times.max_us(), {}};
  for (std::size_t bin = 0; bin < times.counts().size(); ++bin) {
    if (times.counts()[bin] == 0) continue;
    summary.histogram.emplace_back(static_cast<std::int64_t>(times.begin_us(bin)), times.counts()[bin]);
  }
  return summary;
}

void LatencyMeter::drain() {
  BoxCycle cycle;
  std::vector<BoxFrame> frames;
  next_ = std::max(next_, box_.oldest_cycle());
  for (; next_ < box_.cycles(); ++next_) {
    if (box_.read(next_, cycle, frames)) add(cycle, frames);
  }
}

void LatencyMeter::add(const BoxCycle& cycle, const std::vector<BoxFrame>& frames) {
  std::optional<std::int64_t> sync_ns, sample_ns, setpoint_ns;
  for (const BoxFrame& frame : frames) {
    const fieldbus::CanFrame& f = frame.frame;
    if (frame.sent && f.id == fieldbus::sync_id && !f.extended && !sync_ns) sync_ns = frame.time_ns;
    if (frame.sent && is_setpoint(f)) setpoint_ns = frame.time_ns;
    const std::uint32_t id = f.extended ? f.id | fieldbus::extended_id_flag : f.id;
    const bool of_sensor = std::find(sensor_ids_.begin(), sensor_ids_.end(), id) != sensor_ids_.end();
    if (!frame.sent && frame.bus == sensor_bus_ && of_sensor) sample_ns = frame.time_ns;
  }
  if (sync_ns) latencies_.wake_up.add(*sync_ns - cycle.t_k_ns);
  latencies_.compute.add(cycle.record.compute_ns);
  const bool fresh = !cycle.record.has(RecordFlag::sample_held);
  if (fresh && sample_ns && setpoint_ns) latencies_.sensor_to_setpoint.add(*setpoint_ns - *sample_ns);
}

}  // namespace proxarm::controller
