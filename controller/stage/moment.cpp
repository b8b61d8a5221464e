#include "controller/stage/moment.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace proxarm::view {
namespace {

using controller::CycleRecord;
using controller::Triple;
using models::Vec3;

struct Field {
  const char* name;
  double (*value)(const Moment&);
};

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

double norm(const Triple& v) noexcept { return controller::vec3(v).norm(); }

constexpr std::array fields{
    Field{"cycle", [](const Moment& m) { return static_cast<double>(m.record.cycle); }},
    Field{"time_s", [](const Moment& m) { return 1e-9 * static_cast<double>(m.record.time_ns); }},
    Field{"rendered_s", [](const Moment& m) { return m.rendered_s; }},
    Field{"period_s", [](const Moment& m) { return 1e-9 * static_cast<double>(m.record.period_ns); }},
    Field{"phase", [](const Moment& m) { return static_cast<double>(m.record.phase); }},
    Field{"contact", [](const Moment& m) { return static_cast<double>(m.record.contact); }},
    Field{"contacts", [](const Moment& m) { return static_cast<double>(m.record.contact_count); }},
    Field{"object", [](const Moment& m) { return static_cast<double>(m.record.contacts[0].object); }},
    Field{"friction", [](const Moment& m) { return m.record.contacts[0].friction; }},
    Field{"flags", [](const Moment& m) { return static_cast<double>(m.record.flags); }},
    Field{"flags_since", [](const Moment& m) { return static_cast<double>(m.flags_since); }},
    Field{"fault", [](const Moment& m) { return static_cast<double>(m.record.fault); }},
    Field{"held_for", [](const Moment& m) { return static_cast<double>(m.record.held_for); }},
    Field{"compute_us", [](const Moment& m) { return 1e-3 * static_cast<double>(m.record.compute_ns); }},
    Field{"compute_peak_us", [](const Moment& m) { return m.compute_peak_us; }},
    Field{"overruns", [](const Moment& m) { return static_cast<double>(m.overruns); }},
    Field{
        "mass_kg",
        [](const Moment& m) { return m.record.proxy_mass_kg > 0.0 ? m.record.proxy_mass_kg + m.handle_mass_kg : 0.0; }},
    Field{"handle_kg", [](const Moment& m) { return m.handle_mass_kg; }},
    Field{"inertia_kg_m2", [](const Moment& m) { return m.record.proxy_inertia_kg_m2; }},
    Field{"damping_Ns_per_m", [](const Moment& m) { return m.record.proxy_damping_Ns_per_m; }},
    Field{"energy_hand_J", [](const Moment& m) { return m.record.energies_J.hand; }},
    Field{"energy_proxy_J", [](const Moment& m) { return m.record.energies_J.proxy; }},
    Field{"proxy_clearance_m", [](const Moment& m) { return m.record.proxy_clearance_m; }},
    Field{"tool_clearance_m", [](const Moment& m) { return m.record.tool_clearance_m; }},
    Field{"sensor_N", [](const Moment& m) { return norm(m.record.force_S_N); }},
    Field{"hand_N", [](const Moment& m) { return norm(m.record.force_W_N); }},
    Field{"hand_peak_N", [](const Moment& m) { return m.hand_peak_N; }},
    Field{"contact_N", [](const Moment& m) { return norm(m.record.contact_force_W_N); }},
    Field{"contact_peak_N", [](const Moment& m) { return m.contact_peak_N; }},
    Field{"blow_Ns", [](const Moment& m) { return m.blow.impulse_Ns(); }},
    Field{"blow_s", [](const Moment& m) { return m.blow.begun_s(); }},
    Field{"room_below_m", [](const Moment& m) { return m.room ? m.room->below_m : unknown; }},
    Field{"room_above_m", [](const Moment& m) { return m.room ? m.room->above_m : unknown; }},
    Field{"room_x", [](const Moment& m) { return m.room ? m.room->normal_W.x() : unknown; }},
    Field{"room_y", [](const Moment& m) { return m.room ? m.room->normal_W.y() : unknown; }},
    Field{"room_z", [](const Moment& m) { return m.room ? m.room->normal_W.z() : unknown; }},
};

struct VectorField {
  const char* name;
  Triple CycleRecord::*value;
};
constexpr std::array vectors{
    VectorField{"force", &CycleRecord::force_W_N},
    VectorField{"torque", &CycleRecord::torque_W_Nm},
    VectorField{"p_hat", &CycleRecord::p_hat_W_m},
    VectorField{"proxy", &CycleRecord::proxy_W_m},
    VectorField{"contact_force", &CycleRecord::contact_force_W_N},
    VectorField{"contact_torque", &CycleRecord::contact_torque_W_Nm},
    VectorField{"tool", &CycleRecord::tool_W_m},
    VectorField{"steel", &CycleRecord::true_tool_W_m}};  // the true tool in simulation; zero: unknown

template <typename Number>
void append(std::string& bytes, std::span<const Number> numbers) {
  const std::size_t at = bytes.size();
  bytes.resize(at + numbers.size_bytes());
  if (!numbers.empty()) std::memcpy(bytes.data() + at, numbers.data(), numbers.size_bytes());
}

void append_pose(std::string& bytes, const models::Pose& X) {
  const Eigen::Quaterniond q(X.linear());
  const std::array numbers{static_cast<float>(X.translation().x()),
                           static_cast<float>(X.translation().y()),
                           static_cast<float>(X.translation().z()),
                           static_cast<float>(q.x()),
                           static_cast<float>(q.y()),
                           static_cast<float>(q.z()),
                           static_cast<float>(q.w())};
  append<float>(bytes, numbers);
}

}  // namespace

void MomentBuilder::add(const CycleRecord& record, double rendered_s) noexcept {
  if (cycles_++ == 0) {
    next_.flags_since = 0;
    next_.compute_peak_us = next_.hand_peak_N = next_.contact_peak_N = 0.0;
  }
  next_.record = record;
  if (record.tool_mass_kg > 0.0 && next_.handle_mass_kg > 0.0) next_.handle_mass_kg = record.tool_mass_kg;
  next_.rendered_s = rendered_s;
  next_.flags_since |= record.flags;
  next_.compute_peak_us = std::max(next_.compute_peak_us, 1e-3 * static_cast<double>(record.compute_ns));
  next_.hand_peak_N = std::max(next_.hand_peak_N, norm(record.force_W_N));
  next_.contact_peak_N = std::max(next_.contact_peak_N, norm(record.contact_force_W_N));
  next_.blow.add(record);
  if (record.has(controller::RecordFlag::overrun)) ++next_.overruns;
}

Moment MomentBuilder::take() noexcept {
  cycles_ = 0;
  return next_;
}

const std::vector<std::string>& field_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Field& field : fields) all.emplace_back(field.name);
    for (const VectorField& vector : vectors) {
      for (const char* axis : {"_x", "_y", "_z"}) all.push_back(std::string(vector.name) + axis);
    }
    return all;
  }();
  return names;
}

void append_fields(std::vector<double>& row, const Moment& moment) {
  for (const Field& field : fields) row.push_back(field.value(moment));
  for (const VectorField& vector : vectors) {
    const Triple& value = moment.record.*vector.value;
    row.insert(row.end(), value.begin(), value.end());
  }
}

const std::vector<std::string>& contact_field_names() {
  static const std::vector<std::string> names{
      "object",   "part",    "slips",   "friction", "gap_m",  "point_x", "point_y", "point_z", "normal_x", "normal_y",
      "normal_z", "force_x", "force_y", "force_z",  "tool_x", "tool_y",  "tool_z",  "steel_x", "steel_y",  "steel_z"};
  return names;
}

namespace {

// Returns the displacement in W of a point of a rigid tool, if the tool moves from the proxy's pose to this place and
// orientation. `point` is where the tool's point is with the tool at the proxy's pose. A tool that doesn't turn keeps
// the proxy's orientation.
Vec3 moved_with(const CycleRecord& record, const Vec3& point, const Vec3& place,
                const models::Quaternion& orientation) {
  const Vec3 proxy = controller::vec3(record.proxy_W_m), arm = point - proxy;
  if (!(record.proxy_inertia_kg_m2 > 0.0)) return place - proxy;
  const models::Quaternion turn = orientation * models::Quaternion(record.proxy_q_W.data()).conjugate();
  return place - proxy + (turn * arm - arm);
}

// Appends the contacts' fields in the order of contact_field_names().
void append_contacts(std::vector<double>& row, const Moment& moment) {
  const CycleRecord& record = moment.record;
  // The tool's true place is known only in simulations, and in their records.
  const Vec3 steel = controller::vec3(record.true_tool_W_m);
  const bool is_known = steel.norm() > 0.0;
  row.push_back(static_cast<double>(record.recorded_contacts()));
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
    const controller::RecordedContact& contact = record.contacts[i];
    const std::array numbers{static_cast<double>(contact.object), static_cast<double>(contact.part),
                             contact.slips ? 1.0 : 0.0, contact.friction, contact.gap_m};
    row.insert(row.end(), numbers.begin(), numbers.end());
    for (const Triple* vector : {&contact.point_W_m, &contact.normal_W, &contact.force_W_N}) {
      row.insert(row.end(), vector->begin(), vector->end());
    }
    const Vec3 point = controller::vec3(contact.point_W_m);
    const Vec3 by_encoders = moved_with(record, point, controller::vec3(record.tool_W_m), moment.tool_q);
    Vec3 truly = Vec3::Constant(unknown);
    if (is_known) truly = moved_with(record, point, steel, models::Quaternion(record.true_tool_q_W.data()));
    for (const Vec3& vector : {by_encoders, truly}) row.insert(row.end(), vector.begin(), vector.end());
  }
}

}  // namespace

std::string encode_moment(const Moment& moment, std::span<const models::Pose> links,
                          std::span<const models::Pose> objects) {
  std::vector<double> row{kind_moment};
  append_fields(row, moment);
  append_contacts(row, moment);
  std::string bytes;
  append<double>(bytes, row);
  for (const models::Pose& X : links) append_pose(bytes, X);
  for (const models::Pose& X : objects) append_pose(bytes, X);
  return bytes;
}

std::string encode_history(std::span<const double> rows) {
  const std::size_t moments = rows.size() / field_names().size();
  const std::array head{kind_history, static_cast<double>(moments)};
  std::string bytes;
  append<double>(bytes, head);
  append<double>(bytes, rows);
  return bytes;
}

}  // namespace proxarm::view
