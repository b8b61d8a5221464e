#include "models/groove.hpp"

#include <limits>

namespace proxarm::models {
namespace {

// The 2 × 2 system across e, in coordinates (n₁, t₁), as a function of s.
struct CrossSection {
  double cos, sin;  // n₂ = (cos, sin), t₂ = (−sin, cos)
  double F_n, F_t;  // x₀ − p
  double s_p;
  double mu[2], s_q[2], w[2];

  struct Shares {
    double f[2];  // normal forces over K
    double g;     // what is left along e: zero at the solution
  };

  // Friction of the contacts in `mask` (bit i) only; a contact at rest (v_i = 0) gets none.
  Shares at(double s, int mask = 3) const noexcept {
    double A[2][2] = {{1.0, 0.0}, {cos, sin}};
    double along[2] = {0.0, 0.0};
    for (int i = 0; i < 2; ++i) {
      const double v_e = s - s_q[i], v = std::sqrt(v_e * v_e + w[i] * w[i]);
      if (((mask >> i) & 1) == 0 || !(v > 0.0)) continue;
      const double across = mu[i] * (w[i] / v);
      along[i] = mu[i] * (v_e / v);
      A[i][0] -= across * (i == 0 ? 0.0 : -sin);
      A[i][1] -= across * (i == 0 ? 1.0 : cos);
    }
    const double det = A[0][0] * A[1][1] - A[0][1] * A[1][0];
    Shares out{};
    out.f[0] = (F_n * A[1][1] - F_t * A[1][0]) / det;
    out.f[1] = (A[0][0] * F_t - A[0][1] * F_n) / det;
    out.g = (s - s_p) + along[0] * out.f[0] + along[1] * out.f[1];
    return out;
  }

  // Where the slide ends if w is nothing beside it.
  [[nodiscard]] double guess() const noexcept {
    const double f_2 = F_t / sin, f_1 = F_n - cos * f_2;
    return s_p - std::copysign(mu[0] * f_1 + mu[1] * f_2, s_p - s_q[0]);
  }

  // g of a root is its slope times a unit in the last place of s; beside a pole it is anything but small.
  [[nodiscard]] bool is_root(double s, const Shares& shares) const noexcept {
    constexpr double eps = std::numeric_limits<double>::epsilon();
    return std::abs(shares.g) <= 1e-9 * (std::abs(F_n) + std::abs(F_t) + std::abs(s - s_p)) +
                                     16.0 * eps * (std::abs(s) + std::abs(s_p) + std::abs(s_q[0]));
  }
};

// The root of g between lo and hi, where g(lo) ≤ 0 ≤ g(hi). Mostly q is in the line but for the surfaces' curvature,
// and g nearly linear from the slide that the closed form would give: a few secant steps. Else false position
// (Illinois), halving where that is slow.
double root(const CrossSection& c, double lo, double hi) noexcept {
  const double small = 2.0 * std::numeric_limits<double>::epsilon() * (std::abs(c.s_p) + std::abs(c.s_q[0]));
  double at = std::clamp(c.guess(), lo, hi), g_at = c.at(at).g, next = std::clamp(at - g_at, lo, hi);
  if (std::abs(g_at) <= small) return at;
  for (int k = 0; k < 8 && next != at; ++k) {
    const double g_next = c.at(next).g;
    if (std::abs(g_next) <= small) return next;
    if (!(std::abs(g_next) < std::abs(g_at))) break;
    const double step = (next - at) * g_next / (g_at - g_next);
    at = next;
    g_at = g_next;
    next = at + step;
    if (!(next >= lo && next <= hi)) break;
    if (next == at) return at;
  }

  double g_lo = c.at(lo).g, g_hi = c.at(hi).g;
  if (!(g_lo < 0.0)) return lo;
  if (!(g_hi > 0.0)) return hi;
  int side = 0;
  for (int k = 0; k < 200; ++k) {
    double s = (k % 4 == 3) ? 0.5 * (lo + hi) : (lo * g_hi - hi * g_lo) / (g_hi - g_lo);
    if (!(s > lo && s < hi)) s = 0.5 * (lo + hi);
    if (!(s > lo && s < hi)) return s;  // neighbours among doubles
    const double g = c.at(s).g;
    if (g == 0.0) return s;
    if (g < 0.0) {
      lo = s;
      g_lo = g;
      if (side == -1) g_hi *= 0.5;
      side = -1;
    } else {
      hi = s;
      g_hi = g;
      if (side == 1) g_lo *= 0.5;
      side = 1;
    }
  }
  return 0.5 * (lo + hi);
}

}  // namespace

GrooveSolution solve_groove(const FlatSurface<3>& a, double mu_a, const FlatSurface<3>& b, double mu_b,
                            const GrooveLine& line, const Vec3& p, const Vec3& q_a, const Vec3& q_b,
                            GrooveSearch search) noexcept {
  GrooveSolution out;
  if (!line.exists) return out;
  const bool may_pull = search == GrooveSearch::may_pull;
  const Vec3 d_p = p - line.x0, d_1 = q_a - line.x0, d_2 = q_b - line.x0;
  const double rounding = a.rounding(q_a) + b.rounding(q_b) + a.rounding(p);
  const double s_p = line.e.dot(d_p), F_n = -a.normal().dot(d_p), F_t = -line.t1.dot(d_p);
  const double s_1 = line.e.dot(d_1), w_1 = -line.t1.dot(d_1);
  const double s_2 = line.e.dot(d_2), w_2 = -line.t2.dot(d_2);
  const double w_rounding = rounding / line.sin;  // what w may be for a proxy that is in the line
  const bool in_line_1 = std::abs(w_1) <= w_rounding, in_line_2 = std::abs(w_2) <= w_rounding;
  // The normal forces (over K) may miss zero by the rounding of p: such a contact touches.
  const double least = may_pull ? -std::numeric_limits<double>::infinity() : -w_rounding;
  const auto place = [&](double s) { return line.settle(a, b, line.x0 + s * line.e); };

  if (in_line_1 && in_line_2 && s_1 == s_2) {
    const double f_2 = F_t / line.sin, f_1 = F_n - line.cos * f_2;
    if (f_1 < least || f_2 < least) return out;
    out.found = true;
    const double reach = mu_a * std::max(0.0, f_1) + mu_b * std::max(0.0, f_2), d = s_p - s_1;
    if (std::abs(d) <= reach) {
      out.r = a.holds(q_a) && b.holds(q_a) ? q_a : place(s_1);  // sticks: bit for bit
      return out;
    }
    out.slips1 = mu_a > 0.0;
    out.slips2 = mu_b > 0.0;
    out.r = place(s_p - std::copysign(reach, d));
    return out;
  }

  if (may_pull) {
    const double f_2 = F_t / line.sin, f_1 = F_n - line.cos * f_2;
    if (f_1 < 0.0 || f_2 < 0.0) {  // friction of a contact that pulls would lead nowhere
      out.found = true;
      out.r = place(s_p);
      return out;
    }
  }
  const CrossSection c{line.cos, line.sin,     F_n,        F_t,
                       s_p,      {mu_a, mu_b}, {s_1, s_2}, {in_line_1 ? 0.0 : w_1, in_line_2 ? 0.0 : w_2}};
  double lo = std::min({s_p, s_1, s_2}), hi = std::max({s_p, s_1, s_2});
  const auto accept = [&](double s, const CrossSection::Shares& shares, bool slips1, bool slips2) {
    if (!(shares.f[0] >= least && shares.f[1] >= least)) return false;
    out.found = true;
    out.slips1 = slips1 && mu_a > 0.0;
    out.slips2 = slips2 && mu_b > 0.0;
    out.r = place(s);
    return true;
  };
  // A contact that came straight down onto the line may stick there while the other slips.
  for (int i = 0; i < 2; ++i) {
    if (c.w[i] != 0.0 || !(c.mu[i] > 0.0) || c.s_q[i] < lo || c.s_q[i] > hi) continue;
    const CrossSection::Shares others = c.at(c.s_q[i], 3 & ~(1 << i));
    const double reach = c.mu[i] * std::max(0.0, others.f[i]);
    if (std::abs(others.g) <= reach) {
      accept(c.s_q[i], others, i != 0, i != 1);
      return out;
    }
    // Else the root is on the side to which it is pushed.
    if (others.g > 0.0) {
      hi = std::min(hi, std::nextafter(c.s_q[i], lo));
    } else {
      lo = std::max(lo, std::nextafter(c.s_q[i], hi));
    }
  }
  const double s = root(c, lo, hi);
  const CrossSection::Shares shares = c.at(s);
  const bool is_root = c.is_root(s, shares);
  if ((is_root || may_pull) && accept(s, shares, true, true)) return out;
  if (is_root && search == GrooveSearch::first_root) return out;
  // Where p is far deeper than q was away, friction on arrival can outweigh the faces' own directions: g has several
  // roots, or jumps through infinity between them. Look from where p pulls towards rest; if the root above is one, but
  // of a contact that pulls, then only where both parts of a slip matter: beyond, there is no other.
  const double widest = std::max(std::abs(c.w[0]), std::abs(c.w[1])), way = std::abs(s_p - s_1);
  double at = is_root ? std::min(1.0, 1e3 * widest / way) : 1.0;
  for (double s_far = s_1 + at * (s_p - s_1); at > 1e-15 && at * way > 1e-3 * rounding; at *= 0.7) {
    const double s_near = s_1 + 0.7 * at * (s_p - s_1);
    const double from = std::min(s_near, s_far), to = std::max(s_near, s_far), g_from = c.at(from).g;
    const double end = g_from < 0.0 && c.at(to).g >= 0.0 ? root(c, from, to) : s_near;
    const CrossSection::Shares here = c.at(end);
    if (c.is_root(end, here) && accept(end, here, true, true)) break;
    s_far = s_near;
  }
  return out;
}

}  // namespace proxarm::models
