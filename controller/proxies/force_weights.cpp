#include "controller/proxies/force_weights.hpp"

namespace proxarm::controller {

template <int N>
auto ForceWeights<N>::rule(double w0, std::array<double, 3> w, const AdmittanceConfig& config) noexcept -> Rule {
  const double M = config.mass_kg, B = config.damping_Ns_per_m, K_v = config.spring_N_per_m, T = config.period_s;
  const double inertia = M / (w0 * T * T);
  Rule rule{.w0 = w0, .w = w, .kappa = inertia + 1.5 * B / T + K_v};
  rule.of_move = (inertia + 0.5 * B / T) / rule.kappa;
  rule.of_reference = K_v / rule.kappa;
  rule.of_force = 1.0 / (w0 * rule.kappa);
  return rule;
}

template <int N>
void ForceWeights<N>::prepare(const AdmittanceConfig& config) noexcept {
  surface_ = rule(8.0 / 27.0, {12.0 / 27.0, 6.0 / 27.0, 1.0 / 27.0}, config);
  medium_ = rule(125.0 / 216.0, {75.0 / 216.0, 15.0 / 216.0, 1.0 / 216.0}, config);
  start_ = rule(1.0 / 6.0, {5.0 / 6.0, 0.0, 0.0}, config);
  mass_kg_ = config.mass_kg;
  damping_Ns_per_m_ = config.damping_Ns_per_m;
  spring_N_per_m_ = config.spring_N_per_m;
  period_s_ = config.period_s;
  undamped_ = config.damping_Ns_per_m == 0.0 && config.spring_N_per_m == 0.0;
}

template <int N>
void ForceWeights<N>::start(const ProxyStart<N>& start, const ProxySolver<N>& solve) noexcept {
  contacts_ = {};
  contacts_.known = !start.contact_established;
  mode_ = !undamped_ ? Mode::surface : start.contact_established ? Mode::starting : Mode::free;
  restart_steps_left_ = 0;
  parabolas_left_ = undamped_ ? 0 : 1;
  v_ = start.v;
  first_order_steps_ = 0;
  F_.fill(V::Zero());
  if (mode_ == Mode::starting) F_[0] = mass_kg_ * start.a;
  forces_known_ = 0;
  free_since_start_ = mode_ == Mode::free;
  cut_ = lets_go_ = steady_ = false;
  has_media_ = solve.g().has_media();
  media_ = has_media_ ? solve.g().media_at(start.q) : 0;
}

// Computes a step, with Störmer's correction of h if h(k−2) is known. After a start in free motion, other corrections
// are needed: start() sets q(k−2) without the term −T³ȧ/6 of its Taylor series, because ȧ is unknown. So the first step
// ends T²δ/(6M) short, δ = h(k+1) − h(k). The correction of the second step adds this distance. The correction of the
// third step removes the velocity that this distance would otherwise add.
template <int N>
ProxyFault ForceWeights<N>::step(const ProxyRule& of_26, const ProxyHistory<N>& past, const V& h_k, const V& q_ref,
                                 const ProxySolver<N>& solve, ProxyTrial<N>& out) noexcept {
  V h = h_k;
  if (forces_known_ == 3) [[likely]] {
    h = (13.0 / 12.0) * h_k + (1.0 / 12.0) * (h_k2_ - 2.0 * h_k1_);
  } else if (free_since_start_ && forces_known_ == 1) {
    h = (4.0 * h_k - h_k1_) / 3.0;
  } else if (free_since_start_ && forces_known_ == 2) {
    h = (13.0 * h_k - 4.0 * h_k1_ + 3.0 * h_k2_) / 12.0;
  }
  const bool owes = lets_go_;
  if (owes) h += onset_;
  const ProxyFault fault = take_step({of_26, past, h, h_k, q_ref, solve}, out);
  if (fault != ProxyFault::none) return fault;
  if (owes) lets_go_ = false;
  h_k2_ = h_k1_;
  h_k1_ = h_k;
  if (forces_known_ < 3) ++forces_known_;
  return ProxyFault::none;
}

template <int N>
ProxyFault ForceWeights<N>::take_step(const Given& given, ProxyTrial<N>& out) noexcept {
  const bool even = given.past.period_k1_s == period_s_;
  ProxyFault fault = ProxyFault::none;
  bool event = true;
  if (even && parabolas_left_ > 0) {
    fault = parabola(given, out, event);
  } else if (even && mode_ != Mode::free && restart_steps_left_ == 0) {
    if (contacts_.held || steady_) {
      const Steady done = steady_step(given, out, fault);
      if (done == Steady::yes || fault != ProxyFault::none) return fault;
      if (done == Steady::event) {
        take_first_order(given, out);
        return fault;
      }
    }
    fault = weighted(given, out, event);
  }
  return event && fault == ProxyFault::none ? first_order(given, out) : fault;
}

// Computes a step of (26) while the proxy rests or the world's force is constant, since weights then change nothing.
// Returns whether the step may be taken.
template <int N>
auto ForceWeights<N>::steady_step(const Given& given, ProxyTrial<N>& out, ProxyFault& fault) noexcept -> Steady {
  fault = step_of_26(given.of_26, given.past, given.h, given.q_ref, period_s_, given.solve, out);
  if (fault != ProxyFault::none) return Steady::event;
  cut_ = false;
  if (!as_before(given, out)) return Steady::event;
  if (contacts_.held) return Steady::yes;
  steady_ = as_much(out.f, F_[0]);
  return steady_ ? Steady::yes : Steady::no;
}

// Computes a step with weighted forces, by the equations of the header. `event`: the step contains an event and must
// not be taken.
template <int N>
ProxyFault ForceWeights<N>::weighted(const Given& given, ProxyTrial<N>& out, bool& event) noexcept {
  const ProxyHistory<N>& past = given.past;
  const V& q_k1 = past.q_k1;
  const Rule& rule = mode_ == Mode::surface ? surface_ : mode_ == Mode::medium ? medium_ : start_;
  const V F = mode_ == Mode::starting ? V(rule.w[0] * (F_[0] - given.h_k))
                                      : V(rule.w[0] * F_[0] + rule.w[1] * F_[1] + rule.w[2] * F_[2]);
  const V p_hat_of_26 = 2.0 * q_k1 - past.q_k2 + given.of_26.compliance * given.h;
  out.kappa = rule.kappa;
  if (undamped_) {
    out.p_hat = p_hat_of_26 + given.of_26.compliance * F;
  } else {
    out.p_hat = q_k1 + (rule.of_move * (q_k1 - past.q_k2) + rule.of_reference * (given.q_ref - q_k1) +
                        rule.of_force * (given.h + F));
  }
  models::GeometricAlgorithm<N>& g = given.solve.g();
  const std::uint64_t unresolved = g.unresolved_steps();
  ProxyFault fault = given.solve(out, q_k1, period_s_);
  if (fault != ProxyFault::none) return fault;
  event = g.unresolved_steps() != unresolved || !as_before(given, out);
  if (has_media_ && !event && g.media_at(out.q) != media_) {
    event = true;
    if (crosses(given, out)) return cut(given, out, event);
  }
  if (!event && (contacts_.slips || contacts_.acts || media_ != 0)) {
    // Square of the smallest angle that counts as a turn: 40 times the rounding error of (both − along²)/both.
    constexpr double least_angle2 = 1e-14;
    const V way = out.q - q_k1, before = q_k1 - past.q_k2;
    const double along = way.dot(before), both = way.squaredNorm() * before.squaredNorm();
    // Friction and media never push a proxy on, so weighted forces of former steps mustn't reverse a proxy's motion.
    event = along < 0.0;
    const bool turns = given.solve.timed() || media_ != 0 || both - along * along > least_angle2 * both;
    if (!event && turns && mode_ != Mode::medium && !contacts_.held) {
      ContactSet now = contacts_of(given, out, q_k1);
      fault = from_ahead(given, unresolved, out, now, event);
    }
  }
  if (!event && fault == ProxyFault::none) take_weighted(given, p_hat_of_26, out);
  return fault;
}

// Whether the contacts equal those of the last step, in the same order.
template <int N>
bool ForceWeights<N>::as_before(const Given& given, const ProxyTrial<N>& out) const noexcept {
  const auto contacts = given.solve.g().contacts();
  if (contacts_.known && !contacts_.limited && contacts.size() == contacts_.count) [[likely]] {
    bool same_keys = true;
    for (std::size_t i = 0; i < contacts_.count; ++i) {
      const auto& key = contacts_.keys[i];
      same_keys = same_keys && key.object == contacts[i].object && key.feature == contacts[i].feature &&
                  key.slips == contacts[i].slips;
    }
    const bool held = out.q == given.past.q_k1 && out.p_hat != given.past.q_k1;
    const bool acts = contacts_.count == 0 && media_ == 0 && out.q != out.p_hat;
    if (same_keys && held == contacts_.held && acts == contacts_.acts) return true;
  }
  const ContactSet now = contacts_of(given, out, given.past.q_k1);
  return !now.limited && (!contacts_.known || same(contacts_, now));
}

template <int N>
void ForceWeights<N>::take_weighted(const Given& given, const V& p_hat_of_26, ProxyTrial<N>& out) noexcept {
  const ProxyHistory<N>& past = given.past;
  if (!contacts_.known) contacts_ = contacts_of(given, out, past.q_k1);
  if (mode_ == Mode::starting) {
    // F is known now and one period ago. A straight line through both values gives F two periods ago.
    F_[1] = F_[0] - given.h_k;
    F_[2] = 2.0 * F_[1] - out.f;
    mode_ = Mode::surface;
  } else {
    F_[2] = F_[1];
    F_[1] = F_[0];
  }
  F_[0] = out.f;
  cut_ = false;
  if (undamped_) {
    // The end of a contact is an event, so this branch is reached only at the end of damping by the world.
    if (contacts_.count == 0 && out.q == out.p_hat && F_[1] == V::Zero() && F_[2] == V::Zero()) mode_ = Mode::free;
    steady_ = !has_media_ && as_much(F_[0], F_[1]) && as_much(F_[0], F_[2]);
    report(given, p_hat_of_26, out);
    return;
  }
  steady_ = false;
  F_[0] += own_force(out.q, given.q_ref, (3.0 * (out.q - past.q_k1) - (past.q_k1 - past.q_k2)) / (2.0 * period_s_));
  report(given, p_hat_of_26, out);
}

// Sets p̂, κ and f of `out` so that f, the world's part of the proxy's force M∇²q/T², follows from p̂ and κ by (25a).
template <int N>
void ForceWeights<N>::report(const Given& given, const V& p_hat_of_26, ProxyTrial<N>& out) const noexcept {
  const ProxyHistory<N>& past = given.past;
  out.kappa = given.of_26.kappa;
  if (media_ == 0 && contacts_.count == 0 && !contacts_.acts) {
    out.p_hat = out.q;
    out.f.setZero();
  } else if (undamped_) {
    out.p_hat = p_hat_of_26;
    out.f = out.kappa * (out.q - out.p_hat);
  } else {
    const V bend = (out.q - past.q_k1) - (past.q_k1 - past.q_k2), v = (out.q - past.q_k2) / (2.0 * period_s_);
    out.f = mass_kg_ / (period_s_ * period_s_) * bend - given.h - own_force(past.q_k1, given.q_ref, v);
    out.p_hat = out.q - out.f / out.kappa;
  }
}

// Computes the step from q̃. On entry `out` and `now` contain the step from q₁. An event is found if the two steps
// don't have the same contacts, each from the same side: q̃ may be beyond a two-sided wall. `unresolved`: 𝒢's count of
// unresolved steps before this step.
template <int N>
ProxyFault ForceWeights<N>::from_ahead(const Given& given, std::uint64_t unresolved, ProxyTrial<N>& out,
                                       ContactSet& now, bool& event) noexcept {
  models::GeometricAlgorithm<N>& g = given.solve.g();
  const double law_period_s = 2.0 / 3.0 * period_s_;
  const V& q_k1 = given.past.q_k1;
  const V q_tilde = q_k1 + (1.0 / 3.0) * (q_k1 - given.past.q_k2), from_q1 = out.q;
  const ContactSet contacts_from_q1 = now;
  std::array<V, max_contacts> normals;
  const auto held_from_q1 = g.contacts();
  for (std::size_t i = 0; i < now.count; ++i) normals[i] = held_from_q1[i].normal;

  const ProxyFault fault = given.solve(out, q_tilde, law_period_s);
  if (fault != ProxyFault::none) return fault;
  now = contacts_of(given, out, q_tilde);
  event = g.unresolved_steps() != unresolved || !same(contacts_from_q1, now) ||
          !same_sides(contacts_from_q1, normals, g.contacts());
  if (event) return ProxyFault::none;

  // q̃ may be behind a mesh, where another object has the same contacts, and the proxy would then go on behind the
  // mesh. So if the step from q̃ ends elsewhere than the step from q₁, by more than a thousandth of the motion, its end
  // must be reachable from q₁.
  if (!((out.q - from_q1).norm() > 1e-3 * (from_q1 - q_k1).norm())) return ProxyFault::none;
  event = !in_reach(given, out);
  if (event) return ProxyFault::none;
  return given.solve(out, q_tilde, law_period_s);  // repeated so that 𝒢 reports the contacts of this step
}

// Whether the proxy can get from q₁ to out.q. κ is so large that only obstacles matter, not media.
template <int N>
bool ForceWeights<N>::in_reach(const Given& given, const ProxyTrial<N>& out) noexcept {
  ProxyTrial<N> way{.kappa = 1e15 * out.kappa, .p_hat = out.q, .q = out.q, .f = out.f};
  return given.solve(way, given.past.q_k1, period_s_) == ProxyFault::none &&
         (way.q - out.q).norm() <= 1e-9 * (1.0 + out.q.template lpNorm<1>());
}

// Computes a step by (26), for free motion, an event or the steps soon after an event.
template <int N>
ProxyFault ForceWeights<N>::first_order(const Given& given, ProxyTrial<N>& out) noexcept {
  const ProxyFault fault = step_of_26(given.of_26, given.past, given.h, given.q_ref, period_s_, given.solve, out);
  if (fault != ProxyFault::none) return fault;
  models::GeometricAlgorithm<N>& g = given.solve.g();
  const bool free = mode_ == Mode::free && undamped_ && out.q == out.p_hat && g.contacts().empty();
  if (!has_media_ || g.media_at(out.q) == media_) {
    if (free) {
      cut_ = false;
      contacts_.known = true;
      return ProxyFault::none;
    }
  } else if (crosses(given, out)) {
    bool event = false;
    const ProxyFault cut_fault = cut(given, out, event);
    if (cut_fault != ProxyFault::none || !event) return cut_fault;
    const ProxyFault again = step_of_26(given.of_26, given.past, given.h, given.q_ref, period_s_, given.solve, out);
    if (again != ProxyFault::none) return again;
  }
  take_first_order(given, out);
  return ProxyFault::none;
}

template <int N>
void ForceWeights<N>::take_first_order(const Given& given, ProxyTrial<N>& out) noexcept {
  const V& q_k1 = given.past.q_k1;
  if (has_media_) media_ = given.solve.g().media_at(out.q);
  const ContactSet now = contacts_of(given, out, q_k1);
  const bool impact = contacts_.known && gained(contacts_, now);
  restart_steps_left_ = std::max({impact ? 2 : 0, restart_steps_left_ - 1, now.limited ? 1 : 0});
  parabolas_left_ = 0;
  if (contacts_.held && !impact && (now.slips || now.acts)) look_for_onset(given, out);
  contacts_ = now;
  V F = out.f;
  if (!undamped_) F += own_force(out.q, given.q_ref, (out.q - q_k1) / period_s_);
  steady_ = undamped_ && !has_media_ && (now.count > 0 || now.acts) && as_much(F, F_[0]);
  F_.fill(F);
  if (!undamped_ || now.count > 0 || now.acts) {
    mode_ = Mode::surface;
  } else {
    mode_ = media_ != 0 ? Mode::medium : Mode::free;
  }
  if (mode_ != Mode::free) free_since_start_ = false;
  cut_ = false;
  ++first_order_steps_;
}

// If friction has released the proxy, computes onset_ from θ of the header. Changes of h at right angles to the slide
// are neglected.
template <int N>
void ForceWeights<N>::look_for_onset(const Given& given, const ProxyTrial<N>& out) noexcept {
  const V& q_k1 = given.past.q_k1;
  const V left_over = (out.q - q_k1) / given.of_26.compliance;
  const double a = left_over.norm();
  if (q_k1 != given.past.q_k2 || forces_known_ == 0 || !(a > 0.0)) return;
  const double growth = (given.h_k - h_k1_).dot(left_over) / a;
  constexpr double rounding = 1e-6;               // tolerance of θ ≤ 1, for a release right after a sample
  if (!(a <= (1.0 + rounding) * growth)) return;  // h has jumped, or the world caused the release
  const double share = a / growth;
  onset_ = (0.5 * growth * (share * (share - 1.0) + 1.0 / 3.0) / a) * left_over;
  lets_go_ = true;
}

// Whether the step in `out`, which leads into other media, can be cut at the media's border. A step with contacts
// can't be cut: it is an event like any other.
template <int N>
bool ForceWeights<N>::crosses(const Given& given, const ProxyTrial<N>& out) const noexcept {
  return undamped_ && given.past.period_k1_s == period_s_ && (mode_ == Mode::free || mode_ == Mode::medium) &&
         restart_steps_left_ == 0 && given.solve.g().contacts().empty() && out.q != given.past.q_k1;
}

// Cuts the step in `out` at the border of a medium. With the velocity v₁ at t_k, constant acceleration moves the proxy
// along q₁ + θT v₁ + θ²(q − q₁ − T v₁). The border is searched on the straight line from q₁ to q, which is free of
// objects. Beyond the border, the proxy follows another parabola in the other media. `event`: this parabola meets an
// object or another border.
template <int N>
ProxyFault ForceWeights<N>::cut(const Given& given, ProxyTrial<N>& out, bool& event) noexcept {
  constexpr int halvings = 40;
  constexpr double least_share = 1e-6;  // smallest part of T after the border for which a parabola is computed
  const double T = period_s_, M = mass_kg_;
  const ProxyHistory<N>& past = given.past;
  models::GeometricAlgorithm<N>& g = given.solve.g();
  const V now = mode_ == Mode::medium ? V(1.5 * F_[0] - 0.5 * F_[1]) : V(V::Zero());  // F at t_k
  const V v = (past.q_k1 - past.q_k2) / T + (0.5 * T / M) * (given.h_k + now);
  const V way = out.q - past.q_k1, bend = way - T * v;
  const double along = T * v.dot(way) / way.squaredNorm(), bent = bend.dot(way) / way.squaredNorm();
  double low = 0.0, high = 1.0;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high), share = middle * (along + middle * bent);
    (g.media_at(past.q_k1 + share * way) == media_ ? low : high) = middle;
  }
  const V q_border = past.q_k1 + high * (along + high * bent) * way;
  V v_end = v + (2.0 * high / T) * bend;
  if (const double rest_s = (1.0 - high) * T; rest_s > least_share * T) {
    out.kappa = 2.0 * M / (rest_s * rest_s);
    out.p_hat = q_border + rest_s * v_end + (0.5 * rest_s * rest_s / M) * given.h_k;
    const ProxyFault fault = given.solve(out, q_border, rest_s);
    if (fault != ProxyFault::none) return fault;
    event = !g.contacts().empty() || g.media_at(out.q) != g.media_at(q_border);
    if (event) return ProxyFault::none;
    v_end = (2.0 / rest_s) * (out.q - q_border) - v_end;
  }
  event = false;
  media_ = g.media_at(out.q);
  mode_ = media_ != 0 ? Mode::medium : Mode::free;
  contacts_ = {};
  free_since_start_ = false;
  parabolas_left_ = 2;
  steady_ = false;
  v_ = v_end;
  F_.fill(V::Zero());
  cut_ = true;
  came_from_ = out.q - T * v_end + (0.5 * T * T / M) * given.h_k;
  ++first_order_steps_;
  report(given, 2.0 * given.past.q_k1 - given.past.q_k2 + given.of_26.compliance * given.h, out);
  return ProxyFault::none;
}

// Computes one step of constant acceleration, with the force of a velocity law in the middle of the step:
//   q = q₁ + T v₁ + T²(h + F)/(2M)   gives   κ = 2M/T² + B/T + K_v,   p̂ = q₁ + [2Mv₁/T + K_v(q_ref − q₁) + h]/κ
// If B or K_v isn't zero, this is the first step of a motion. Otherwise this step follows a medium's border; the
// velocity becomes v = v₁ + T(h + F)/M. After the second step F and its slope are known, and the history is set as if
// the motion had crossed no border:
//   q(k−2) = q − Tv + ½T²a − T³ȧ/6,   Ma = h + F at t_{k+1}
template <int N>
ProxyFault ForceWeights<N>::parabola(const Given& given, ProxyTrial<N>& out, bool& event) noexcept {
  const double T = period_s_, M = mass_kg_;
  const V& q_k1 = given.past.q_k1;
  models::GeometricAlgorithm<N>& g = given.solve.g();
  out.kappa = 2.0 * M / (T * T) + damping_Ns_per_m_ / T + spring_N_per_m_;
  out.p_hat = q_k1 + ((2.0 * M / T) * v_ + spring_N_per_m_ * (given.q_ref - q_k1) + given.h_k) / out.kappa;
  const ProxyFault fault = given.solve(out, q_k1, T);
  if (fault != ProxyFault::none) return fault;
  event = !g.contacts().empty() || media_at(given, out.q) != media_ || (undamped_ && out.q == q_k1);
  if (event) return ProxyFault::none;
  const V p_hat_of_26 = 2.0 * q_k1 - given.past.q_k2 + given.of_26.compliance * given.h;
  ++first_order_steps_;
  if (!undamped_) {
    contacts_ = contacts_of(given, out, q_k1);
    F_.fill(out.f + own_force(out.q, given.q_ref, (out.q - q_k1) / T));
    mode_ = Mode::surface;
    parabolas_left_ = 0;
    cut_ = false;
    report(given, p_hat_of_26, out);
    return ProxyFault::none;
  }
  F_[1] = F_[0];
  F_[0] = out.f;
  v_ += (T / M) * (given.h_k + out.f);
  --parabolas_left_;
  cut_ = true;
  came_from_ = out.q - T * v_;
  if (parabolas_left_ > 0) {
    came_from_ += (0.5 * T * T / M) * (given.h_k + out.f);
  } else {
    const V slope = F_[0] - F_[1], h_slope = given.h_k - h_k1_;  // change per period
    F_[2] = F_[1] - slope;
    const V force = given.h_k + h_slope + F_[0] + 0.5 * slope;
    came_from_ += (T * T / M) * (0.5 * force - (slope + h_slope) / 6.0);
  }
  report(given, p_hat_of_26, out);
  return ProxyFault::none;
}

template <int N>
auto ForceWeights<N>::contacts_of(const Given& given, const ProxyTrial<N>& out, const V& q_previous) const noexcept
    -> ContactSet {
  const auto contacts = given.solve.g().contacts();
  ContactSet set;
  set.held = out.q == q_previous && out.p_hat != q_previous;
  set.acts = contacts.empty() && media_ == 0 && out.q != out.p_hat;
  set.overflow = contacts.size() > max_contacts;
  set.count = std::min(contacts.size(), max_contacts);
  for (std::size_t i = 0; i < set.count; ++i) {
    set.keys[i] = {contacts[i].object, contacts[i].feature, contacts[i].slips};
    set.slips = set.slips || contacts[i].slips;
    set.limited = set.limited || contacts[i].object < 0;
  }
  return set;
}

// Whether all `contacts` press from the side from which the contacts of `set`, with the normals `normals`, press. Two
// contacts of one object and feature press from one side if their normals are less than 90° apart. A curved surface
// whose normal turns by more than that in a third of a step is an event, too.
template <int N>
bool ForceWeights<N>::same_sides(const ContactSet& set, const std::array<V, max_contacts>& normals,
                                 std::span<const models::Contact<N>> contacts) noexcept {
  for (const models::Contact<N>& contact : contacts) {
    for (std::size_t i = 0; i < set.count; ++i) {
      const auto& key = set.keys[i];
      if (key.object == contact.object && key.feature == contact.feature && !(normals[i].dot(contact.normal) > 0.0)) {
        return false;
      }
    }
  }
  return true;
}

// Whether `now` has a contact that `before` doesn't have.
template <int N>
bool ForceWeights<N>::gained(const ContactSet& before, const ContactSet& now) noexcept {
  if (now.acts && !before.acts) return true;
  for (std::size_t i = 0; i < now.count; ++i) {
    bool found = false;
    for (std::size_t j = 0; j < before.count; ++j) {
      found = found || (now.keys[i].object == before.keys[j].object && now.keys[i].feature == before.keys[j].feature);
    }
    if (!found) return true;
  }
  return now.overflow || before.overflow;
}

template <int N>
bool ForceWeights<N>::same(const ContactSet& a, const ContactSet& b) noexcept {
  if (a.overflow || b.overflow || a.count != b.count || a.held != b.held || a.acts != b.acts) return false;
  for (std::size_t i = 0; i < a.count; ++i) {
    bool found = false;
    for (std::size_t j = 0; j < b.count; ++j) {
      found = found || (a.keys[i].object == b.keys[j].object && a.keys[i].feature == b.keys[j].feature &&
                        a.keys[i].slips == b.keys[j].slips);
    }
    if (!found) return false;
  }
  return true;
}

template class ForceWeights<1>;
template class ForceWeights<2>;
template class ForceWeights<3>;

}  // namespace proxarm::controller
