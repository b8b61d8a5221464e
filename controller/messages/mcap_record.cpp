#include "controller/messages/mcap_record.hpp"

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

void McapRecord::write(Topic topic, const Moment& moment) {
  writer_.add(channels_[static_cast<std::size_t>(topic)], moment.record.time_ns,
              messages_.message(topic, moment, links_, objects_));
}

// Writes a message if there are contacts, and one more message after the last contact.
void McapRecord::write_contacts(Topic topic, const Moment& moment, bool& told) {
  const bool some = moment.record.recorded_contacts() > 0;
  if (some || told) write(topic, moment);
  told = some;
}

void McapRecord::drain(const controller::BoxReader& box) {
  for (const std::uint64_t end = box.cycles(); !waiting_.empty() && waiting_.front().cycle < end;
       waiting_.pop_front()) {
    if (!box.read(waiting_.front().cycle, cycle_)) continue;
    cycle_.record = waiting_.front();
    write(cycle_);
  }
}

void McapRecord::write(const controller::BoxCycle& cycle) {
  const double rendered_s = 1e-9 * static_cast<double>(cycle.rendered_ns);
  stage_.follow(cycle.change, cycle.record.phase == controller::Phase::rendering,
                1e-9 * static_cast<double>(cycle.record.period_ns));
  builder_.add(cycle.record, rendered_s);
  const Moment moment = builder_.take();
  for (const Topic topic : {Topic::wrench, Topic::contact, Topic::joint_states}) write(topic, moment);
  write_contacts(Topic::contacts, moment, told_contacts_);
  if (cycles_++ % cycles_per_pose != 0) return;
  write_contacts(Topic::contact_arrows, moment, told_arrows_);
  stage_.place(moment.record, rendered_s, links_, objects_);
  if (cycles_ == 1 || !same(objects_, drawn_)) {
    drawn_ = objects_;
    write(Topic::scene, moment);
  }
  for (const Topic topic : {Topic::tool, Topic::proxy, Topic::session, Topic::transforms}) write(topic, moment);
}

void McapRecord::finish() { writer_.finish(); }

}  // namespace proxarm::view
