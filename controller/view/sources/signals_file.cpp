#include "controller/view/sources/signals_file.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "controller/view/stage/words.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::view {
namespace {

using controller::CycleRecord;
using controller::Triple;
using description::SetupError;

template <typename Number>
Number number_of(std::string_view text) {
  Number number{};
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

template <Triple CycleRecord::*vector>
void store_part(CycleRecord& record, std::size_t part, std::string_view text) {
  (record.*vector)[part] = number_of<double>(text);
}

template <double CycleRecord::*value>
void store_value(CycleRecord& record, std::size_t /*part*/, std::string_view text) {
  record.*value = number_of<double>(text);
}

template <auto counts>
void store_count(CycleRecord& record, std::size_t axis, std::string_view text) {
  (record.*counts)[axis] = number_of<std::int32_t>(text);
  record.axes = static_cast<std::uint8_t>(std::max<std::size_t>(record.axes, axis + 1));
}

void store_time(CycleRecord& record, std::size_t /*part*/, std::string_view text) {
  record.time_ns = std::llround(1e9 * number_of<double>(text));
}

void store_phase(CycleRecord& record, std::size_t /*part*/, std::string_view text) {
  for (std::size_t i = 0; i < controller::phase_count; ++i) {
    const auto phase = static_cast<controller::Phase>(i);
    if (text == controller::phase_name(phase)) record.phase = phase;
  }
}

void store_contact(CycleRecord& record, std::size_t /*part*/, std::string_view text) {
  using controller::ContactPhase;
  for (const ContactPhase phase : {ContactPhase::free, ContactPhase::stick, ContactPhase::slip}) {
    if (text == controller::contact_phase_name(phase)) record.contact = phase;
  }
}

void store_flags(CycleRecord& record, std::size_t /*part*/, std::string_view text) {
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
  void (*store)(CycleRecord&, std::size_t, std::string_view);
};

constexpr std::array singles{
    Named{"cycle", [](CycleRecord& r, std::size_t, std::string_view t) { r.cycle = number_of<std::uint64_t>(t); }},
    Named{"time_s", store_time},
    Named{"phase", store_phase},
    Named{"contact", store_contact},
    Named{"flags", store_flags},
    Named{"contacts",
          [](CycleRecord& r, std::size_t, std::string_view t) { r.contact_count = number_of<std::uint8_t>(t); }},
    Named{"contact_object",
          [](CycleRecord& r, std::size_t, std::string_view t) { r.contact_object = number_of<std::int32_t>(t); }},
    Named{"friction_1", store_value<&CycleRecord::friction>},
    Named{"proxy_mass_kg", store_value<&CycleRecord::proxy_mass_kg>},
    Named{"proxy_damping_Ns_per_m", store_value<&CycleRecord::proxy_damping_Ns_per_m>},
    Named{"proxy_inertia_kg_m2", store_value<&CycleRecord::proxy_inertia_kg_m2>},
    Named{"energy_hand_J",
          [](CycleRecord& r, std::size_t, std::string_view t) { r.energies_J.hand = number_of<double>(t); }},
    Named{"energy_proxy_J",
          [](CycleRecord& r, std::size_t, std::string_view t) { r.energies_J.proxy = number_of<double>(t); }},
    Named{"proxy_clearance_m", store_value<&CycleRecord::proxy_clearance_m>},
    Named{"tool_clearance_m", store_value<&CycleRecord::tool_clearance_m>}};

// "force_W_x_N": a name, an axis, a unit.
struct NamedVector {
  std::string_view name, unit;
  void (*store)(CycleRecord&, std::size_t, std::string_view);
};
constexpr std::array vectors{NamedVector{"force_S", "N", store_part<&CycleRecord::force_S_N>},
                             NamedVector{"torque_S", "Nm", store_part<&CycleRecord::torque_S_Nm>},
                             NamedVector{"force_W", "N", store_part<&CycleRecord::force_W_N>},
                             NamedVector{"torque_W", "Nm", store_part<&CycleRecord::torque_W_Nm>},
                             NamedVector{"p_hat_W", "m", store_part<&CycleRecord::p_hat_W_m>},
                             NamedVector{"proxy_W", "m", store_part<&CycleRecord::proxy_W_m>},
                             NamedVector{"contact_force_W", "N", store_part<&CycleRecord::contact_force_W_N>},
                             NamedVector{"normal_W", "1", store_part<&CycleRecord::normal_W>},
                             NamedVector{"tool_W", "m", store_part<&CycleRecord::tool_W_m>},
                             NamedVector{"true_tool_W", "m", store_part<&CycleRecord::true_tool_W_m>},
                             NamedVector{"hand_force_W", "N", store_part<&CycleRecord::hand_force_W_N>},
                             NamedVector{"contact_torque_W", "Nm", store_part<&CycleRecord::contact_torque_W_Nm>},
                             NamedVector{"hand_torque_W", "Nm", store_part<&CycleRecord::hand_torque_W_Nm>}};

// "contact_object_2", "friction_2", "normal_2_W_x_1": of further contacts.
constexpr std::array<std::string_view, 3> axes_in_names{"_x_", "_y_", "_z_"};

struct OtherColumn {
  void (*store)(CycleRecord&, std::size_t, std::string_view) = nullptr;
  std::size_t part = 0;
};

OtherColumn column_of_other(std::string_view name) {
  for (std::size_t i = 0; i < controller::other_contacts; ++i) {
    const std::string number = std::to_string(i + 2);
    if (name == "contact_object_" + number) {
      return {
          [](CycleRecord& r, std::size_t at, std::string_view t) { r.others[at].object = number_of<std::int32_t>(t); },
          i};
    }
    if (name == "friction_" + number) {
      return {[](CycleRecord& r, std::size_t at, std::string_view t) { r.others[at].friction = number_of<double>(t); },
              i};
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (name != "normal_" + number + "_W" + std::string(axes_in_names[axis]) + "1") continue;
      return {[](CycleRecord& r, std::size_t at, std::string_view t) {
                r.others[at / 3].normal_W[at % 3] = number_of<double>(t);
              },
              3 * i + axis};
    }
  }
  return {};
}

// The line that begins at `at`, without its end.
std::string_view line_at(std::string_view text, std::size_t at) { return text.substr(at, text.find('\n', at) - at); }

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
      return {[](CycleRecord& r, std::size_t at, std::string_view t) { r.proxy_q_W[at] = number_of<double>(t); }, part};
    }
  }
  const OtherColumn other = column_of_other(name);
  return {other.store, other.part};
}

SignalsFile::SignalsFile(const std::filesystem::path& file, const std::vector<std::string>& axis_names) : name_(file) {
  const auto refuse = [&](const char* found) {
    throw SetupError({.file = file.string(),
                      .found = found,
                      .expected = "signals.csv of a session that was recorded, or of a black box"});
  };
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (descriptor < 0 || fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) refuse("no such file");
  const auto bytes = static_cast<std::size_t>(status.st_size);
  void* const memory = bytes > 0 ? mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, descriptor, 0) : MAP_FAILED;
  close(descriptor);
  if (memory == MAP_FAILED) refuse("an empty file");
  text_ = {static_cast<const char*>(memory), bytes};

  const std::string_view header = line_at(text_, 0);
  for (std::size_t at = 0; at <= header.size();) {
    const std::string_view name = header.substr(at, header.find(',', at) - at);
    columns_.push_back(column_named(name, axis_names));
    at += name.size() + 1;
  }
  if (header.substr(0, 12) != "cycle,time_s") refuse("another kind of file");
  for (std::size_t at = header.size() + 1; at < bytes;) {
    const std::size_t end = text_.find('\n', at);
    if (end == std::string_view::npos) break;
    rows_.push_back(at);
    at = end + 1;
  }
  if (rows_.empty()) refuse("a file without a cycle");
}

SignalsFile::~SignalsFile() { munmap(const_cast<char*>(text_.data()), text_.size()); }

CycleRecord SignalsFile::row(std::size_t index) const {
  CycleRecord record;
  const std::string_view line = line_at(text_, rows_[index]);
  std::size_t at = 0;
  for (const Column& column : columns_) {
    if (at > line.size()) break;
    const std::string_view value = line.substr(at, line.find(',', at) - at);
    if (column.store != nullptr) column.store(record, column.part, value);
    at += value.size() + 1;
  }
  return record;
}

}  // namespace proxarm::view
