#include "controller/signals/clearances.hpp"

#include "controller/signals/point_contacts.hpp"

namespace proxarm::controller {

void add_clearances(CycleRecord& record, const scenes::Scene& scene, const scenes::Clearances& clearances,
                    std::int64_t rendered_ns) {
  const double scene_time_s = static_cast<double>(rendered_ns) / 1e9;
  const models::Vec3 proxy_W = vec3(record.proxy_W_m);
  const models::Vec3 tool_W = vec3(record.has(RecordFlag::truth) ? record.true_tool_W_m : record.tool_W_m);
  record.proxy_clearance_m = clearances.of_point(proxy_W, scene_time_s, scenes::Driven::left_out);
  record.tool_clearance_m = clearances.of_tool(tool_W, proxy_W, scene_time_s, scenes::Driven::left_out);
  place_contacts(record);
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
    RecordedContact& contact = record.contacts[i];
    const auto object = static_cast<std::size_t>(contact.object);
    if (contact.object < 0 || object >= scene.objects.size()) continue;
    const auto& layer = scene.objects[object].layer;
    const auto core_m = clearances.of_object(object, proxy_W, scene_time_s);
    contact.gap_m = core_m.value_or(0.0) - (core_m && layer ? layer->thickness_m : 0.0);
  }
}

void add_clearances(CycleRecord& record, const models::PoseAlgorithm& rigid, std::int64_t rendered_ns) {
  const double scene_time_s = static_cast<double>(rendered_ns) / 1e9;
  const auto clearance_m = [&](const Triple& x_W, const std::array<double, 4>& q) {
    return rigid.clearance_at_m({vec3(x_W), models::Quaternion(q[3], q[0], q[1], q[2])}, scene_time_s);
  };
  const bool truth = record.has(RecordFlag::truth);
  record.proxy_clearance_m = clearance_m(record.proxy_W_m, record.proxy_q_W);
  record.tool_clearance_m =
      truth ? clearance_m(record.true_tool_W_m, record.true_tool_q_W) : clearance_m(record.tool_W_m, record.proxy_q_W);
}

}  // namespace proxarm::controller
