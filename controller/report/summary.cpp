#include "controller/report/summary.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <string_view>

#include "controller/record/flag_words.hpp"
#include "controller/record/setpoint_hash.hpp"
#include "controller/report/apparent_mass.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double shortest_slide_s = 0.1;
constexpr double free_force_N = 1e-3;  // far above rounding (κ times an ulp of q), far below what a hand feels

// Counts durations in bins of 10 ns up to 1 ms, then in bins of 1 % up to 10 s, so that a median over hours needs
// little memory.
class Durations {
 public:
  void add(std::int64_t ns) {
    ++bins_[bin_of(ns)];
    ++count_;
    max_ns_ = std::max(max_ns_, ns);
    total_ns_ += ns;
  }

  // Returns the quantile of `fraction`, µs, at most the longest duration.
  [[nodiscard]] double quantile_us(double fraction) const {
    if (count_ == 0) return 0.0;
    const auto rank = static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      seen += bins_[i];
      if (seen >= rank) return std::min(i < fine ? 0.01 * static_cast<double>(i) + 0.005 : end_us(i), max_us());
    }
    return max_us();
  }
  [[nodiscard]] double max_us() const { return 1e-3 * static_cast<double>(max_ns_); }
  [[nodiscard]] double total_us() const { return 1e-3 * static_cast<double>(total_ns_); }

 private:
  static constexpr std::size_t fine = 100'000, coarse = 926;
  static constexpr double ratio = 1.01;

  static std::size_t bin_of(std::int64_t ns) {
    const auto bin = static_cast<std::size_t>(std::max<std::int64_t>(ns, 0) / 10);
    if (bin < fine) return bin;
    const auto beyond = static_cast<std::size_t>(std::log(1e-6 * static_cast<double>(ns)) / std::log(ratio));
    return fine + std::min(beyond, coarse - 1);
  }
  static double end_us(std::size_t bin) { return 1e3 * std::pow(ratio, static_cast<double>(bin - fine + 1)); }

  std::vector<std::uint32_t> bins_ = std::vector<std::uint32_t>(fine + coarse);
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0, total_ns_ = 0;
};

// Root mean square and maximum of a stream of values.
struct Spread {
  double sum_of_squares = 0.0, max = 0.0;
  std::uint64_t count = 0;

  void add(double value) {
    sum_of_squares += value * value;
    max = std::max(max, std::abs(value));
    ++count;
  }
  [[nodiscard]] std::optional<double> rms() const {
    if (count == 0) return std::nullopt;
    return std::sqrt(sum_of_squares / static_cast<double>(count));
  }
  [[nodiscard]] std::optional<double> largest() const { return count == 0 ? std::nullopt : std::optional(max); }
};

struct Slide {
  double tangential = 0.0, limit = 0.0, length_s = 0.0;
};

// Returns the names of the limit's parameters. A common limit has one name ("limits.leash_m"). A joint's own limit has
// a name for each joint in `joints` ("axis_2: max_speed_rad_per_s"); `names` are the joints' names.
std::vector<std::string> parameter_names(Limit limit, const ActiveLimits::Joints& joints,
                                         const std::vector<std::string>& names) {
  const std::string parameter = limit_parameter(limit);
  constexpr std::string_view of_joints = "drives[].";
  const auto kind = std::find(limits_of_joints.begin(), limits_of_joints.end(), limit);
  if (kind == limits_of_joints.end() || parameter.compare(0, of_joints.size(), of_joints) != 0) return {parameter};
  const unsigned held = joints[static_cast<std::size_t>(kind - limits_of_joints.begin())];
  std::vector<std::string> out;
  for (std::size_t i = 0; i < max_axes; ++i) {
    if ((held & (1u << i)) == 0) continue;
    const std::string joint = i < names.size() ? names[i] : "axis " + std::to_string(i + 1);
    out.push_back(joint + ": " + parameter.substr(of_joints.size()));
  }
  return out;
}

double seconds(std::int64_t ns) { return static_cast<double>(ns) / 1e9; }

bool guarded(const CycleRecord& record) {
  return record.has(RecordFlag::guard_speed) || record.has(RecordFlag::guard_elbow) ||
         record.has(RecordFlag::guard_border) || record.has(RecordFlag::guard_turning);
}

bool limited(const CycleRecord& record) {
  return record.has(RecordFlag::limit_orientation) ||
         std::any_of(limit_flags.begin(), limit_flags.end(),
                     [&](const LimitFlag& flag) { return record.has(flag.flag); });
}

}  // namespace

struct SummaryBuilder::State {
  explicit State(const SummaryConfig& c)
      : config(c),
        apparent(c.period_s),
        felt(c.period_s),
        apparent_turning(c.period_s),
        period_ns(std::llround(1e9 * c.period_s)) {}

  void count(const CycleRecord& record);
  void count_limit(const std::string& parameter, RecordFlag flag, const CycleRecord& record);
  void track(const CycleRecord& record);
  void observe(const CycleRecord& record);
  [[nodiscard]] OscillationWatch::Cycle swing(const CycleRecord& record);
  void follow_changes(const CycleRecord& record);
  void follow_timestep(const CycleRecord& record);
  void take_period(std::int64_t period_ns);
  void penetrate(const CycleRecord& record);
  void middle(const CycleRecord& before, const CycleRecord& now, const CycleRecord& after);
  void turn(const CycleRecord& now);
  void slide(const CycleRecord& now, const Vec3& resistance);

  SummaryConfig config;
  double limits_push_J = 0.0;  // energy that limits have put in and not taken back
  Summary summary;
  SetpointHash hash;
  Durations durations;
  Spread tracking, lagging, contact_force;
  ApparentMass apparent;
  FeltMassCurve felt;
  ApparentMass apparent_turning;         // apparent inertia, from angles and torques
  std::optional<Eigen::Quaterniond> R0;  // orientation at the start of rendering
  double inertia_kg_m2 = 0.0;            // the proxy's inertia in the last record
  OscillationWatch oscillation;
  std::optional<Eigen::Quaterniond> R_k1;  // orientation of the true tool in the last record, if the tool turns
  Vec3 turned_W = Vec3::Zero();            // sum of the true tool's rotations
  Slide sliding;
  double contact_s = 0.0;  // duration of the present contact
  // Times in whole periods, so that sums don't round.
  std::int64_t period_ns, all_ns = 0, rendered_ns = 0, touching_ns = 0, slipping_ns = 0;
  bool changing = false;  // whether the timestep is changing
  std::int64_t asked_ns = 0;
  double mass_kg = 0.0;            // the proxy's mass in the last record
  std::optional<Vec3> start;       // x₀ of the virtual spring
  std::deque<CycleRecord> recent;  // consecutive cycles of rendering, newest last
};

SummaryBuilder::SummaryBuilder(const SummaryConfig& config) : state_(std::make_unique<State>(config)) {}
SummaryBuilder::~SummaryBuilder() = default;
SummaryBuilder::SummaryBuilder(SummaryBuilder&&) noexcept = default;
SummaryBuilder& SummaryBuilder::operator=(SummaryBuilder&&) noexcept = default;

void SummaryBuilder::add(const CycleRecord& record) {
  State& s = *state_;
  s.follow_timestep(record);
  s.count(record);
  const bool follows = !s.recent.empty() && s.recent.back().cycle + 1 == record.cycle;
  if (record.phase != Phase::rendering || !follows) {
    s.recent.clear();
    s.apparent.end_segment();
    s.felt.end_segment();
    s.apparent_turning.end_segment();
    s.oscillation.reset();
    s.contact_s = 0.0;
  }
  if (record.phase != Phase::rendering) return;
  if (!s.start) {
    s.start = vec3(record.proxy_W_m);
    s.summary.rendering_from_s = seconds(record.time_ns);
  }
  s.follow_changes(record);
  s.rendered_ns += s.period_ns;
  s.recent.push_back(record);
  s.penetrate(record);
  if (s.config.passivity) s.observe(record);
  s.track(record);
  const std::size_t n = s.recent.size();
  if (n >= 3) s.middle(s.recent[n - 3], s.recent[n - 2], s.recent[n - 1]);
  const auto kept = static_cast<std::size_t>(std::max(s.config.setpoint_delay_cycles, 2)) + 1;
  if (n > kept) s.recent.pop_front();
}

// Adds to the figures over all phases.
void SummaryBuilder::State::count(const CycleRecord& record) {
  ++summary.cycles;
  all_ns += period_ns;
  hash.add({record.target_counts.data(), std::min<std::size_t>(record.axes, max_axes)});
  durations.add(record.compute_ns);
  if (record.has(RecordFlag::overrun)) ++summary.overruns;
  if (record.phase != Phase::rendering) return;
  if (record.has(RecordFlag::sample_held)) ++summary.held_samples;
  if (record.has(RecordFlag::unresolved)) ++summary.unresolved_steps;
  if (record.has(RecordFlag::hands_off)) summary.hands_off_s += 1e-9 * static_cast<double>(record.period_ns);
  if (limited(record)) ++summary.limited_cycles;
  if (guarded(record)) ++summary.guarded_cycles;
  limits_push_J = std::max(0.0, limits_push_J + record.limits_work_J - summary.limits_work_J);
  summary.limits_push_J = std::max(summary.limits_push_J, limits_push_J);
  summary.limits_work_J = record.limits_work_J;
  if (record.has(RecordFlag::limit_orientation)) count_limit("orientation", RecordFlag::limit_orientation, record);
  for (const LimitFlag& flag : limit_flags) {
    if (!record.has(flag.flag)) continue;
    for (const std::string& name : parameter_names(flag.limit, record.limited_joints, config.axis_names)) {
      count_limit(name, flag.flag, record);
    }
  }
  if (record.has(RecordFlag::truth)) summary.from_truth = true;
}

void SummaryBuilder::State::count_limit(const std::string& parameter, RecordFlag flag, const CycleRecord& record) {
  LimitSummary& limit = summary.active_limits[parameter];
  if (limit.cycles == 0) limit = {.first_s = seconds(record.time_ns), .words = words_of(flag)};
  ++limit.cycles;
  limit.time_s += seconds(period_ns);
}

// Follows a mass, damping or spring that is set during rendering, or before its first cycle: it counts from then on,
// and the last mass is the wanted one.
void SummaryBuilder::State::follow_changes(const CycleRecord& record) {
  if (record.tool_mass_kg > 0.0 && config.handle_mass_kg > 0.0) config.handle_mass_kg = record.tool_mass_kg;
  if (record.proxy_mass_kg != mass_kg) {
    const double felt_kg = record.proxy_mass_kg + config.handle_mass_kg;
    constexpr double rounding_kg = 1e-9;  // of a mass below a tonne, with digits of a file
    const bool set_before = record.proxy_mass_kg > 0.0 && std::abs(felt_kg - config.wanted_mass_kg) > rounding_kg;
    if (mass_kg > 0.0 || set_before) {
      config.wanted_mass_kg = felt_kg;
      apparent = ApparentMass(config.period_s);
      felt = FeltMassCurve(config.period_s);
    }
    mass_kg = record.proxy_mass_kg;
  }
  if (mass_kg > 0.0) config.damping_Ns_per_m = record.proxy_damping_Ns_per_m;
  if (inertia_kg_m2 > 0.0 && record.proxy_inertia_kg_m2 != inertia_kg_m2) {
    config.wanted_inertia_kg_m2 = record.proxy_inertia_kg_m2;
    apparent_turning = ApparentMass(config.period_s);
  }
  inertia_kg_m2 = record.proxy_inertia_kg_m2;
}

// Follows changes of the timestep. Nothing is rendered while the timestep changes; figures then go on with the new
// timestep. The apparent mass is measured anew after each change.
void SummaryBuilder::State::follow_timestep(const CycleRecord& record) {
  const bool was_changing = changing;
  changing = record.has(RecordFlag::timestep);
  if (changing && !was_changing) {
    summary.timesteps.push_back({seconds(record.time_ns), config.period_s, config.period_s, 0.0, ""});
    asked_ns = record.time_ns;
  }
  if (changing || was_changing) {
    TimestepSummary& last = summary.timesteps.back();
    last.paused_s = seconds(record.time_ns - asked_ns);
    if (record.refused_period_ns > 0) {
      last.to_s = seconds(record.refused_period_ns);
      last.refused = refusal_text(record.timestep_refusal, config.axis_names);
    } else if (!changing && last.refused.empty()) {
      last.to_s = seconds(record.period_ns);
    }
  }
  if (record.period_ns > 0 && record.period_ns != period_ns) take_period(record.period_ns);
}

void SummaryBuilder::State::take_period(std::int64_t ns) {
  period_ns = ns;
  config.period_s = seconds(ns);
  config.setpoint_delay_cycles = 2 + static_cast<int>(std::lround(config.setpoint_filter_s / config.period_s));
  apparent = apparent_turning = ApparentMass(config.period_s);
  felt = FeltMassCurve(config.period_s);
}

void SummaryBuilder::State::observe(const CycleRecord& record) {
  constexpr double noticeable_Ns_per_m = 1.0;
  if (!summary.passivity) summary.passivity.emplace();
  PassivitySummary& p = *summary.passivity;
  p.energies_J = record.energies_J;
  p.oscillation_max_m_per_s = std::max(p.oscillation_max_m_per_s, record.oscillation_m_per_s);
  p.added_damping_max_Ns_per_m = std::max(p.added_damping_max_Ns_per_m, record.added_damping_Ns_per_m);
  if (record.added_damping_Ns_per_m >= noticeable_Ns_per_m) p.added_time_s += config.period_s;
  oscillation.add(seconds(record.time_ns), config.period_s, swing(record));
  if (!record.has(RecordFlag::oscillation)) return;
  p.oscillating_time_s += config.period_s;
  p.felt_damping_min_Ns_per_m = std::min(p.felt_damping_min_Ns_per_m, record.felt_damping_Ns_per_m);
}

// Returns the tool's motion for the oscillation watch. It comes from the simulation's true state, if recorded.
// Otherwise it comes from the controller's estimate of the links if the tool turns, else from the encoders.
OscillationWatch::Cycle SummaryBuilder::State::swing(const CycleRecord& record) {
  const bool truth = record.has(RecordFlag::truth);
  OscillationWatch::Cycle cycle{.oscillates = record.has(RecordFlag::oscillation),
                                .lasts = record.has(RecordFlag::oscillation_lasts),
                                .tool_W = vec3(truth ? record.true_tool_W_m : record.tool_W_m)};
  if (!(record.proxy_inertia_kg_m2 > 0.0 && record.proxy_mass_kg > 0.0)) return cycle;
  cycle.turns = true;
  cycle.gyration_m2 = record.proxy_inertia_kg_m2 / record.proxy_mass_kg;
  if (!truth) {
    cycle.tool_W = vec3(record.links_W_m);
    cycle.turned_W = vec3(record.links_W_rad);
    return cycle;
  }
  const Eigen::Quaterniond R(record.true_tool_q_W.data());
  if (R_k1) turned_W += models::rotation_vector(R * R_k1->conjugate());
  R_k1 = R;
  cycle.turned_W = turned_W;
  return cycle;
}

void SummaryBuilder::State::penetrate(const CycleRecord& record) {
  if (record.contact == ContactPhase::free) {
    contact_s = 0.0;
    summary.drag_force_max_N = std::max(summary.drag_force_max_N, vec3(record.contact_force_W_N).norm());
  } else {
    if (contact_s == 0.0) ++summary.contacts;
    contact_s += config.period_s;
    touching_ns += period_ns;
    if (record.contact == ContactPhase::slip) slipping_ns += period_ns;
    const double pull = -vec3(record.contacts[0].normal_W).dot(vec3(record.contact_force_W_N));
    // With several contacts, only the sum of their forces is known.
    if (record.contact_count <= 1) summary.pulling_force_max_N = std::max(summary.pulling_force_max_N, pull);
  }
  summary.penetration_max_m = std::max(summary.penetration_max_m, -record.proxy_clearance_m);
  if (std::isfinite(record.proxy_clearance_m)) {
    summary.proxy_clearance_min_m =
        std::min(summary.proxy_clearance_min_m.value_or(record.proxy_clearance_m), record.proxy_clearance_m);
  }
  const double depth = -record.tool_clearance_m;
  summary.tool_penetration_max_m = std::max(summary.tool_penetration_max_m, depth);
  if (contact_s > 0.0 && contact_s <= config.touch_s) {
    summary.tool_penetration_touch_max_m = std::max(summary.tool_penetration_touch_max_m, depth);
  } else if (record.contact == ContactPhase::slip) {
    summary.tool_penetration_sliding_max_m = std::max(summary.tool_penetration_sliding_max_m, depth);
  }
}

void SummaryBuilder::State::track(const CycleRecord& record) {
  const Triple& tool = record.has(RecordFlag::truth) ? record.true_tool_W_m : record.tool_W_m;
  if (recent.size() >= 2) lagging.add((vec3(tool) - vec3(recent[recent.size() - 2].proxy_W_m)).norm());
  const auto delay = static_cast<std::size_t>(std::max(config.setpoint_delay_cycles, 0));
  if (recent.size() <= delay) return;
  const CycleRecord& due = recent[recent.size() - 1 - delay];
  tracking.add((vec3(tool) - vec3(due.proxy_W_m)).norm());
}

// Adds to the figures that need derivatives: central differences at `now`, the record before the last.
void SummaryBuilder::State::middle(const CycleRecord& before, const CycleRecord& now, const CycleRecord& after) {
  const double T = config.period_s, m = config.handle_mass_kg, M = config.wanted_mass_kg, B = config.damping_Ns_per_m;
  const bool truth = before.has(RecordFlag::truth) && now.has(RecordFlag::truth) && after.has(RecordFlag::truth);
  const auto tool = [truth](const CycleRecord& r) { return vec3(truth ? r.true_tool_W_m : r.tool_W_m); };
  const Vec3 x = tool(now);
  const Vec3 a = (tool(after) - 2.0 * x + tool(before)) / (T * T);
  const Vec3 hand = truth ? vec3(now.hand_force_W_N) : Vec3(vec3(now.force_W_N) + m * a);

  const Vec3 spring = config.spring_N_per_m * (x - *start);
  if (now.contact == ContactPhase::free) {
    // The world may act without a contact: by a field of friction or a soft layer. If a limit acts, the motion isn't
    // that of the mass.
    if (vec3(now.contact_force_W_N).norm() < free_force_N && !limited(now) && !now.has(RecordFlag::ramp_in) &&
        !now.has(RecordFlag::hands_off)) {
      felt.add(hand - spring, x);
      if (truth && now.proxy_inertia_kg_m2 > 0.0) turn(now);
      return apparent.add(hand - spring, x);
    }
  }
  apparent.end_segment();
  felt.end_segment();
  apparent_turning.end_segment();
  if (now.contact == ContactPhase::free) return;
  // `contact_s` belongs to `after`: it is one period more than at `now`, unless the contact ends at `after`.
  const bool established = after.contact != ContactPhase::free && contact_s - T > config.touch_s;
  if (!established) return;
  // (24): M_p ∇²q(k)/T² + B ∇q(k)/T = h(k) + f(k). The differences ∇ end at q(k).
  const std::size_t i = recent.size() - 2;
  const Vec3 q = vec3(now.proxy_W_m), q1 = vec3(before.proxy_W_m);
  const Vec3 q2 = i >= 2 ? vec3(recent[i - 2].proxy_W_m) : q1;
  const Vec3 n = vec3(now.contacts[0].normal_W);
  if (i >= 2) {
    const Vec3 a_q = (q - 2.0 * q1 + q2) / (T * T), v_q = (q - q1) / T;
    const Vec3 pull_back = config.spring_N_per_m * (q - *start);
    const Vec3 resistance = hand - m * a - (M - m) * a_q - B * v_q - pull_back;
    contact_force.add(n.dot(vec3(now.contact_force_W_N)) + n.dot(resistance));
    if (contact_s - T > config.settle_s) slide(now, resistance);
  }
}

void SummaryBuilder::State::turn(const CycleRecord& now) {
  const auto& q = now.true_tool_q_W;
  const Eigen::Quaterniond R(q[3], q[0], q[1], q[2]);
  if (!R0) R0 = R;
  const Eigen::AngleAxisd turned(R * R0->conjugate());
  const Vec3 phi = turned.angle() * turned.axis();
  apparent_turning.add(vec3(now.hand_torque_W_Nm) - config.turning_spring_Nm_per_rad * phi, phi);
}

void SummaryBuilder::State::slide(const CycleRecord& now, const Vec3& resistance) {
  if (now.contact != ContactPhase::slip || !(now.contacts[0].friction > 0.0) || now.contact_count > 1) return;
  if (limited(now)) return;  // a limit's force isn't friction
  const Vec3 n = vec3(now.contacts[0].normal_W);
  const Vec3 f = vec3(now.contact_force_W_N);
  const Vec3 along = n.dot(f) * n - f;
  if (!(along.norm() > 0.0)) return;
  sliding.tangential += resistance.dot(along.normalized());
  sliding.limit += -now.contacts[0].friction * n.dot(resistance);
  sliding.length_s += config.period_s;
}

Oscillation SummaryBuilder::oscillation() const { return state_->oscillation.present(); }

Summary SummaryBuilder::finish() {
  State& s = *state_;
  s.apparent.end_segment();
  s.apparent_turning.end_segment();
  Summary summary = s.summary;
  summary.simulated_time_s = seconds(s.all_ns);
  summary.rendered_time_s = seconds(s.rendered_ns);
  summary.contact_time_s = seconds(s.touching_ns);
  summary.sliding_time_s = seconds(s.slipping_ns);
  summary.compute_us = {s.durations.quantile_us(0.5), s.durations.quantile_us(0.99), s.durations.max_us(),
                        s.durations.total_us()};
  summary.tracking_rms_m = s.tracking.rms();
  summary.tracking_max_m = s.tracking.largest();
  summary.tracking_lag_rms_m = s.lagging.rms();
  summary.tracking_lag_max_m = s.lagging.largest();
  summary.tracking_delay_s = (s.config.setpoint_delay_cycles - 1) * s.config.period_s;
  summary.felt_mass = s.felt.points();
  for (std::size_t axis = 0; axis < 3; ++axis) summary.felt_mass_along[axis] = s.felt.points_along(axis);
  if (const auto apparent = s.apparent.estimate()) {
    summary.apparent_mass_kg = apparent->mass_kg;
    summary.apparent_damping_Ns_per_m = apparent->damping_Ns_per_m;
  }
  if (const auto apparent = s.apparent_turning.estimate()) {
    summary.apparent_inertia_kg_m2 = apparent->mass_kg;
    summary.apparent_turning_damping_Nms_per_rad = apparent->damping_Ns_per_m;
  }
  summary.wanted_inertia_kg_m2 = s.config.wanted_inertia_kg_m2;
  summary.contact_force_error_N = s.contact_force.rms();
  summary.contact_force_error_max_N = s.contact_force.largest();
  if (s.sliding.length_s >= shortest_slide_s && s.sliding.limit > 0.0) {
    summary.friction_ratio_error = s.sliding.tangential / s.sliding.limit - 1.0;
  }
  if (s.config.passivity) summary.oscillation = s.oscillation.longest();
  summary.setpoint_sha256 = s.hash.hex();
  summary.wanted_mass_kg = s.config.wanted_mass_kg;
  summary.lookahead_s = s.config.lookahead_s;
  summary.gear_damping_per_s = s.config.gear_damping_per_s;
  return summary;
}

}  // namespace proxarm::controller
