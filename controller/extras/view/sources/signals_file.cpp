#include "controller/extras/view/sources/signals_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>
#include <type_traits>

#include "controller/stage/words.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::view {
namespace {

using controller::CycleRecord;
using controller::Triple;
using description::SetupError;

using Field = SignalsFile::Field;

template <typename Number>
Number number_of(const Field& field) {
  Number number{};
  if (!field.is_number) {
    std::from_chars(field.text.data(), field.text.data() + field.text.size(), number);
    // A whole number is never beyond 9e18.
  } else if (std::is_floating_point_v<Number> || std::abs(field.number) < 9e18) {
    number = static_cast<Number>(field.number);
  }
  return number;
}

template <Triple CycleRecord::*vector>
void store_part(CycleRecord& record, std::size_t part, const Field& field) {
  (record.*vector)[part] = number_of<double>(field);
}

template <double CycleRecord::*value>
void store_value(CycleRecord& record, std::size_t /*part*/, const Field& field) {
  record.*value = number_of<double>(field);
}

template <auto counts>
void store_count(CycleRecord& record, std::size_t axis, const Field& field) {
  (record.*counts)[axis] = number_of<std::int32_t>(field);
  record.axes = static_cast<std::uint8_t>(std::max<std::size_t>(record.axes, axis + 1));
}

void store_time(CycleRecord& record, std::size_t /*part*/, const Field& field) {
  record.time_ns = std::llround(1e9 * number_of<double>(field));
}

void store_phase(CycleRecord& record, std::size_t /*part*/, const Field& field) {
  for (std::size_t i = 0; i < controller::phase_count; ++i) {
    const auto phase = static_cast<controller::Phase>(i);
    if (field.text == controller::phase_name(phase)) record.phase = phase;
  }
}

void store_contact(CycleRecord& record, std::size_t /*part*/, const Field& field) {
  using controller::ContactPhase;
  for (const ContactPhase phase : {ContactPhase::free, ContactPhase::stick, ContactPhase::slip}) {
    if (field.text == controller::contact_phase_name(phase)) record.contact = phase;
  }
}

void store_flags(CycleRecord& record, std::size_t /*part*/, const Field& field) {
  std::string_view text = field.text;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find('|'));
    for (const FlagWords& flag : flag_words()) {
      if (word == controller::flag_name(flag.flag)) record.set(flag.flag);
    }
    text.remove_prefix(std::min(word.size() + 1, text.size()));
  }
}

struct Named {
  std::string_view name;
  void (*store)(CycleRecord&, std::size_t, const Field&);
};

constexpr std::array singles{
    Named{"cycle", [](CycleRecord& r, std::size_t, const Field& f) { r.cycle = number_of<std::uint64_t>(f); }},
    Named{"time_s", store_time},
    Named{"phase", store_phase},
    Named{"contact", store_contact},
    Named{"flags", store_flags},
    Named{"contacts",
          [](CycleRecord& r, std::size_t, const Field& f) { r.contact_count = number_of<std::uint8_t>(f); }},
    Named{"contact_object",
          [](CycleRecord& r, std::size_t, const Field& f) { r.contacts[0].object = number_of<std::int32_t>(f); }},
    Named{"friction_1",
          [](CycleRecord& r, std::size_t, const Field& f) { r.contacts[0].friction = number_of<double>(f); }},
    Named{"proxy_mass_kg", store_value<&CycleRecord::proxy_mass_kg>},
    Named{"proxy_damping_Ns_per_m", store_value<&CycleRecord::proxy_damping_Ns_per_m>},
    Named{"proxy_inertia_kg_m2", store_value<&CycleRecord::proxy_inertia_kg_m2>},
    Named{"energy_hand_J",
          [](CycleRecord& r, std::size_t, const Field& f) { r.energies_J.hand = number_of<double>(f); }},
    Named{"energy_proxy_J",
          [](CycleRecord& r, std::size_t, const Field& f) { r.energies_J.proxy = number_of<double>(f); }},
    Named{"proxy_clearance_m", store_value<&CycleRecord::proxy_clearance_m>},
    Named{"tool_clearance_m", store_value<&CycleRecord::tool_clearance_m>}};

// A vector has three columns, named by the vector's name, an axis and a unit: "force_W_x_N".
struct NamedVector {
  std::string_view name, unit;
  void (*store)(CycleRecord&, std::size_t, const Field&);
};
constexpr std::array vectors{NamedVector{"force_S", "N", store_part<&CycleRecord::force_S_N>},
                             NamedVector{"torque_S", "Nm", store_part<&CycleRecord::torque_S_Nm>},
                             NamedVector{"force_W", "N", store_part<&CycleRecord::force_W_N>},
                             NamedVector{"torque_W", "Nm", store_part<&CycleRecord::torque_W_Nm>},
                             NamedVector{"p_hat_W", "m", store_part<&CycleRecord::p_hat_W_m>},
                             NamedVector{"proxy_W", "m", store_part<&CycleRecord::proxy_W_m>},
                             NamedVector{"contact_force_W", "N", store_part<&CycleRecord::contact_force_W_N>},
                             NamedVector{"normal_W", "1",
                                         [](CycleRecord& r, std::size_t part, const Field& f) {
                                           r.contacts[0].normal_W[part] = number_of<double>(f);
                                         }},
                             NamedVector{"tool_W", "m", store_part<&CycleRecord::tool_W_m>},
                             NamedVector{"true_tool_W", "m", store_part<&CycleRecord::true_tool_W_m>},
                             NamedVector{"hand_force_W", "N", store_part<&CycleRecord::hand_force_W_N>},
                             NamedVector{"contact_torque_W", "Nm", store_part<&CycleRecord::contact_torque_W_Nm>},
                             NamedVector{"hand_torque_W", "Nm", store_part<&CycleRecord::hand_torque_W_Nm>}};

// Columns of further contacts are named "contact_object_2", "friction_2", "normal_2_W_x_1".
constexpr std::array<std::string_view, 3> axes_in_names{"_x_", "_y_", "_z_"};

struct OtherColumn {
  void (*store)(CycleRecord&, std::size_t, const Field&) = nullptr;
  std::size_t part = 0;
};

OtherColumn column_of_other(std::string_view name) {
  for (std::size_t i = 1; i < controller::contacts_in_signals; ++i) {
    const std::string number = std::to_string(i + 1);
    if (name == "contact_object_" + number) {
      return {
          [](CycleRecord& r, std::size_t at, const Field& f) { r.contacts[at].object = number_of<std::int32_t>(f); },
          i};
    }
    if (name == "friction_" + number) {
      return {[](CycleRecord& r, std::size_t at, const Field& f) { r.contacts[at].friction = number_of<double>(f); },
              i};
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (name != "normal_" + number + "_W" + std::string(axes_in_names[axis]) + "1") continue;
      return {[](CycleRecord& r, std::size_t at, const Field& f) {
                r.contacts[at / 3].normal_W[at % 3] = number_of<double>(f);
              },
              3 * i + axis};
    }
  }
  return {};
}

}  // namespace

SignalsFile::Column SignalsFile::column_named(std::string_view name, const std::vector<std::string>& axis_names) const {
  for (const Named& known : singles) {
    if (name == known.name) return {known.store, 0};
  }
  for (const NamedVector& known : vectors) {
    for (std::size_t part = 0; part < axes_in_names.size(); ++part) {
      if (name == std::string(known.name) + std::string(axes_in_names[part]) + std::string(known.unit))
        return {known.store, part};
    }
  }
  for (std::size_t axis = 0; axis < axis_names.size() && axis < controller::max_axes; ++axis) {
    if (name == axis_names[axis] + "_target_counts") return {store_count<&CycleRecord::target_counts>, axis};
    if (name == axis_names[axis] + "_actual_counts") return {store_count<&CycleRecord::actual_counts>, axis};
  }
  constexpr std::array<std::string_view, 4> of_proxy{"proxy_W_qx", "proxy_W_qy", "proxy_W_qz", "proxy_W_qw"};
  for (std::size_t part = 0; part < of_proxy.size(); ++part) {
    if (name == of_proxy[part]) {
      return {[](CycleRecord& r, std::size_t at, const Field& f) { r.proxy_q_W[at] = number_of<double>(f); }, part};
    }
  }
  constexpr std::array<std::string_view, 4> of_steel{"true_tool_W_qx", "true_tool_W_qy", "true_tool_W_qz",
                                                     "true_tool_W_qw"};
  for (std::size_t part = 0; part < of_steel.size(); ++part) {
    if (name == of_steel[part]) {
      return {[](CycleRecord& r, std::size_t at, const Field& f) { r.true_tool_q_W[at] = number_of<double>(f); }, part};
    }
  }
  const OtherColumn other = column_of_other(name);
  return {other.store, other.part};
}

SignalsFile::SignalsFile(const std::filesystem::path& folder, const std::vector<std::string>& axis_names) {
  std::error_code error;
  const bool as_table = std::filesystem::exists(folder / "signals.bin", error);
  const std::filesystem::path file = folder / (as_table ? "signals.bin" : "signals.csv");
  if (as_table) {
    table_ = std::make_unique<controller::SignalTable>(file);
    for (const auto& column : table_->columns()) columns_.push_back(column_named(column.name, axis_names));
  } else {
    text_ = std::make_unique<TextTable>(file, "cycle,time_s");
    for (const std::string_view name : text_->names()) columns_.push_back(column_named(name, axis_names));
  }
  if (size() > 0) return;
  throw SetupError({.file = file.string(),
                    .found = "a file without a cycle",
                    .expected = "signals of a session that was recorded, or of a black box"});
}

CycleRecord SignalsFile::row(std::size_t index) const {
  CycleRecord record;
  if (table_) {
    add_from_table(record, index);
    return record;
  }
  text_->visit(index, [&](std::size_t at, std::string_view text) {
    if (at < columns_.size() && columns_[at].store != nullptr) {
      columns_[at].store(record, columns_[at].part, {.text = text});
    }
  });
  return record;
}

void SignalsFile::add_from_table(CycleRecord& record, std::size_t index) const {
  using Form = controller::SignalColumn::Form;
  std::string words;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const double value = table_->value(index, i);
    if (columns_[i].store == nullptr || controller::is_empty(value)) continue;
    const auto& of = table_->columns()[i];
    if (of.form == Form::word || of.form == Form::flags) {
      words.clear();
      controller::append_stored(words, of.form, of.words, value);
      columns_[i].store(record, columns_[i].part, {.text = words});
    } else {
      columns_[i].store(record, columns_[i].part, {.number = value, .is_number = true});
    }
  }
}

}  // namespace proxarm::view
