#include "controller/signals/clearances.hpp"

#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

void add_clearances(CycleRecord& record, const scenes::Scene& scene, std::int64_t rendered_ns) {
  const double scene_time_s = static_cast<double>(rendered_ns) / 1e9;
  const models::Vec3 proxy_W = vec3(record.proxy_W_m);
  const models::Vec3 tool_W = vec3(record.has(RecordFlag::truth) ? record.true_tool_W_m : record.tool_W_m);
  record.proxy_clearance_m = scenes::clearance_m(scene, proxy_W, scene_time_s, scenes::Driven::left_out);
  record.tool_clearance_m = scenes::tool_clearance_m(scene, tool_W, proxy_W, scene_time_s, scenes::Driven::left_out);
}

}  // namespace proxarm::controller
