// Configures a node by a table of SDO steps: each is written and read back, or read and compared.
//
// Runs on one SdoClient without blocking, so several nodes can be configured side by side. A failure ends the sequence
// with one SetupProblem: bus, node, object, found, expected and what to do.
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
    read,    // read into values()
    expect,  // read; (value & mask) must be `value`
    write,   // written, then read back and compared under `mask`
  };
  Kind kind = Kind::read;
  ObjectAddress object{};
  std::uint8_t bytes = 4;           // size of the object, 1..4
  std::uint32_t value = 0;          // as unsigned; negative numbers in two's complement of the object's size
  std::uint32_t mask = 0xFFFFFFFF;  // bits to be compared
  const char* name = "";            // "modes of operation", for the message
  const char* advice = "";          // what the user can do if it differs; "": the default advice
  // A missing object or refused value is no error; it is noted in missing() or losses().
  bool is_optional = false;
  const char* lost = "";  // what is lost without the object, or with another value; for losses()
  // write: values that may remain if the node refuses the write or keeps its value, compared under `mask`. If empty and
  // the write is refused: any value may remain in an optional object; for others the refusal is an error.
  std::vector<std::uint32_t> as_found{};
  std::int64_t patience_ns = 0;  // expect: read again until it holds, at most for this long
  // expect: the object is a state, or holds a value written earlier, so its default in the EDS is only the value at
  // power-up. false: it is a constant of the device.
  bool is_state = false;
};

[[nodiscard]] SdoStep sdo_read(ObjectAddress object, std::uint8_t bytes, const char* name);
[[nodiscard]] SdoStep sdo_expect(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name,
                                 const char* advice = "", std::uint32_t mask = 0xFFFFFFFF);
[[nodiscard]] SdoStep sdo_write(ObjectAddress object, std::uint8_t bytes, std::uint32_t value, const char* name);
[[nodiscard]] SdoStep if_present(SdoStep step);  // for objects that the standard leaves to the maker
// The same, with what is lost without the object.
[[nodiscard]] SdoStep if_present(SdoStep step, const char* lost);
// A write that may fail if one of these values is found.
[[nodiscard]] SdoStep or_found(SdoStep step, std::vector<std::uint32_t> values);

struct SdoSequenceConfig {
  SdoClientConfig client{};
  int attempts = 3;                              // per exchange, so one lost frame doesn't end the set-up
  std::int64_t first_answer_ns = 2'000'000'000;  // time for the first answer (the node may be booting)
  std::int64_t pause_ns = 2'000'000;             // between readings of a step with patience
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
  [[nodiscard]] std::optional<std::uint32_t> value_of(ObjectAddress object) const noexcept;  // last reading
  // Missing optional objects: "1006h:00 communication cycle period".
  [[nodiscard]] const std::vector<std::string>& missing() const noexcept { return missing_; }
  // One line per loss: missing objects, values it can't take, and objects taken as found.
  [[nodiscard]] std::vector<std::string> losses() const;
  // After a problem: the failed step and its abort code (0 if it wasn't aborted).
  [[nodiscard]] const SdoStep& failed_step() const noexcept { return steps_[next_]; }
  [[nodiscard]] std::uint32_t failed_abort() const noexcept { return failed_abort_; }
  [[nodiscard]] std::int64_t wake_ns(std::int64_t now_ns) const noexcept;

 private:
  enum class Refused : std::uint8_t { no, object, value };  // why the node refused a write

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
  std::int64_t again_at_ns_ = -1;  // end of a pause; −1: no pause
  std::vector<Value> values_;
  std::vector<std::string> missing_;
  std::vector<std::string> losses_;
  std::string fixed_;  // objects that were taken as found, joined by commas
  Refused refused_ = Refused::no;
  std::uint32_t refusal_ = 0;  // abort code of that refusal
  std::uint32_t failed_abort_ = 0;
  std::optional<description::SetupProblem> problem_;
};

}  // namespace proxarm::fieldbus
