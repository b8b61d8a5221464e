#include "controller/view/messages/mcap_record.hpp"

#include <algorithm>
#include <map>

namespace proxarm::view {
namespace {

constexpr std::uint64_t cycles_per_pose = 10;

bool same(const std::vector<models::Pose>& a, const std::vector<models::Pose>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                            [](const auto& x, const auto& y) { return x.matrix() == y.matrix(); });
}

}  // namespace

McapRecord::McapRecord(const std::filesystem::path& file, Stage& stage)
    : stage_(stage), messages_(stage), writer_(file), builder_(stage.handle_mass_kg()) {
  std::map<std::string, std::uint16_t> schemas;
  for (std::size_t i = 0; i < topic_count; ++i) {
    const TopicDescription& topic = describe(static_cast<Topic>(i));
    if (!schemas.contains(topic.schema)) schemas[topic.schema] = writer_.add_schema(topic.schema, topic.json_schema);
    channels_[i] = writer_.add_channel(topic.topic, schemas[topic.schema]);
  }
}

void McapRecord::add(Topic topic, const Moment& moment) {
  writer_.add(channels_[static_cast<std::size_t>(topic)], moment.record.time_ns,
              messages_.message(topic, moment, links_, objects_));
}

void McapRecord::drain(const controller::BoxReader& box) {
  next_ = std::max(next_, box.oldest_cycle());
  for (const std::uint64_t end = box.cycles(); next_ < end; ++next_) {
    if (box.read(next_, cycle_)) add(cycle_);
  }
}

void McapRecord::add(const controller::BoxCycle& cycle) {
  const double rendered_s = 1e-9 * static_cast<double>(cycle.rendered_ns);
  stage_.follow(cycle.change, cycle.record.phase == controller::Phase::rendering,
                1e-9 * static_cast<double>(cycle.record.period_ns));
  builder_.add(cycle.record, rendered_s);
  Moment moment = builder_.take();
  stage_.complete(moment.record, rendered_s);
  for (const Topic topic : {Topic::wrench, Topic::contact, Topic::joint_states}) add(topic, moment);
  if (cycles_++ % cycles_per_pose != 0) return;
  stage_.place(moment.record, rendered_s, links_, objects_);
  if (cycles_ == 1 || !same(objects_, drawn_)) {
    drawn_ = objects_;
    add(Topic::scene, moment);
  }
  for (const Topic topic : {Topic::tool, Topic::proxy, Topic::session, Topic::transforms}) add(topic, moment);
}

void McapRecord::finish() { writer_.finish(); }

}  // namespace proxarm::view
