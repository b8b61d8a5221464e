#include "fieldbus/canopen/canopen_sequence.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "fieldbus/can/byte_order.hpp"

namespace proxarm::fieldbus {
namespace {

std::uint32_t size_mask(std::uint8_t bytes) noexcept { return bytes >= 4 ? 0xFFFFFFFFU : (1U << 8 * bytes) - 1U; }

std::string value_text(std::uint32_t value, std::uint8_t bytes) {
  return hex_text(value, 2 * bytes) + " (" + std::to_string(value) + ")";
}

constexpr const char* check_wiring =
    "is it powered, is its node number right, and do bitrate, wiring and both terminations (120 ohm) fit?";

}  // namespace

SdoStep sdo_read(ObjectAddress object, std::uint8_t bytes, const char* name) {
  SdoStep step;
  step.kind = SdoStep::Kind::read;
  step.object = object;
  step.bytes = bytes;
  step.name = name;
  return step;
}

SdoStep sdo_expect(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name, const char* advice,
                   std::uint32_t mask) {
  SdoStep step = sdo_read(object, bytes, name);
  step.kind = SdoStep::Kind::expect;
  step.value = value;
  step.mask = mask;
  step.advice = advice;
  return step;
}

SdoStep sdo_write(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name) {
  SdoStep step = sdo_read(object, bytes, name);
  step.kind = SdoStep::Kind::write;
  step.value = value & size_mask(bytes);
  return step;
}

SdoStep if_present(SdoStep step) {
  step.is_optional = true;
  return step;
}

SdoStep if_present(SdoStep step, const char* lost) {
  step.lost = lost;
  return if_present(std::move(step));
}

SdoStep or_found(SdoStep step, std::vector<std::uint32_t> values) {
  step.as_found = std::move(values);
  return step;
}

SdoSequence::SdoSequence(CanBus& bus, std::uint8_t node, std::string bus_name, std::string device,
                         std::vector<SdoStep> steps, const SdoSequenceConfig& config)
    : client_(bus, node, config.client),
      bus_name_(std::move(bus_name)),
      device_(std::move(device)),
      steps_(std::move(steps)),
      config_(config) {}

void SdoSequence::start(std::int64_t now_ns) {
  started_ = true;
  begun_ns_ = now_ns;
  if (!finished()) begin_step(now_ns);
}

void SdoSequence::begin_step(std::int64_t now_ns) {
  step_begun_ns_ = now_ns;
  attempt_ = 0;
  refused_ = Refused::no;
  ask(steps_[next_].kind == SdoStep::Kind::write, now_ns);
}

void SdoSequence::ask(bool write, std::int64_t now_ns) {
  const SdoStep& step = steps_[next_];
  writing_ = write;
  again_at_ns_ = -1;
  if (write) {
    std::array<std::uint8_t, 4> bytes{};
    write_u32_le(bytes.data(), step.value);
    client_.start_download(step.object, std::span(bytes).first(std::min<std::size_t>(step.bytes, 4)), now_ns);
  } else {
    client_.start_upload(step.object, now_ns);
  }
  if (client_.finished()) on_answer(now_ns);  // the request couldn't be sent: bus off or interface down
}

void SdoSequence::advance(std::int64_t now_ns) {
  ++next_;
  if (!finished()) begin_step(now_ns);
}

bool SdoSequence::on_frame(const CanFrame& frame, std::int64_t now_ns) {
  const bool running = started_ && !finished() && !client_.finished();
  if (!client_.on_frame(frame, now_ns)) return false;
  if (running && client_.finished()) on_answer(now_ns);
  return true;
}

void SdoSequence::poll(std::int64_t now_ns) {
  if (!started_ || finished()) return;
  if (again_at_ns_ >= 0) {
    if (now_ns >= again_at_ns_) ask(writing_, now_ns);
    return;
  }
  client_.poll(now_ns);
  if (client_.finished()) on_answer(now_ns);
}

std::int64_t SdoSequence::wake_ns(std::int64_t now_ns) const noexcept {
  return again_at_ns_ >= 0 ? again_at_ns_ : client_.wake_ns(now_ns);
}

void SdoSequence::on_answer(std::int64_t now_ns) {
  if (client_.outcome() != SdoOutcome::done) {
    on_failure(now_ns);
    return;
  }
  answered_ever_ = true;
  if (writing_) {
    attempt_ = 0;
    ask(false, now_ns);  // read back
    return;
  }
  on_value(now_ns);
}

void SdoSequence::on_value(std::int64_t now_ns) {
  const SdoStep& step = steps_[next_];
  const auto data = client_.data();
  // A node that doesn't report the object's size sends four bytes; the first `step.bytes` of them count.
  if (data.size() < step.bytes || data.size() > 4) {
    fail(std::to_string(data.size()) + " bytes", std::to_string(step.bytes) + " bytes",
         "the object has another type than the profile gives it; is the device of the expected make?");
    return;
  }
  std::array<std::uint8_t, 4> bytes{};
  std::copy(data.begin(), data.end(), bytes.begin());
  const std::uint32_t value = read_u32_le(bytes.data()) & size_mask(step.bytes);
  const bool fits = step.kind == SdoStep::Kind::read || (value & step.mask) == (step.value & step.mask);
  if (step.kind == SdoStep::Kind::write && (refused_ != Refused::no || !fits)) {
    take_as_found(value, now_ns);
    return;
  }
  if (!fits && step.kind == SdoStep::Kind::expect && now_ns - step_begun_ns_ < step.patience_ns) {
    again_at_ns_ = now_ns + config_.pause_ns;
    return;
  }
  if (!fits) {
    const std::uint32_t shown_mask = step.mask & size_mask(step.bytes);
    std::string expected = value_text(step.value, step.bytes);
    if (shown_mask != size_mask(step.bytes)) expected += " in the bits " + hex_text(shown_mask, 2 * step.bytes);
    fail(value_text(value, step.bytes), std::move(expected), step.advice);
    return;
  }
  values_.push_back({step, value, true});
  advance(now_ns);
}

// Accepts the object's present value after a write that was refused or had no effect. The value must be the wanted
// value or one of `as_found`. An optional object without `as_found` may have any value if its write was refused.
// Otherwise the sequence fails.
void SdoSequence::take_as_found(std::uint32_t value, std::int64_t now_ns) {
  const SdoStep& step = steps_[next_];
  const auto is = [&](std::uint32_t wanted) { return ((value ^ wanted) & step.mask & size_mask(step.bytes)) == 0; };
  const bool fits = is(step.value) || std::any_of(step.as_found.begin(), step.as_found.end(), is);
  const bool couldnt_write = refused_ != Refused::no;
  const bool may_be_anything = couldnt_write && step.is_optional && step.as_found.empty();
  if (!fits && !may_be_anything) {
    std::string expected = value_text(step.value, step.bytes);
    for (const std::uint32_t other : step.as_found) {
      if (other != step.value) expected += " or " + value_text(other, step.bytes);
    }
    const std::uint32_t shown_mask = step.mask & size_mask(step.bytes);
    if (shown_mask != size_mask(step.bytes)) expected += " in the bits " + hex_text(shown_mask, 2 * step.bytes);
    fail(value_text(value, step.bytes) +
             (couldnt_write ? ", which can't be written (" + describe_sdo_abort(refusal_) + ")" : ""),
         std::move(expected),
         couldnt_write ? "set it by the maker's tool, if that can"
                       : "the drive took the value without an error but kept another; is it limited or locked by the "
                         "maker's tool?");
    return;
  }
  fixed_ += (fixed_.empty() ? "" : ", ") + to_string(step.object);
  if (!is(step.value) && (*step.lost != '\0' || refused_ == Refused::value)) {
    lose(to_string(step.object) + " is " + value_text(value, step.bytes) + " and can't be set to " +
         value_text(step.value, step.bytes) + ": " +
         (*step.lost != '\0' ? std::string(step.lost) : "the drive has its own " + std::string(step.name)));
  }
  values_.push_back({step, value, true});
  advance(now_ns);
}

void SdoSequence::lose(const std::string& text) {
  if (std::find(losses_.begin(), losses_.end(), text) == losses_.end()) losses_.push_back(text);
}

std::vector<std::string> SdoSequence::losses() const {
  std::vector<std::string> all = losses_;
  if (!fixed_.empty()) all.push_back("can't be written and taken as found, because it fits: " + fixed_);
  return all;
}

// Returns whether the node refused the write because of the object or because of the value. Many nodes support fewer
// option codes and narrower ranges than the profile. A node may therefore keep its maker's value in an optional object.
SdoSequence::Refused SdoSequence::refused_by(std::uint32_t code) const noexcept {
  constexpr std::uint32_t by_object[] = {sdo_abort::unsupported_access, sdo_abort::write_of_read_only,
                                         sdo_abort::not_transferable, sdo_abort::local_control,
                                         sdo_abort::device_state};
  constexpr std::uint32_t by_value[] = {sdo_abort::invalid_value, sdo_abort::value_too_high, sdo_abort::value_too_low,
                                        sdo_abort::general_error};
  const auto is_in = [code](const auto& codes) {
    return std::find(std::begin(codes), std::end(codes), code) != std::end(codes);
  };
  const SdoStep& step = steps_[next_];
  if (!step.is_optional && step.as_found.empty()) return Refused::no;
  return is_in(by_object) ? Refused::object : is_in(by_value) ? Refused::value : Refused::no;
}

bool SdoSequence::looks_at_what_is_there(std::uint32_t code, std::int64_t now_ns) {
  if (!writing_ || refused_by(code) == Refused::no) return false;
  refused_ = refused_by(code);
  refusal_ = code;
  attempt_ = 0;
  ask(false, now_ns);
  return true;
}

void SdoSequence::on_failure(std::int64_t now_ns) {
  const SdoStep& step = steps_[next_];
  const std::uint32_t code = client_.abort_code();
  switch (client_.outcome()) {
    case SdoOutcome::not_sent:
      fail("the frame could not be sent", "an interface that is up",
           "is the interface up, and is another node on the bus to acknowledge frames?");
      return;
    case SdoOutcome::timed_out:
      if (!answered_ever_ ? now_ns - begun_ns_ < config_.first_answer_ns : ++attempt_ < config_.attempts) {
        ask(writing_, now_ns);
        return;
      }
      fail("no answer", answered_ever_ ? "an answer" : "a CANopen node that answers",
           answered_ever_ ? "it answered before: was it switched off or reset?" : check_wiring);
      return;
    case SdoOutcome::aborted_by_server:
      answered_ever_ = true;
      if (step.is_optional && (code == sdo_abort::object_missing || code == sdo_abort::sub_index_missing)) {
        missing_.push_back(to_string(step.object) + " " + step.name);
        if (*step.lost != '\0') lose("no " + to_string(step.object) + ": " + step.lost);
        values_.push_back({step, 0, false});
        advance(now_ns);
        return;
      }
      if (looks_at_what_is_there(code, now_ns)) return;
      // If reading fails too, the refusal of the write is reported, not the failure of the reading.
      failed_abort_ = refused_ == Refused::no ? code : refusal_;
      fail(describe_sdo_abort(failed_abort_),
           writing_ || refused_ != Refused::no ? "to write " + value_text(step.value, step.bytes)
                                               : std::string("to read the object"),
           step.advice);
      return;
    default:
      if (++attempt_ < config_.attempts) {
        ask(writing_, now_ns);
        return;
      }
      fail("an answer that breaks the protocol (" + describe_sdo_abort(code) + ")", "an SDO answer",
           "do two devices share this node number?");
      return;
  }
}

void SdoSequence::fail(std::string found, std::string expected, std::string advice) {
  const SdoStep& step = steps_[next_];
  problem_ = description::SetupProblem{.bus = bus_name_,
                                       .node = client_.node(),
                                       .object = to_string(step.object) + " " + step.name,
                                       .message = device_,
                                       .found = std::move(found),
                                       .expected = std::move(expected),
                                       .advice = std::move(advice)};
}

std::optional<std::uint32_t> SdoSequence::value_of(ObjectAddress object) const noexcept {
  const auto last = std::find_if(values_.rbegin(), values_.rend(),
                                 [object](const Value& value) { return value.present && value.step.object == object; });
  if (last == values_.rend()) return std::nullopt;
  return last->value;
}

}  // namespace proxarm::fieldbus
