#include "controller/signals/signal_columns.hpp"

#include <cmath>
#include <cstdint>

#include "controller/signals/written_rows.hpp"
#include "controller/supervision/fault.hpp"
#include "models/files/json.hpp"

namespace proxarm::controller {
namespace {

void put_first(auto& row, const CycleRecord& r, std::size_t axes, bool with_truth) {
  row.integer(r.cycle);
  row.seconds(r.time_ns);
  row.word(phase_name(r.phase), static_cast<int>(r.phase));
  row.word(contact_phase_name(r.contact), static_cast<int>(r.contact));
  row.flags(r);
  for (const Triple* values : {&r.force_S_N, &r.torque_S_Nm, &r.force_W_N, &r.torque_W_Nm, &r.p_hat_W_m, &r.proxy_W_m,
                               &r.contact_force_W_N, &r.contacts[0].normal_W}) {
    put_all(row, *values);
  }
  row.integer(static_cast<int>(r.contact_count));
  row.integer(r.contacts[0].object);
  row.number(r.contacts[0].friction);
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

// The columns that were added after the first version of the record.
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
  for (std::size_t i = 1; i < contacts_in_signals; ++i) {
    row.integer(r.contacts[i].object);
    row.number(r.contacts[i].friction);
    put_all(row, r.contacts[i].normal_W);
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
  for (std::size_t i = 1; i < contacts_in_signals; ++i) {
    const std::string number = std::to_string(i + 1);
    columns.add("contact_object_" + number, "1", "", "of another contact: its index in the scene; −1: none",
                Form::integer);
    columns.add("friction_" + number, "1", "", "its coefficient of friction");
    columns.add_vector("normal_" + number + "_W", "1", "W", "its normal");
  }
  if (!with_truth) return;
  columns.add_orientation("true_tool_W", "orientation of the simulated tool");
  columns.add_vector("true_acceleration_W", "m/s²", "W", "of the simulated tool");
}

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

std::string header_of(const std::vector<SignalColumn>& columns) {
  std::string header;
  for (const SignalColumn& column : columns) header += (header.empty() ? "" : ",") + column.name;
  return header;
}

std::string signals_header(const std::vector<std::string>& axis_names, bool with_truth) {
  return header_of(signal_columns(axis_names, with_truth));
}

std::string json_of(const std::vector<SignalColumn>& columns) {
  description::Json all = description::Json::array();
  for (const SignalColumn& column : columns) {
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
    // This happens only in a damaged file. phase_name() returns the same text for invalid phases.
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
