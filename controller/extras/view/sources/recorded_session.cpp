#include "controller/extras/view/sources/recorded_session.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "controller/stage/words.hpp"
#include "models/files/json.hpp"

namespace proxarm::view {
namespace {

using controller::CycleRecord;
using controller::Phase;
using description::Json;

constexpr std::size_t most_events = 2000;
constexpr std::int64_t apart_ns = 200'000'000;  // a repetition within this time counts as the same event
// A contact that lasts this long isn't a bounce, and its force isn't an impact's any more.
constexpr std::int64_t lasting_ns = 100'000'000;

std::vector<std::string> axis_names(const Stage& stage) {
  std::vector<std::string> names;
  for (const description::DriveDescription& drive : stage.cell().drives) names.push_back(drive.joint);
  return names;
}

std::string text_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::uint32_t holding_back() {
  std::uint32_t bits = 0;
  for (const FlagWords& flag : flag_words()) bits |= flag.holds_back ? static_cast<std::uint32_t>(flag.flag) : 0U;
  return bits;
}

// Returns whether the record has the tool's true place; only a simulation's record has it.
bool is_true(const CycleRecord& record) { return controller::vec3(record.true_tool_W_m).norm() > 0.0; }

std::string words_of(std::uint32_t flags) {
  std::string text;
  for (const FlagWords& flag : flag_words()) {
    if ((flags & static_cast<std::uint32_t>(flag.flag)) == 0) continue;
    text += (text.empty() ? "" : "; ") + std::string(flag.words);
  }
  return text;
}

}  // namespace

RecordedSession::RecordedSession(const std::filesystem::path& folder, Stage& stage)
    : stage_(stage),
      log_(folder / controller::replay_folder / "cycles.bin"),
      signals_(folder, axis_names(stage)),
      contacts_(folder),
      first_cycle_(signals_.row(0).cycle) {
  read_fault(folder);
  find_events();
  index_frames();
}

// Reads the last fault; for a program that died, the reason for its black box.
void RecordedSession::read_fault(const std::filesystem::path& folder) {
  const Json summary = Json::parse(text_of_file(folder / "summary.json")).value_or(Json());
  if (const Json* faults = summary.find("faults"); faults && !faults->items().empty()) {
    const Json& fault = faults->items().back();
    fault_ = fault.text_of("text").value_or("");
    fault_cycle_ = static_cast<std::uint64_t>(fault.integer_of("cycle").value_or(0));
    return;
  }
  fault_ = text_of_file(folder / "reason.txt");
  while (!fault_.empty() && fault_.back() == '\n') fault_.pop_back();
  fault_cycle_ = signals_.row(size() - 1).cycle;
  // The figures of a black box don't include faults, but the reason names the cycle.
  const std::size_t named = fault_.find(" at cycle ");
  if (named != std::string::npos) fault_cycle_ = std::strtoull(fault_.c_str() + named + 10, nullptr, 10);
}

void RecordedSession::find_events() {
  const std::uint32_t limits = holding_back();
  CycleRecord last = signals_.row(0);
  std::int64_t rendered = 0, limited_ns = -apart_ns, touched_ns = -apart_ns, since_ns = 0;
  std::int64_t longest_ns = -1;
  // The first cycle whose contact has lasted long enough; else the end of the longest contact.
  std::size_t lasting = 0;
  const auto add = [&](RecordedEvent::Kind kind, std::size_t at, const CycleRecord& record, std::string text) {
    if (events_.size() < most_events) {
      events_.push_back({kind, at, 1e-9 * static_cast<double>(record.time_ns), std::move(text)});
    }
  };
  fault_at_ = size();
  rendered_ns_.reserve(size());
  time_ns_.reserve(size());
  touch_begins_.assign(size(), std::numeric_limits<std::uint32_t>::max());
  for (std::size_t i = 0; i < size(); ++i) {
    const CycleRecord record = signals_.row(i);
    if (i > 0 && last.phase == Phase::rendering) rendered += record.time_ns - last.time_ns;
    rendered_ns_.push_back(rendered);
    time_ns_.push_back(record.time_ns);
    if (record.phase != last.phase) add(RecordedEvent::Kind::phase, i, record, phase_words(record.phase).words);
    if (record.contact != controller::ContactPhase::free) {
      touch_begins_[i] = i > 0 && touch_begins_[i - 1] < i ? touch_begins_[i - 1] : static_cast<std::uint32_t>(i);
      if (record.time_ns - touched_ns >= apart_ns) add(RecordedEvent::Kind::contact, i, record, "touches");
      touched_ns = record.time_ns;
      if (i == 0 || last.contact == controller::ContactPhase::free) since_ns = record.time_ns;
      const std::int64_t lasts_ns = std::min(record.time_ns - since_ns, lasting_ns);
      if (lasts_ns > longest_ns) {
        longest_ns = lasts_ns;
        lasting = i;
      }
    }
    if ((record.flags & limits) != 0) {
      if (record.time_ns - limited_ns >= apart_ns) {
        add(RecordedEvent::Kind::limit, i, record, words_of(record.flags & limits));
      }
      limited_ns = record.time_ns;
    }
    if (!fault_.empty() && fault_at_ == size() && record.cycle >= fault_cycle_) {
      fault_at_ = i;
      add(RecordedEvent::Kind::fault, i, record, fault_);
    }
    last = record;
  }
  opening_ = fault_at_ < size() ? fault_at_ : lasting;
}

void RecordedSession::index_frames() {
  const bool driven = std::any_of(stage_.scene().objects.begin(), stage_.scene().objects.end(),
                                  [](const scenes::Object& o) { return o.motion && o.motion->driven; });
  if (driven) return follow_driven();
  for (controller::ReplayPlace at = log_.position(); log_.skip(); at = log_.position()) positions_.push_back(at);
}

// Moves the driven objects cycle by cycle, as in the session.
void RecordedSession::follow_driven() {
  controller::BoxCycle cycle;
  std::vector<controller::BoxFrame> frames;
  const std::size_t objects = stage_.scene().objects.size();
  driven_m_.assign(size() * objects, {});
  for (controller::ReplayPlace at = log_.position(); log_.next(cycle, frames); at = log_.position()) {
    positions_.push_back(at);
    const std::uint64_t index = cycle.record.cycle - first_cycle_;
    if (cycle.record.cycle < first_cycle_ || index >= size()) continue;
    const Moment now = moment(index);
    stage_.follow(cycle.change, now.record.phase == Phase::rendering, 1e-9 * static_cast<double>(now.record.period_ns));
    for (std::size_t k = 0; k < objects; ++k) {
      const models::Vec3 p = stage_.driven_m(k);
      driven_m_[index * objects + k] = {static_cast<float>(p.x()), static_cast<float>(p.y()),
                                        static_cast<float>(p.z())};
    }
  }
}

double RecordedSession::time_s(std::size_t index) const noexcept { return 1e-9 * static_cast<double>(time_ns_[index]); }

Moment RecordedSession::moment(std::size_t index) const {
  Moment moment;
  moment.record = signals_.row(index);
  contacts_.complete(moment.record);
  moment.handle_mass_kg = stage_.handle_mass_kg();
  moment.rendered_s = 1e-9 * static_cast<double>(rendered_ns_[index]);
  const std::size_t before = index > 0 ? index - 1 : index;
  const std::size_t after = index > 0 ? index : std::min(size() - 1, index + 1);
  moment.record.period_ns = signals_.row(after).time_ns - signals_.row(before).time_ns;
  moment.flags_since = moment.record.flags;
  moment.hand_peak_N = controller::vec3(moment.record.force_W_N).norm();
  moment.contact_peak_N = controller::vec3(moment.record.contact_force_W_N).norm();
  moment.blow = blow_before(index);
  return moment;
}

std::vector<controller::HandleSpectrum::Band> RecordedSession::spectrum(std::size_t index) const {
  constexpr std::int64_t window_ns = 1'000'000'000;
  static_assert(controller::HandleSpectrum::window_s == 1.0);
  controller::HandleSpectrum spectrum;
  std::size_t first = index;
  // Reads two cycles more than a second, since the spectrum takes second differences of positions.
  while (first > 0 && time_ns_[index] - time_ns_[first] < window_ns + 2 * (time_ns_[first] - time_ns_[first - 1])) {
    --first;
  }
  for (std::size_t i = first; i <= index; ++i) {
    controller::CycleRecord record = signals_.row(i);
    record.period_ns = i > 0 ? time_ns_[i] - time_ns_[i - 1] : 0;
    record.set(controller::RecordFlag::truth, is_true(record));
    spectrum.add(record);
  }
  return spectrum.bands();
}

bool RecordedSession::has_truth(std::size_t index) const { return is_true(signals_.row(index)); }

// Returns the impact of the touch in this cycle, or of a touch that ended within the last 1000 cycles.
Blow RecordedSession::blow_before(std::size_t index) const {
  constexpr std::size_t most = 1000;
  const auto touches = [this](std::size_t i) { return touch_begins_[i] <= i; };
  std::size_t at = index;
  while (at > 0 && index - at < most && !touches(at)) --at;
  Blow blow;
  if (!touches(at)) return blow;
  const std::size_t first = touch_begins_[at];
  for (std::size_t i = first > 0 ? first - 1 : first; i <= at; ++i) {
    controller::CycleRecord record = signals_.row(i);
    if (record.time_ns - time_ns_[first] > Blow::lasts_ns) break;
    record.period_ns = i > 0 ? record.time_ns - time_ns_[i - 1] : 0;
    blow.add(record);
  }
  return blow;
}

std::string RecordedSession::encode(std::size_t index) const {
  Moment shown = moment(index);
  std::vector<models::Pose> links, objects;
  std::vector<models::Vec3> driven;
  const std::size_t count = stage_.scene().objects.size();
  for (std::size_t k = 0; k < count && !driven_m_.empty(); ++k) {
    const auto& p = driven_m_[index * count + k];
    driven.emplace_back(p[0], p[1], p[2]);
  }
  stage_.place(shown.record, shown.rendered_s, links, objects, driven);
  shown.tool_q = models::Quaternion(stage_.tool_pose(links).linear());
  shown.room = stage_.room(shown.record, shown.rendered_s);
  return encode_moment(shown, links, objects);
}

std::vector<double> RecordedSession::window(std::size_t from, std::size_t to, std::size_t rows) const {
  std::vector<double> out;
  const std::size_t end = std::min(to, size() - 1);
  const std::size_t step = std::max<std::size_t>(1, (end - std::min(from, end) + 1) / std::max<std::size_t>(1, rows));
  MomentBuilder builder(stage_.handle_mass_kg());
  for (std::size_t i = std::min(from, end); i <= end; ++i) {
    builder.add(signals_.row(i), 1e-9 * static_cast<double>(rendered_ns_[i]));
    if ((i + 1) % step == 0 || i == end) append_fields(out, builder.take());
  }
  return out;
}

std::vector<controller::BoxFrame> RecordedSession::frames(std::size_t index) {
  controller::BoxCycle cycle;
  std::vector<controller::BoxFrame> frames;
  const std::uint64_t number = first_cycle_ + index;
  if (number < head().first_cycle || number - head().first_cycle >= positions_.size()) return {};
  log_.go_to(positions_[number - head().first_cycle]);
  if (!log_.next(cycle, frames)) frames.clear();
  return frames;
}

}  // namespace proxarm::view
