// A node's configuration as a table of SDO steps, each written and read back, or read and compared.
//
// Runs on one SdoClient without blocking, so that several nodes can be configured side by side. What goes wrong ends as
// one SetupProblem that names bus, node, object, found, expected and what to do.
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
    read,    // only noted, in values()
    expect,  // read; (value & mask) must be `value`
    write,   // written, then read back and compared under `mask`
  };
  Kind kind = Kind::read;
  ObjectAddress object{};
  std::uint8_t bytes = 4;           // size of the object, 1..4
  std::uint32_t value = 0;          // as the bytes are; negative numbers in two's complement of that size
  std::uint32_t mask = 0xFFFFFFFF;  // bits that are compared
  const char* name = "";            // "modes of operation", for the message
  const char* advice = "";          // what the user can do where it differs; "" for the usual
  // A node without the object is noted in missing(), not refused; so is one that doesn't take the value.
  bool is_optional = false;
  const char* lost = "";  // what is lost without it, or with another value; for losses()
  // write: what may be found where the node doesn't let it be written, or keeps what it has; under `mask`. Empty: an
  // optional one may have any value then, another is refused.
  std::vector<std::uint32_t> as_found{};
  std::int64_t patience_ns = 0;  // expect: read again until it holds or this long has passed
  // expect: the object shows a state, or what somebody wrote: a file's default of it is its value at power-up, and no
  // requirement. Else it is the device's for good.
  bool is_state = false;
};

// For the tables: the usual steps in one line each.
[[nodiscard]] SdoStep sdo_read(ObjectAddress object, std::uint8_t bytes, const char* name);
[[nodiscard]] SdoStep sdo_expect(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name,
                                 const char* advice = "", std::uint32_t mask = 0xFFFFFFFF);
[[nodiscard]] SdoStep sdo_write(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name);
[[nodiscard]] SdoStep if_present(SdoStep step);  // for objects that the standard leaves to the maker
// The same, with what is lost where it isn't there.
[[nodiscard]] SdoStep if_present(SdoStep step, const char* lost);
// A write that may stay undone where one of these is found.
[[nodiscard]] SdoStep or_found(SdoStep step, std::vector<std::uint32_t> values);

struct SdoSequenceConfig {
  SdoClientConfig client{};
  int attempts = 3;                              // per exchange: one lost frame doesn't end the set-up
  std::int64_t first_answer_ns = 2'000'000'000;  // how long a node may take to answer at all (it may be booting)
  std::int64_t pause_ns = 2'000'000;             // between the readings of a step with patience
};

class SdoSequence {
 public:
  struct Value {
    SdoStep step;
    std::uint32_t value = 0;
    bool present = true;
  };

  // `bus_name` and `device` ("drive of axis_1") are for the messages.
  SdoSequence(CanBus& bus, std::uint8_t node, std::string bus_name, std::string device, std::vector<SdoStep> steps,
              const SdoSequenceConfig& config = {});

  void start(std::int64_t now_ns);
  bool on_frame(const CanFrame& frame, std::int64_t now_ns);
  void poll(std::int64_t now_ns);

  [[nodiscard]] bool finished() const noexcept { return problem_ || next_ >= steps_.size(); }
  [[nodiscard]] bool answered() const noexcept { return answered_ever_; }
  [[nodiscard]] const std::optional<description::SetupProblem>& problem() const noexcept { return problem_; }
  [[nodiscard]] const std::vector<Value>& values() const noexcept { return values_; }
  [[nodiscard]] std::optional<std::uint32_t> value_of(ObjectAddress object) const noexcept;  // the last one read
  // Optional steps that the node hasn't the object for, as "1006h:00 communication cycle period".
  [[nodiscard]] const std::vector<std::string>& missing() const noexcept { return missing_; }
  // What the node lacks in words, a line each: what is lost by it, and which objects were taken as they were found.
  [[nodiscard]] std::vector<std::string> losses() const;
  // After a problem: the step that failed, and the abort code if it was one (else 0).
  [[nodiscard]] const SdoStep& failed_step() const noexcept { return steps_[next_]; }
  [[nodiscard]] std::uint32_t failed_abort() const noexcept { return failed_abort_; }
  [[nodiscard]] std::int64_t wake_ns(std::int64_t now_ns) const noexcept;

 private:
  enum class Refused : std::uint8_t { no, object, value };  // why a step couldn't be written, and is read

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
  std::int64_t begun_ns_ = 0;  // of the sequence
  std::int64_t step_begun_ns_ = 0;
  std::int64_t again_at_ns_ = -1;  // a pause runs; −1: none
  std::vector<Value> values_;
  std::vector<std::string> missing_;
  std::vector<std::string> losses_;
  std::string fixed_;  // objects that were taken as found, joined by commas
  Refused refused_ = Refused::no;
  std::uint32_t refusal_ = 0;  // the abort code of that
  std::uint32_t failed_abort_ = 0;
  std::optional<description::SetupProblem> problem_;
};

}  // namespace proxarm::fieldbus
