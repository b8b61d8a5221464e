#include "controller/signals/clearances.hpp"

#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

// Order 2's proxy is where it is a period before that of (26): see proxies/bdf2.hpp.
void add_clearances(CycleRecord& record, const scenes::Scene& scene, int order, std::int64_t rendered_ns) {
  const std::int64_t later_ns = order == 2 ? record.period_ns : 0;
  const double scene_time_s = static_cast<double>(rendered_ns - later_ns) / 1e9;
  const models::Vec3 proxy_W = vec3(record.proxy_W_m);
  const models::Vec3 tool_W = vec3(record.has(RecordFlag::truth) ? record.true_tool_W_m : record.tool_W_m);
  record.proxy_clearance_m = scenes::clearance_m(scene, proxy_W, scene_time_s, scenes::Driven::left_out);
  record.tool_clearance_m = scenes::tool_clearance_m(scene, tool_W, proxy_W, scene_time_s, scenes::Driven::left_out);
}

}  // namespace proxarm::controller
