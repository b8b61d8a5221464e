#include "controller/extras/view/sources/live_source.hpp"

#include <algorithm>

namespace proxarm::view {

namespace {
constexpr double history_s = 20.0, between_rooms_s = 0.1;
constexpr std::size_t most_rows = 1300;  // a little more than 20 s with 60 moments a second
}  // namespace

LiveSource::LiveSource(int descriptor, Stage& stage)
    : box_(descriptor), stage_(stage), builder_(stage.handle_mass_kg()), settings_(stage) {}

bool LiveSource::advance() {
  // The true pose is written just after its cycle, so in simulation the number of true poses counts.
  const std::uint64_t told = box_.truths(), end = told > 0 ? told : box_.cycles();
  if (next_ >= end) return false;
  if (const std::uint64_t oldest = box_.oldest_cycle(); next_ < oldest) next_ = oldest;
  bool any = false;
  for (; next_ < end; ++next_) {
    if (!box_.read(next_, cycle_)) continue;
    controller::CycleRecord& record = cycle_.record;
    if (controller::BoxTruth truth; box_.truth(next_, truth)) {
      record.set(controller::RecordFlag::truth);
      record.true_tool_W_m = truth.tool_m;
      record.true_tool_q_W = truth.tool_q;
    }
    const bool rendered = record.phase == controller::Phase::rendering;
    const double period_s = 1e-9 * static_cast<double>(record.period_ns);
    stage_.follow(cycle_.change, rendered, period_s);
    settings_changed_ = settings_.follow(cycle_.change, period_s) || settings_changed_;
    builder_.add(record, 1e-9 * static_cast<double>(cycle_.rendered_ns));
    spectrum_.add(record);
    any = true;
  }
  return any;
}

Moment LiveSource::take() {
  Moment moment = builder_.take();
  stage_.complete(moment.record, moment.rendered_s);
  remember(moment);
  return moment;
}

std::string LiveSource::encode(const Moment& moment) {
  stage_.place(moment.record, moment.rendered_s, links_, objects_);
  Moment turned = moment;
  turned.tool_q = models::Quaternion(stage_.tool_pose(links_).linear());
  // The room is computed as often as the panel's figures change, since a tool's distances to meshes take time.
  if (const double now_s = 1e-9 * static_cast<double>(moment.record.time_ns); now_s >= next_room_s_) {
    next_room_s_ = now_s + between_rooms_s;
    room_ = stage_.room(moment.record, moment.rendered_s);
  }
  turned.room = room_;
  return encode_moment(turned, links_, objects_);
}

void LiveSource::remember(const Moment& moment) {
  const auto width = static_cast<std::ptrdiff_t>(field_names().size());
  append_fields(history_, moment);
  constexpr std::size_t time_field = 1;
  const double from_s = 1e-9 * static_cast<double>(moment.record.time_ns) - history_s;
  std::ptrdiff_t old = 0;
  const auto rows = static_cast<std::ptrdiff_t>(history_.size()) / width;
  while (old < rows && (history_[static_cast<std::size_t>(old * width) + time_field] < from_s ||
                        static_cast<std::size_t>(rows - old) > most_rows)) {
    ++old;
  }
  history_.erase(history_.begin(), history_.begin() + old * width);
}

}  // namespace proxarm::view
