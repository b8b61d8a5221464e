#include "models/surfaces/groove.hpp"

#include <array>
#include <limits>

namespace proxarm::models {
namespace {

// The 2 × 2 linear system for f₁ and f₂ as a function of s (groove.hpp), in the coordinates (n₁, t₁) across e.
struct CrossSection {
  double cos, sin;  // n₂ = (cos, sin), t₂ = (−sin, cos)
  double F_n, F_t;  // x₀ − p
  double s_p;
  double mu[2], s_q[2], w[2];

  struct Shares {
    double f[2];  // normal forces divided by K
    // The balance of forces along e; zero at the solution.
    double g;
  };

  // Returns f and g at s, with friction only at the contacts in `mask` (bit i: contact i). Here a contact at rest (v_i
  // = 0) has no friction.
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

  // Returns a first guess of the root of g: the root for w = 0, in closed form.
  [[nodiscard]] double guess() const noexcept {
    const double f_2 = F_t / sin, f_1 = F_n - cos * f_2;
    return s_p - std::copysign(mu[0] * f_1 + mu[1] * f_2, s_p - s_q[0]);
  }

  // Whether g is zero at s within rounding. Where the sign of g changes, g may also have a pole, but near a pole |g| is
  // large.
  //
  // The friction of contact i reverses its direction within a distance of about w_i from s_i. There, g has a slope of
  // up to μ_i f_i/|w_i| (5e3 if q is 0.3 nm beside the line and p is 6 µm deep), so g is zero only within this slope
  // times the rounding of s. The code limits f_i to the force without friction, so that a pole isn't taken for a root.
  [[nodiscard]] bool is_root(double s, const Shares& shares) const noexcept {
    constexpr double eps = std::numeric_limits<double>::epsilon();
    const double force = std::abs(F_n) + std::abs(F_t), s_size = std::abs(s) + std::abs(s_p) + std::abs(s_q[0]);
    double slope = 16.0;
    for (int i = 0; i < 2; ++i) {
      if (w[i] != 0.0) slope += mu[i] * std::min(std::abs(shares.f[i]), force) / std::abs(w[i]);
    }
    return std::abs(shares.g) <= 1e-9 * (force + std::abs(s - s_p)) + slope * eps * s_size;
  }
};

// Returns the root of g between lo and hi. Precondition: g(lo) ≤ 0 ≤ g(hi). Usually g is nearly linear around guess(),
// and the secant method needs a few steps. If the secant method fails, false position (the Illinois variant) follows,
// with a bisection every fourth step.
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
    if (!(s > lo && s < hi)) return s;  // lo and hi are neighbouring doubles
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

// One call of solve_groove. Contains both contacts in coordinates along e (s) and across e (w), relative to x₀.
class Groove {
 public:
  Groove(const PlaneContact& a, const PlaneContact& b, const GrooveLine& line, const Vec3& p,
         GrooveSearch search) noexcept
      : a_(a), b_(b), line_(line), search_(search) {
    const Vec3 d_p = p - line.x0, d_1 = a.q - line.x0, d_2 = b.q - line.x0;
    rounding_ = a.surface.rounding(a.q) + b.surface.rounding(b.q) + a.surface.rounding(p);
    w_rounding_ = rounding_ / line.sin;
    s_p_ = line.e.dot(d_p);
    F_n_ = -a.surface.normal().dot(d_p);
    F_t_ = -line.t1.dot(d_p);
    s_q_ = {line.e.dot(d_1), line.e.dot(d_2)};
    w_ = {-line.t1.dot(d_1), -line.t2.dot(d_2)};
    for (double& w : w_) w = std::abs(w) <= w_rounding_ ? 0.0 : w;
    // The rounding of p may make a normal force (over K) slightly negative. A contact with such a force still touches.
    least_ = may_pull() ? -std::numeric_limits<double>::infinity() : -w_rounding_;
    f_2_ = F_t_ / line.sin;
    f_1_ = F_n_ - line.cos * f_2_;
  }

  [[nodiscard]] GrooveSolution solve() noexcept {
    if (w_[0] == 0.0 && w_[1] == 0.0 && s_q_[0] == s_q_[1]) {
      from_within();
    } else if (may_pull() && (f_1_ < 0.0 || f_2_ < 0.0)) {
      // For a contact that pulls, friction has no meaning.
      out_.found = true;
      out_.r = place(s_p_);
    } else {
      from_beside();
    }
    return out_;
  }

 private:
  [[nodiscard]] bool may_pull() const noexcept { return search_ == GrooveSearch::may_pull; }
  [[nodiscard]] Vec3 place(double s) const noexcept {
    return line_.settle(a_.surface, b_.surface, line_.x0 + s * line_.e);
  }

  // Solves the case that the proxy was already in the line; the solution is in closed form.
  void from_within() noexcept {
    if (f_1_ < least_ || f_2_ < least_) return;
    out_.found = true;
    const double reach = a_.mu * std::max(0.0, f_1_) + b_.mu * std::max(0.0, f_2_), d = s_p_ - s_q_[0];
    if (std::abs(d) <= reach) {
      // If the proxy sticks, it stays at q itself.
      out_.r = a_.surface.holds(a_.q) && b_.surface.holds(a_.q) ? a_.q : place(s_q_[0]);
      return;
    }
    out_.slips1 = a_.mu > 0.0;
    out_.slips2 = b_.mu > 0.0;
    out_.r = place(s_p_ - std::copysign(reach, d));
  }

  // Solves the case that the proxy arrives in the line from beside it; the solution is the root of g.
  void from_beside() noexcept {
    const CrossSection c{line_.cos, line_.sin, F_n_, F_t_, s_p_, {a_.mu, b_.mu}, {s_q_[0], s_q_[1]}, {w_[0], w_[1]}};
    double lo = std::min({s_p_, s_q_[0], s_q_[1]}), hi = std::max({s_p_, s_q_[0], s_q_[1]});
    if (one_sticks(c, lo, hi)) return;
    const double s = root(c, lo, hi);
    const CrossSection::Shares shares = c.at(s);
    const bool is_root = c.is_root(s, shares);
    if ((is_root || may_pull()) && accept(s, shares, true, true)) return;
    if (is_root && search_ == GrooveSearch::first_root) return;
    look_for_another_root(c, is_root);
  }

  // Whether a contact sticks while the other contact slips. This is possible for a contact with w = 0, because it
  // needn't slip across the line. If the function returns true, either the solution was accepted, or no solution exists
  // because a contact pulls. If it returns false, lo and hi have been narrowed to the side of s_i to which contact i is
  // pushed, because the root is on this side.
  bool one_sticks(const CrossSection& c, double& lo, double& hi) noexcept {
    for (int i = 0; i < 2; ++i) {
      if (c.w[i] != 0.0 || !(c.mu[i] > 0.0) || c.s_q[i] < lo || c.s_q[i] > hi) continue;
      const CrossSection::Shares others = c.at(c.s_q[i], 3 & ~(1 << i));
      const double reach = c.mu[i] * std::max(0.0, others.f[i]);
      if (std::abs(others.g) <= reach) {
        accept(c.s_q[i], others, i != 0, i != 1);
        return true;
      }
      if (others.g > 0.0) {
        hi = std::min(hi, std::nextafter(c.s_q[i], lo));
      } else {
        lo = std::max(lo, std::nextafter(c.s_q[i], hi));
      }
    }
    return false;
  }

  // Searches for another root of g. If p is far deeper than q was away from the line, friction across the line can make
  // the 2 × 2 system singular; g then has several roots, or poles between the roots. The search goes from s_p towards
  // s_1 in intervals; each interval ends at 0.7 times the distance from s_1 at which it begins. If a contact pulls at
  // the first root, the search begins at a distance of 1000 w from s_1: at greater distances the contacts slip
  // practically along e, and g has no further root.
  void look_for_another_root(const CrossSection& c, bool first_was_root) noexcept {
    const double widest = std::max(std::abs(c.w[0]), std::abs(c.w[1])), way = std::abs(s_p_ - s_q_[0]);
    double at = first_was_root ? std::min(1.0, 1e3 * widest / way) : 1.0;
    for (double s_far = s_q_[0] + at * (s_p_ - s_q_[0]); at > 1e-15 && at * way > 1e-3 * rounding_; at *= 0.7) {
      const double s_near = s_q_[0] + 0.7 * at * (s_p_ - s_q_[0]);
      const double from = std::min(s_near, s_far), to = std::max(s_near, s_far), g_from = c.at(from).g;
      const double end = g_from < 0.0 && c.at(to).g >= 0.0 ? root(c, from, to) : s_near;
      const CrossSection::Shares here = c.at(end);
      if (c.is_root(end, here) && accept(end, here, true, true)) break;
      s_far = s_near;
    }
  }

  bool accept(double s, const CrossSection::Shares& shares, bool slips1, bool slips2) noexcept {
    if (!(shares.f[0] >= least_ && shares.f[1] >= least_)) return false;
    out_.found = true;
    out_.slips1 = slips1 && a_.mu > 0.0;
    out_.slips2 = slips2 && b_.mu > 0.0;
    out_.r = place(s);
    return true;
  }

  const PlaneContact &a_, &b_;
  const GrooveLine& line_;
  GrooveSearch search_;
  // rounding_: sum of the heights' rounding. w_rounding_: largest |w| of a proxy that counts as in the line.
  double rounding_, w_rounding_;
  // s_p_: p along e. F_n_, F_t_: the components of x₀ − p along n₁ and t₁, which are perpendicular to e.
  double s_p_, F_n_, F_t_;
  // Each contact's q along e (s) and across e (w). A |w| within rounding is set to 0.
  std::array<double, 2> s_q_, w_;
  // least_: least normal force that is allowed. f_1_, f_2_: normal forces without friction.
  double least_, f_1_, f_2_;
  GrooveSolution out_;
};

}  // namespace

GrooveSolution solve_groove(const PlaneContact& a, const PlaneContact& b, const GrooveLine& line, const Vec3& p,
                            GrooveSearch search) noexcept {
  return line.exists ? Groove(a, b, line, p, search).solve() : GrooveSolution{};
}

}  // namespace proxarm::models
