#include "controller/signals/contact_columns.hpp"

#include "controller/signals/written_rows.hpp"

namespace proxarm::controller {
namespace {

using Form = SignalColumn::Form;

void put_contact(auto& row, const CycleRecord& record, std::size_t index) {
  const RecordedContact& contact = record.contacts[index];
  const ContactPhase state = contact.slips ? ContactPhase::slip : ContactPhase::stick;
  row.integer(record.cycle);
  row.seconds(record.time_ns);
  row.integer(index + 1);
  row.integer(contact.object);
  row.integer(contact.part);
  row.word(contact_phase_name(state), contact.slips ? 1 : 0);
  row.number(contact.friction);
  row.number(contact.gap_m);
  for (const Triple& vector :
       {contact.point_W_m, contact.normal_W, contact.force_W_N, contact_torque_W_Nm(record, contact)}) {
    put_all(row, vector);
  }
}

}  // namespace

const std::vector<SignalColumn>& contact_columns() {
  static const std::vector<SignalColumn> all = [] {
    Columns columns;
    columns.add("cycle", "1", "", "number of the cycle, k", Form::integer);
    columns.add("time_s", "s", "", "when the cycle was due, after the first one", Form::seconds);
    columns.add("number", "1", "", "of the contact in its cycle, from 1; of a tool the strongest first", Form::integer);
    columns.add("object", "1", "", "its index in the scene; below 0: no part of it", Form::integer);
    columns.add("part", "1", "", "of the tool's shape, from 0; −1: a point", Form::integer);
    columns.add_words("state", "stick or slip", Form::word,
                      {contact_phase_name(ContactPhase::stick), contact_phase_name(ContactPhase::slip)});
    columns.add("friction_1", "1", "", "coefficient of friction between the two");
    columns.add("gap_m", "m", "", "between proxy and object there; below 0: inside, or pressed into an elastic layer");
    columns.add_vector("point_W", "m", "W", "where they touch");
    columns.add_vector("normal_W", "1", "W", "unit, out of the object");
    columns.add_vector("force_W", "N", "W", "of the object on the proxy");
    columns.add_vector("torque_W", "Nm", "W", "of this force about the rendered point");
    return std::move(columns.all);
  }();
  return all;
}

Triple contact_torque_W_Nm(const CycleRecord& record, const RecordedContact& contact) noexcept {
  const models::Vec3 arm_W = vec3(contact.point_W_m) - vec3(record.proxy_W_m);
  return triple(arm_W.cross(vec3(contact.force_W_N)));
}

void append_contact(std::string& text, const CycleRecord& record, std::size_t index) {
  TextRow row(text);
  put_contact(row, record, index);
}

void store_contact(double* first, std::size_t apart, const CycleRecord& record, std::size_t index) {
  NumberRow row(first, apart);
  put_contact(row, record, index);
}

}  // namespace proxarm::controller
