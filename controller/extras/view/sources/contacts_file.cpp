#include "controller/extras/view/sources/contacts_file.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include "controller/signals/point_contacts.hpp"

namespace proxarm::view {
namespace {

using controller::CycleRecord;
using controller::RecordedContact;
using controller::Triple;

// A damaged file may contain any number.
std::int32_t index_of(double value) { return std::abs(value) < 1e9 ? static_cast<std::int32_t>(value) : -1; }

double number_of(std::string_view text) {
  double number = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

template <Triple RecordedContact::*vector>
void store_part(RecordedContact& contact, std::size_t part, double value) {
  (contact.*vector)[part] = value;
}

}  // namespace

ContactsFile::Column ContactsFile::column_named(std::string_view name) {
  if (name == "object") return {[](RecordedContact& c, std::size_t, double v) { c.object = index_of(v); }};
  if (name == "part") return {[](RecordedContact& c, std::size_t, double v) { c.part = index_of(v); }};
  if (name == "state") return {[](RecordedContact& c, std::size_t, double v) { c.slips = v == 1.0; }};
  if (name == "friction_1") return {[](RecordedContact& c, std::size_t, double v) { c.friction = v; }};
  if (name == "gap_m") return {[](RecordedContact& c, std::size_t, double v) { c.gap_m = v; }};
  struct Vector {
    std::string_view name, unit;
    Store store;
  };
  constexpr std::array vectors{Vector{"point_W", "m", store_part<&RecordedContact::point_W_m>},
                               Vector{"normal_W", "1", store_part<&RecordedContact::normal_W>},
                               Vector{"force_W", "N", store_part<&RecordedContact::force_W_N>}};
  constexpr std::array axes{"_x_", "_y_", "_z_"};
  for (const Vector& vector : vectors) {
    for (std::size_t part = 0; part < axes.size(); ++part) {
      if (name == std::string(vector.name) + axes[part] + std::string(vector.unit)) return {vector.store, part};
    }
  }
  return {};
}

ContactsFile::ContactsFile(const std::filesystem::path& folder) {
  std::error_code error;
  if (std::filesystem::exists(folder / "contacts.bin", error)) {
    table_ = std::make_unique<controller::SignalTable>(folder / "contacts.bin");
    for (const auto& column : table_->columns()) columns_.push_back(column_named(column.name));
  } else if (std::filesystem::exists(folder / "contacts.csv", error)) {
    text_ = std::make_unique<TextTable>(folder / "contacts.csv", "cycle,time_s,number");
    for (const std::string_view name : text_->names()) columns_.push_back(column_named(name));
  }
}

std::uint64_t ContactsFile::cycle_of(std::size_t row) const {
  if (!table_) return text_->first(row);
  const double cycle = table_->value(row, 0);
  return cycle >= 0.0 && cycle < 9e15 ? static_cast<std::uint64_t>(cycle) : 0;
}

RecordedContact ContactsFile::contact(std::size_t row) const {
  RecordedContact contact;
  const auto store = [&](std::size_t column, double value) {
    if (column < columns_.size() && columns_[column].store != nullptr) {
      columns_[column].store(contact, columns_[column].part, value);
    }
  };
  if (table_) {
    for (std::size_t i = 0; i < columns_.size(); ++i) store(i, table_->value(row, i));
  } else {
    text_->visit(row, [&](std::size_t column, std::string_view text) {
      store(column, text == "slip" ? 1.0 : text == "stick" ? 0.0 : number_of(text));
    });
  }
  return contact;
}

void ContactsFile::complete(CycleRecord& record) const {
  if (!table_ && !text_) {
    controller::place_contacts(record);
    return;
  }
  std::size_t low = 0, high = rows();
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    cycle_of(middle) < record.cycle ? low = middle + 1 : high = middle;
  }
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
    if (low + i < rows() && cycle_of(low + i) == record.cycle) record.contacts[i] = contact(low + i);
  }
}

}  // namespace proxarm::view
