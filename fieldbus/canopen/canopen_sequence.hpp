// Configures a node by a table of SDO steps. Each step writes an object and reads it back, or reads an object and
// compares it.
//
// The sequence runs on one SdoClient without blocking, so several nodes can be configured side by side. A failure ends
// the sequence with one SetupProblem that says bus, node, object, found value, expected value and what to do.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fieldbus/canopen/canopen_sdo.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {

struct SdoStep {
  enum class Kind : std::uint8_t {
    read,    // reads the object into values()
    expect,  // reads the object; (value read & mask) must equal (`value` & mask)
    write,   // writes the object, reads it back and compares it under `mask`
  };
  Kind kind = Kind::read;
  ObjectAddress object{};
  std::uint8_t bytes = 4;  // size of the object, 1..4
  // Wanted value as an unsigned number. A negative number is encoded in two's complement of the object's size.
  std::uint32_t value = 0;
  std::uint32_t mask = 0xFFFFFFFF;  // bits to be compared
  const char* name = "";            // the object's name in messages, such as "modes of operation"
  const char* advice = "";          // for the message: what the user can do if the value differs; "": a default text
  // true: a missing object or a refused value isn't an error; it is noted in missing() or losses().
  bool is_optional = false;
  // For losses(): what is lost if the object is missing or keeps another value.
  const char* lost = "";
  // Used by write: values that may remain, compared under `mask`, if the node refuses the write or keeps its old value.
  // If this list is empty and the write is refused, an optional object may keep any value; for any other object the
  // refusal is an error.
  std::vector<std::uint32_t> as_found{};
  std::int64_t patience_ns = 0;  // used by expect: how long the object is read again until it has the wanted value
  // Used by expect. true: the object is a state, or holds a value written earlier, so the EDS's default for it is only
  // the value at power-up. false: the object is a constant of the device, so the EDS's default must fit.
  bool is_state = false;
};

[[nodiscard]] SdoStep sdo_read(ObjectAddress object, std::uint8_t bytes, const char* name);
[[nodiscard]] SdoStep sdo_expect(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name,
                                 const char* advice = "", std::uint32_t mask = 0xFFFFFFFF);
[[nodiscard]] SdoStep sdo_write(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name);
// Returns the step as an optional step, for objects that not every device has.
[[nodiscard]] SdoStep if_present(SdoStep step);
// Returns the step as an optional step; `lost` says what is lost without the object.
[[nodiscard]] SdoStep if_present(SdoStep step, const char* lost);
// Returns the write step with values that may remain if the write fails.
[[nodiscard]] SdoStep or_found(SdoStep step, std::vector<std::uint32_t> values);

struct SdoSequenceConfig {
  SdoClientConfig client{};
  int attempts = 3;                              // attempts per request, so that one lost frame doesn't end the set-up
  std::int64_t first_answer_ns = 2'000'000'000;  // timeout for the first answer (the node may still be booting)
  std::int64_t pause_ns = 2'000'000;             // pause between two readings of a step with patience_ns
};

class SdoSequence {
 public:
  struct Value {
    SdoStep step;
    std::uint32_t value = 0;
    bool present = true;
  };

  // `bus_name` and `device` (such as "drive of axis_1") appear in messages.
  SdoSequence(CanBus& bus, std::uint8_t node, std::string bus_name, std::string device, std::vector<SdoStep> steps,
              const SdoSequenceConfig& config = {});

  void start(std::int64_t now_ns);
  bool on_frame(const CanFrame& frame, std::int64_t now_ns);
  void poll(std::int64_t now_ns);

  [[nodiscard]] bool finished() const noexcept { return problem_ || next_ >= steps_.size(); }
  [[nodiscard]] bool answered() const noexcept { return answered_ever_; }
  [[nodiscard]] const std::optional<description::SetupProblem>& problem() const noexcept { return problem_; }
  [[nodiscard]] const std::vector<Value>& values() const noexcept { return values_; }
  [[nodiscard]] std::optional<std::uint32_t> value_of(ObjectAddress object) const noexcept;  // the value read last
  // Returns the missing optional objects, such as "1006h:00 communication cycle period".
  [[nodiscard]] const std::vector<std::string>& missing() const noexcept { return missing_; }
  // Returns one line for each missing object that matters, one for each value that the node can't take, and one line
  // with all objects that couldn't be written but already had a fitting value.
  [[nodiscard]] std::vector<std::string> losses() const;
  // After a problem: the step that failed, and its SDO abort code (0 if no abort ended it).
  [[nodiscard]] const SdoStep& failed_step() const noexcept { return steps_[next_]; }
  [[nodiscard]] std::uint32_t failed_abort() const noexcept { return failed_abort_; }
  [[nodiscard]] std::int64_t wake_ns(std::int64_t now_ns) const noexcept;

 private:
  enum class Refused : std::uint8_t { no, object, value };  // why the node refused a write; no: it didn't refuse

  void begin_step(std::int64_t now_ns);
  void ask(bool write, std::int64_t now_ns);
  void advance(std::int64_t now_ns);
  void on_answer(std::int64_t now_ns);
  void on_value(std::int64_t now_ns);
  void on_failure(std::int64_t now_ns);
  [[nodiscard]] bool looks_at_what_is_there(std::uint32_t code, std::int64_t now_ns);
  [[nodiscard]] Refused refused_by(std::uint32_t code) const noexcept;
  void take_as_found(std::uint32_t value, std::int64_t now_ns);
  void lose(const std::string& text);
  void fail(std::string found, std::string expected, std::string advice);

  SdoClient client_;
  std::string bus_name_;
  std::string device_;
  std::vector<SdoStep> steps_;
  SdoSequenceConfig config_;
  std::size_t next_ = 0;
  bool started_ = false;
  bool writing_ = false;
  bool answered_ever_ = false;
  int attempt_ = 0;
  std::int64_t begun_ns_ = 0;
  std::int64_t step_begun_ns_ = 0;
  std::int64_t again_at_ns_ = -1;  // end of the pause between two readings; −1: no pause
  std::vector<Value> values_;
  std::vector<std::string> missing_;
  std::vector<std::string> losses_;
  std::string fixed_;  // objects that couldn't be written but already fitted, joined by commas
  Refused refused_ = Refused::no;
  std::uint32_t refusal_ = 0;  // SDO abort code with which the node refused the write
  std::uint32_t failed_abort_ = 0;
  std::optional<description::SetupProblem> problem_;
};

}  // namespace proxarm::fieldbus
