#include "controller/signals/signal_columns.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>

#include "controller/supervision/fault.hpp"
#include "models/files/json.hpp"

namespace proxarm::controller {
namespace {

template <typename Number>
void append_number(std::string& text, Number value) {
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
}

// Nanoseconds as seconds, digit by digit: 1250000 is 0.00125.
void append_seconds(std::string& text, std::int64_t ns, std::size_t least_decimals) {
  if (ns < 0) text += '-';
  const std::uint64_t size = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  append_number(text, size / 1'000'000'000);
  std::string decimals = std::to_string(1'000'000'000 + size % 1'000'000'000).substr(1);
  while (decimals.size() > least_decimals && decimals.back() == '0') decimals.pop_back();
  if (!decimals.empty()) text += "." + decimals;
}

// `overrun` is left out because it is of the wall clock, `truth` because the columns say it.
constexpr std::array written_flags{RecordFlag::sample_held,
                                   RecordFlag::sample_late,
                                   RecordFlag::feedback_missing,
                                   RecordFlag::limit_speed,
                                   RecordFlag::limit_acceleration,
                                   RecordFlag::limit_workspace,
                                   RecordFlag::limit_joint,
                                   RecordFlag::limit_power,
                                   RecordFlag::limit_keep_out,
                                   RecordFlag::limit_joint_speed,
                                   RecordFlag::limit_joint_acceleration,
                                   RecordFlag::limit_singularity,
                                   RecordFlag::limit_following_error,
                                   RecordFlag::limit_joint_torque,
                                   RecordFlag::guard_speed,
                                   RecordFlag::guard_elbow,
                                   RecordFlag::guard_border,
                                   RecordFlag::guard_turning,
                                   RecordFlag::limit_leash,
                                   RecordFlag::limit_orientation,
                                   RecordFlag::oscillation,
                                   RecordFlag::oscillation_lasts,
                                   RecordFlag::timestep,
                                   RecordFlag::ramp_in,
                                   RecordFlag::slowed,
                                   RecordFlag::power_cut,
                                   RecordFlag::unresolved,
                                   RecordFlag::hands_off};

// A row's values, one after the other, as text that ends at commas.
class TextRow {
 public:
  explicit TextRow(std::string& text) : text_(text) {}

  void integer(auto value) { append_number(next(), value); }
  void number(double value) { append_number(next(), value); }
  void seconds(std::int64_t ns) { append_seconds(next(), ns, 0); }
  void word(const char* name, int /*number*/) { next() += name; }
  void empty() { next(); }
  void flags(const CycleRecord& record) {
    next();
    bool first = true;
    for (const RecordFlag flag : written_flags) {
      if (!record.has(flag)) continue;
      if (!first) text_ += '|';
      text_ += flag_name(flag);
      first = false;
    }
  }

 private:
  std::string& next() {
    if (!first_) text_ += ',';
    first_ = false;
    return text_;
  }

  std::string& text_;
  bool first_ = true;
};

// The same as numbers.
class NumberRow {
 public:
  NumberRow(double* first, std::size_t apart) noexcept : at_(first), apart_(apart) {}

  void integer(auto value) noexcept { number(static_cast<double>(value)); }
  void number(double value) noexcept {
    *at_ = value;
    at_ += apart_;
  }
  // Both are exact, so the quotient is the double that is nearest to the decimals.
  void seconds(std::int64_t ns) noexcept { number(static_cast<double>(ns) / 1e9); }
  void word(const char* /*name*/, int value) noexcept { integer(value); }
  void empty() noexcept { number(std::bit_cast<double>(empty_bits)); }
  void flags(const CycleRecord& record) noexcept {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < written_flags.size(); ++i) bits |= (record.has(written_flags[i]) ? 1U : 0U) << i;
    integer(bits);
  }

 private:
  double* at_;
  std::size_t apart_;
};

void put_all(auto& row, const auto& values) {
  for (const double value : values) row.number(value);
}

void put_first(auto& row, const CycleRecord& r, std::size_t axes, bool with_truth) {
  row.integer(r.cycle);
  row.seconds(r.time_ns);
  row.word(phase_name(r.phase), static_cast<int>(r.phase));
  row.word(contact_phase_name(r.contact), static_cast<int>(r.contact));
  row.flags(r);
  for (const Triple* values : {&r.force_S_N, &r.torque_S_Nm, &r.force_W_N, &r.torque_W_Nm, &r.p_hat_W_m, &r.proxy_W_m,
                               &r.contact_force_W_N, &r.normal_W}) {
    put_all(row, *values);
  }
  row.integer(static_cast<int>(r.contact_count));
  row.integer(r.contact_object);
  row.number(r.friction);
  put_all(row, r.tool_W_m);
  row.number(r.proxy_clearance_m);
  row.number(r.tool_clearance_m);
  for (const auto* counts : {&r.target_counts, &r.actual_counts}) {
    for (std::size_t axis = 0; axis < axes; ++axis) row.integer((*counts)[axis]);
  }
  if (!with_truth) return;
  if (r.has(RecordFlag::truth)) {
    put_all(row, r.true_tool_W_m);
    put_all(row, r.hand_force_W_N);
  } else {
    for (int i = 0; i < 6; ++i) row.empty();
  }
}

// What came after the first version of the record.
void put_more(auto& row, const CycleRecord& r, std::size_t axes, bool with_truth, const DerivedSignals& derived) {
  for (const Fault fault : {r.fault, r.held_for}) {
    row.word(fault == Fault::none ? "" : fault_name(fault), static_cast<int>(fault));
  }
  put_all(row, std::array{r.proxy_mass_kg, r.proxy_damping_Ns_per_m, r.energies_J.hand, r.energies_J.proxy});
  for (std::size_t axis = 0; axis < axes; ++axis) {
    derived.torques ? row.empty() : row.number(derived.target_rad[axis]);
  }
  for (std::size_t axis = 0; axis < axes; ++axis) row.number(derived.actual_rad[axis]);
  for (std::size_t axis = 0; axis < axes; ++axis) {
    derived.torques ? row.number(derived.target_Nm[axis]) : row.empty();
  }
  put_all(row, derived.tool_q_W);
  for (const OtherContact& other : r.others) {
    row.integer(other.object);
    row.number(other.friction);
    put_all(row, other.normal_W);
  }
  if (!with_truth) return;
  if (r.has(RecordFlag::truth)) {
    put_all(row, r.true_tool_q_W);
    put_all(row, r.true_acceleration_W_m_per_s2);
  } else {
    for (int i = 0; i < 7; ++i) row.empty();
  }
}

void put_turning(auto& row, const CycleRecord& r, bool with_truth) {
  put_all(row, r.proxy_q_W);
  put_all(row, r.contact_torque_W_Nm);
  row.number(r.proxy_inertia_kg_m2);
  if (!with_truth) return;
  if (r.has(RecordFlag::truth)) {
    put_all(row, r.hand_torque_W_Nm);
  } else {
    for (int i = 0; i < 3; ++i) row.empty();
  }
}

void put_row(auto& row, const CycleRecord& r, std::size_t axes, bool with_truth, const DerivedSignals& derived) {
  put_first(row, r, axes, with_truth);
  put_more(row, r, axes, with_truth, derived);
  put_turning(row, r, with_truth);
  row.number(r.limits_work_J);
}

std::vector<std::string> fault_words() {
  std::vector<std::string> words{""};
  for (std::size_t i = 1; i < fault_count; ++i) words.emplace_back(fault_name(static_cast<Fault>(i)));
  return words;
}

std::vector<std::string> phase_words() {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < phase_count; ++i) words.emplace_back(phase_name(static_cast<Phase>(i)));
  return words;
}

std::vector<std::string> contact_words() {
  std::vector<std::string> words;
  for (const ContactPhase phase : {ContactPhase::free, ContactPhase::stick, ContactPhase::slip}) {
    words.emplace_back(contact_phase_name(phase));
  }
  return words;
}

std::vector<std::string> flag_names() {
  std::vector<std::string> words;
  for (const RecordFlag flag : written_flags) words.emplace_back(flag_name(flag));
  return words;
}

using Form = SignalColumn::Form;

// Adds columns one after the other.
class Columns {
 public:
  void add(std::string name, std::string unit, std::string frame, std::string meaning, Form form = Form::number) {
    all.push_back({std::move(name), std::move(unit), std::move(frame), std::move(meaning), form, {}});
  }
  void add_words(std::string name, std::string meaning, Form form, std::vector<std::string> words) {
    add(std::move(name), "", "", std::move(meaning), form);
    all.back().words = std::move(words);
  }
  // "force_W_x_N": a name, an axis, a unit.
  void add_vector(const std::string& name, const std::string& unit, const std::string& frame,
                  const std::string& meaning) {
    const std::string shown = unit == "m/s²" ? "m_per_s2" : unit;
    for (const char* axis : {"x", "y", "z"}) add(name + "_" + axis + "_" + shown, unit, frame, meaning + ", " + axis);
  }
  void add_orientation(const std::string& name, const std::string& meaning) {
    for (const char* part : {"x", "y", "z", "w"}) add(name + "_q" + part, "1", "W", meaning + ", quaternion " + part);
  }
  void add_axes(const std::vector<std::string>& names, const std::string& end, const std::string& unit,
                const std::string& meaning, Form form = Form::number) {
    for (const std::string& name : names) add(name + end, unit, "", meaning, form);
  }
  std::vector<SignalColumn> all;
};

void add_first(Columns& columns, const std::vector<std::string>& axis_names, bool with_truth) {
  columns.add("cycle", "1", "", "number of the cycle, k", Form::integer);
  columns.add("time_s", "s", "", "when the cycle was due, after the first one", Form::seconds);
  columns.add_words("phase", "of the supervisor: idle, enabling, taring, rendering, holding, freeing, stopping, …",
                    Form::word, phase_words());
  columns.add_words("contact", "free, stick or slip", Form::word, contact_words());
  columns.add_words("flags", "what was out of the ordinary, joined by a bar: limits that acted, late samples",
                    Form::flags, flag_names());
  columns.add_vector("force_S", "N", "S", "the sensor's reading");
  columns.add_vector("torque_S", "Nm", "S", "the sensor's reading, about its origin");
  columns.add_vector("force_W", "N", "W", "the hand's force h(k), bias and tool weight taken off");
  columns.add_vector("torque_W", "Nm", "W", "the hand's torque about the rendered point");
  columns.add_vector("p_hat_W", "m", "W", "p̂(k) of (26a): where the proxy would be without the world");
  columns.add_vector("proxy_W", "m", "W", "q(k) of (26b): where the proxy is");
  columns.add_vector("contact_force_W", "N", "W", "f(k) of (25a): the world's force on the proxy");
  columns.add_vector("normal_W", "1", "W", "of the first contact; zero in free motion");
  columns.add("contacts", "1", "", "how many things press at once", Form::integer);
  columns.add("contact_object", "1", "", "the first one's index in the scene; −1: none", Form::integer);
  columns.add("friction_1", "1", "", "its coefficient of friction");
  columns.add_vector("tool_W", "m", "W", "the rendered point by the encoders");
  columns.add("proxy_clearance_m", "m", "", "signed distance of the proxy to the nearest surface; below 0: inside");
  columns.add("tool_clearance_m", "m", "", "of the tool, by the truth where there is one");
  columns.add_axes(axis_names, "_target_counts", "counts", "sent to the drive in this cycle (607Ah; torques: 6071h)",
                   Form::integer);
  columns.add_axes(axis_names, "_actual_counts", "counts", "read from the drive (6064h)", Form::integer);
  if (!with_truth) return;
  columns.add_vector("true_tool_W", "m", "W", "where the simulated tool is");
  columns.add_vector("hand_force_W", "N", "W", "the simulated hand's force on the tool");
}

void add_more(Columns& columns, const std::vector<std::string>& axis_names, bool with_truth) {
  columns.add_words("fault", "that has stopped the arm, by its name", Form::word, fault_words());
  columns.add_words("held_for", "the fault that the arm is held for; empty in a hold that somebody asked for",
                    Form::word, fault_words());
  columns.add("proxy_mass_kg", "kg", "", "M of this step; the hand feels the handle's mass with it");
  columns.add("proxy_damping_Ns_per_m", "Ns/m", "", "B of this step");
  columns.add("energy_hand_J", "J", "", "that the hand has put in since rendering began");
  columns.add("energy_proxy_J", "J", "", "that the proxy has taken since then");
  columns.add_axes(axis_names, "_target_rad", "rad", "commanded: the motor's angle at the joint; m of a linear one");
  columns.add_axes(axis_names, "_actual_rad", "rad", "measured: the motor's angle at the joint; m of a linear one");
  columns.add_axes(axis_names, "_target_Nm", "Nm", "commanded torque at the joint, where drives take torques");
  columns.add_orientation("tool_W", "orientation of the tool by the encoders");
  for (std::size_t i = 0; i < other_contacts; ++i) {
    const std::string number = std::to_string(i + 2);
    columns.add("contact_object_" + number, "1", "", "of another contact: its index in the scene; −1: none",
                Form::integer);
    columns.add("friction_" + number, "1", "", "its coefficient of friction");
    columns.add_vector("normal_" + number + "_W", "1", "W", "its normal");
  }
  if (!with_truth) return;
  columns.add_orientation("true_tool_W", "orientation of the simulated tool");
  columns.add_vector("true_acceleration_W", "m/s²", "W", "of the simulated tool");
}

// What came with tools that turn.
void add_turning(Columns& columns, bool with_truth) {
  columns.add_orientation("proxy_W", "orientation of the proxy");
  columns.add_vector("contact_torque_W", "Nm", "W", "the world's torque on the proxy, about the rendered point");
  columns.add("proxy_inertia_kg_m2", "kg m²", "", "moment of inertia that the hand feels; 0: the orientation is held");
  if (with_truth) columns.add_vector("hand_torque_W", "Nm", "W", "the simulated hand's torque on the tool");
}

}  // namespace

std::vector<SignalColumn> signal_columns(const std::vector<std::string>& axis_names, bool with_truth) {
  Columns columns;
  add_first(columns, axis_names, with_truth);
  add_more(columns, axis_names, with_truth);
  add_turning(columns, with_truth);
  columns.add("limits_work_J", "J", "", "that limits have put into the proxy since rendering began; negative: taken");
  return std::move(columns.all);
}

std::string signals_header(const std::vector<std::string>& axis_names, bool with_truth) {
  std::string header;
  for (const SignalColumn& column : signal_columns(axis_names, with_truth)) {
    header += (header.empty() ? "" : ",") + column.name;
  }
  return header;
}

std::string columns_json(const std::vector<std::string>& axis_names, bool with_truth) {
  description::Json all = description::Json::array();
  for (const SignalColumn& column : signal_columns(axis_names, with_truth)) {
    description::Json one{{"name", column.name}};
    if (!column.unit.empty()) one["unit"] = column.unit;
    if (!column.frame.empty()) one["frame"] = column.frame;
    one["meaning"] = column.meaning;
    all.push_back(std::move(one));
  }
  return all.dump(1) + "\n";
}

void append_signals(std::string& text, const CycleRecord& record, std::size_t axes, bool with_truth,
                    const DerivedSignals& derived) {
  TextRow row(text);
  put_row(row, record, axes, with_truth, derived);
}

void store_signals(double* first, std::size_t apart, const CycleRecord& record, std::size_t axes, bool with_truth,
                   const DerivedSignals& derived) {
  NumberRow row(first, apart);
  put_row(row, record, axes, with_truth, derived);
}

void append_stored(std::string& text, Form form, const std::vector<std::string>& words, double value) {
  if (is_empty(value)) return;
  if (form == Form::number || !(std::abs(value) < 9e18)) return append_number(text, value);
  if (form == Form::seconds) return append_seconds(text, std::llround(1e9 * value), 0);
  const auto whole = static_cast<std::int64_t>(value);
  if (form == Form::integer) return append_number(text, whole);
  if (form == Form::word) {
    // Of a damaged file; phase_name says the same of what is no phase.
    text += whole >= 0 && static_cast<std::size_t>(whole) < words.size() ? words[static_cast<std::size_t>(whole)] : "?";
    return;
  }
  bool first = true;
  for (std::size_t i = 0; i < words.size() && i < 63; ++i) {
    if ((whole >> i & 1) == 0) continue;
    if (!first) text += '|';
    text += words[i];
    first = false;
  }
}

}  // namespace proxarm::controller
