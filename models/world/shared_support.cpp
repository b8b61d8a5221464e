#include "models/world/shared_support.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/geometry/linear_systems.hpp"
#include "models/world/settling.hpp"

namespace proxarm::models {
namespace {

constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
constexpr std::size_t most = SharedSupport::most;
constexpr int most_rounds = 4;
// Limit for ‖p − q‖ and for the sum of the forces over K. Typical steps are micrometres. Forces settle to 64 u of this
// limit, which is 0.1 nm. With a larger limit, rounding would be as large as the thickness of thin layers.
constexpr double farthest_m = 1e4;
static_assert(3 * most <= most_equations);

struct FlatContact {
  FlatSurface<3> surface = FlatSurface<3>::of_unit(Vec3::Zero(), Vec3::UnitZ());
  double mu = 0.0;
  Layer layer;
  // The last position of the proxy, carried along by the obstacle's motion.
  Vec3 q = Vec3::Zero();
};

// The step 𝒢_i(K, p_i, q) by (4) on a plane with its layer, and the derivative D = ∂r/∂p_i.
struct Response {
  Vec3 r;
  Mat3 D;
};

Response respond(const FlatContact& c, double K, const Vec3& p) noexcept {
  const Vec3& n = c.surface.normal();
  const double h_p = c.surface.height(p);
  if (h_p > 0.0) return {p, Mat3::Identity()};
  double h = 0.0, gives = 0.0;  // height of r above the surface, and the derivative of this height by h_p
  if (c.layer.soft()) {
    gives = K / (K + c.layer.stiffness_N_per_m);
    h = gives * h_p;
    if (h < -c.layer.thickness_m) {
      h = -c.layer.thickness_m;
      gives = 0.0;
    }
  }
  const Mat3 nn = n * n.transpose();
  const Vec3 p_t = p + n * (h - h_p), q_t = c.q + n * (h - c.surface.height(c.q)), d = p_t - q_t;
  const double distance = d.norm(), reach = c.mu * (h - h_p);
  if (!(distance > reach)) return {q_t, gives * nn};
  const Vec3 e = d / distance;
  const double share = reach / distance;
  const Mat3 T = Mat3::Identity() - nn;
  return {p_t - share * d,
          gives * nn + (1.0 - share) * T + share * e * e.transpose() + c.mu * (1.0 - gives) * e * n.transpose()};
}

// Finds the forces of all contacts over K, on given tangent planes.
class FlatSupport {
 public:
  std::array<FlatContact, most> contact;
  std::array<Vec3, most> x;  // f_i / K
  std::size_t count = 0;
  Vec3 r;
  int budget = 0;

  // Returns the residual (m) at which forces count as settled: the rounding of r.
  [[nodiscard]] double rounding_m() const noexcept { return 64.0 * u * size_; }

  // Returns the sum of ‖f_i‖/K over all contacts, m.
  [[nodiscard]] double squeeze_m() const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) sum += x[i].norm();
    return sum;
  }

  // Solves for the forces by Newton's method. By Assumption 1, a contact's force is the same for every stiffness, so
  // Newton's method may use another stiffness than K. It tries K first, and then stiffnesses that keep the points p_i
  // near their surfaces, where the equations are closer to linear. After another stiffness, a few steps with K remove
  // the rounding that it caused.
  bool solve(double K, const Vec3& p) noexcept {
    const std::array<Vec3, most> start = x;
    double k = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      if (contact[i].layer.soft()) k = std::max(k, contact[i].layer.stiffness_N_per_m);
    }
    stiffer_ = 1.0;
    sweep(K, p);
    if (solve_from_here(K, p, Haste::few_steps)) return true;
    for (const double stiffer : {100.0, 1e3, k / K, 30.0, 30.0 * k / K, 1.0 / 30.0, k / K / 30.0, 1.0}) {
      x = start;
      sweep(K, p);
      stiffer_ = stiffer;
      const bool found = solve_from_here(K, p, Haste::none);
      stiffer_ = 1.0;
      if (found && (stiffer == 1.0 || solve_from_here(K, p, Haste::few_steps))) return true;
    }
    return false;
  }

 private:
  enum class Haste : std::uint8_t { few_steps, none };
  static constexpr int most_steps = 40, bold_steps = 8, most_stuck = 4;

  // Runs Newton's method from the present forces. The first steps are taken even if the residual grows (`bold`),
  // because on the path to the right pieces of (4) the residual may be larger. Each later step must reduce the
  // residual; otherwise Gauss–Seidel sweeps follow.
  bool solve_from_here(double K, const Vec3& p, Haste haste) noexcept {
    double apart = evaluate(K, p);
    int stuck = 0;
    for (int k = 0; k < (haste == Haste::few_steps ? bold_steps : most_steps); ++k) {
      const double nothing = u * size_;
      if (!std::isfinite(apart) || budget < 0) return false;
      if (apart <= nothing) return true;
      if (step(K, p, apart, k < bold_steps && apart > 64.0 * nothing)) {
        stuck = 0;
        continue;
      }
      // Either only rounding is left, or Newton's step doesn't reduce the residual.
      if (apart <= 64.0 * nothing) return true;
      if (++stuck > most_stuck) return false;
      for (int s = 0; s < 3 * stuck; ++s) sweep(K, p);
      apart = evaluate(K, p);
    }
    return apart <= 64.0 * u * size_;
  }

  // Makes one nonlinear Gauss–Seidel sweep: solves for each contact in turn, with the latest forces of the other
  // contacts. Rigid contacts come first, because the layers' forces are already known approximately from the proxy's
  // last position.
  void sweep(double K, const Vec3& p) noexcept {
    budget -= static_cast<int>(count * count);
    for (const bool soft : {false, true}) {
      for (std::size_t i = 0; i < count; ++i) {
        if (contact[i].layer.soft() != soft) continue;
        Vec3 p_i = p;
        for (std::size_t j = 0; j < count; ++j) {
          if (j != i) p_i += x[j];
        }
        x[i] = respond(contact[i], K, p_i).r - p_i;
      }
    }
  }

  // Computes the residuals R_i = 𝒢_i(σK, r − x_i/σ) − r, where r = p + Σ x_j and σ = stiffer_. Returns their largest
  // component.
  double evaluate(double K, const Vec3& p) noexcept {
    r = p;
    size_ = p.lpNorm<1>();
    for (std::size_t i = 0; i < count; ++i) {
      r += x[i];
      size_ += x[i].lpNorm<1>() + contact[i].q.lpNorm<1>();
    }
    double apart = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      response_[i] = respond(contact[i], stiffer_ * K, r - x[i] / stiffer_);
      apart = std::max(apart, (response_[i].r - r).lpNorm<Eigen::Infinity>());
    }
    return apart;
  }

  // Returns a solution of A dx = b. If rigid contacts stick, their shares of the force aren't unique. A is then
  // singular, and any solution is sufficient.
  template <int Size>
  static Unknowns solution(const Equations& A, const Unknowns& b) noexcept {
    const Eigen::Matrix<double, Size, Size> square = A;
    const Eigen::Matrix<double, Size, 1> right = b, dx = solve_square<Size>(square, right);
    if ((square * dx - right).norm() <= 1e-9 * right.norm()) return dx;
    return solve_least_squares(A, b);
  }

  // Makes one Newton step with backtracking. The step solves the linear system (D_i − I) Σ dx_j − D_i dx_i/σ = −R_i for
  // all i, where σ = stiffer_. Returns true if the residual `apart` became smaller by at least a quarter of the
  // fraction of the step that was taken; otherwise the forces are unchanged. With `bold`, takes the whole step and
  // returns true.
  bool step(double K, const Vec3& p, double& apart, bool bold) noexcept {
    budget -= static_cast<int>(count * count * count);
    const Eigen::Index n = 3 * static_cast<Eigen::Index>(count);
    Equations A(n, n);
    Unknowns b(n);
    for (std::size_t i = 0; i < count; ++i) {
      const auto row = 3 * static_cast<Eigen::Index>(i);
      b.segment<3>(row) = r - response_[i].r;
      for (std::size_t j = 0; j < count; ++j) {
        const auto column = 3 * static_cast<Eigen::Index>(j);
        A.block<3, 3>(row, column) = response_[i].D - Mat3::Identity();
        if (j == i) A.block<3, 3>(row, column) -= response_[i].D / stiffer_;
      }
    }
    const Unknowns dx = count == 2 ? solution<6>(A, b) : count == 3 ? solution<9>(A, b) : solve_least_squares(A, b);
    if (!dx.allFinite()) return false;
    const std::array<Vec3, most> before = x;
    const double apart_before = apart;
    for (const double share : {1.0, 0.5, 0.25, 0.125}) {
      for (std::size_t i = 0; i < count; ++i) {
        x[i] = before[i] + share * dx.segment<3>(3 * static_cast<Eigen::Index>(i));
      }
      apart = evaluate(K, p);
      if (bold || apart < (1.0 - 0.25 * share) * apart_before) return true;
    }
    x = before;
    apart = evaluate(K, p);
    return false;
  }

  std::array<Response, most> response_;
  double size_ = 0.0, stiffer_ = 1.0;
};

// Solves the contacts on tangent planes, and repeats this with the tangent planes at each solution until r settles.
bool settle(SharedSupport& support, FlatSupport& flat, double K, const Vec3& p, const Vec3& q) noexcept {
  Settling settling(q);
  for (int k = 0; k < most_settling; ++k) {
    bool same = k > 0;
    for (std::size_t i = 0; i < flat.count; ++i) {
      const Obstacle::Tangent t = support.obstacle[i]->tangent(settling.at(), support.step[i].feature);
      same = same && t.surface.normal() == flat.contact[i].surface.normal();
      flat.contact[i].surface = t.surface;
      flat.contact[i].mu = t.mu;
    }
    if (same) return true;
    if (!flat.solve(K, p)) return false;
    if (settling.take(flat.r)) return true;
  }
  return false;
}

// Returns the final r. The sum p + Σ f_i/K has a rounding error. But a surface that can't yield (a rigid surface, or a
// layer pressed down to its core) gives r exactly. A proxy that sticks to a contact is returned bit for bit.
Vec3 placed(const SharedSupport& support, const FlatSupport& flat, const Vec3& q) noexcept {
  Vec3 r = flat.r;
  std::size_t hard = 0, rigid = most;
  for (int turn = 0; turn < 4; ++turn) {
    hard = 0;
    rigid = most;
    for (std::size_t i = 0; i < support.count; ++i) {
      const FlatContact& c = flat.contact[i];
      const double core = c.layer.soft() ? -c.layer.thickness_m : 0.0, height = c.surface.height(r) - core;
      if (!support.step[i].touches || std::abs(height) > flat.rounding_m()) continue;
      r -= height * c.surface.normal();
      ++hard;
      if (!c.layer.soft()) rigid = i;
    }
  }
  if (hard == 1 && rigid != most) r = support.step[rigid].r;
  for (std::size_t i = 0; i < support.count; ++i) {
    if (support.step[i].touches && support.step[i].r == q) r = q;
  }
  return r;
}

enum class Confirmed : std::uint8_t { yes, no, other_features };

// Checks flat.r by the step of each obstacle itself, with its edges and curvature, while the forces of the other
// obstacles are fixed.
Confirmed confirm(SharedSupport& support, const FlatSupport& flat, double K, const Vec3& p, const Vec3& q) noexcept {
  // The tolerance is between two scales: edges and curvature cause far larger differences, and rounding causes smaller
  // differences for objects of up to a hundred metres.
  const double nothing = 1e-12 * (1.0 + p.lpNorm<1>() + q.lpNorm<1>());
  bool agree = true, others = false;
  for (std::size_t i = 0; i < flat.count; ++i) {
    Obstacle::Step& s = support.step[i];
    const std::int32_t feature = s.feature;
    const Obstacle::Step own = support.obstacle[i]->step(K, flat.r - flat.x[i], q);
    const bool here = (own.r - flat.r).lpNorm<Eigen::Infinity>() <= nothing;
    agree = agree && here;
    others = others || (own.touches && own.feature != feature);
    s = own;
    if (!own.touches) s.feature = feature;
  }
  if (agree) {
    support.r = placed(support, flat, q);
    return Confirmed::yes;
  }
  return others ? Confirmed::other_features : Confirmed::no;
}

}  // namespace

bool SharedSupport::solve(double K, const Vec3& p, const Vec3& q) noexcept {
  if (!((p - q).norm() <= farthest_m)) return false;
  FlatSupport flat;
  flat.count = count;
  flat.budget = budget;
  for (std::size_t i = 0; i < count; ++i) {
    FlatContact& c = flat.contact[i];
    c.q = obstacle[i]->carry(q);
    c.layer = obstacle[i]->layer();
    flat.x[i] = Vec3::Zero();
    if (!c.layer.soft()) continue;
    // The first guess of a layer's force is the force at the layer's depth at q. It is exact if friction on other
    // contacts holds the proxy. From zero, a sweep would add only a fraction K/k of the force.
    const FlatSurface<3> surface = obstacle[i]->tangent(c.q, step[i].feature).surface;
    const double depth = std::clamp(-surface.height(c.q), 0.0, c.layer.thickness_m);
    flat.x[i] = (c.layer.stiffness_N_per_m / K * depth) * surface.normal();
  }
  Confirmed confirmed = Confirmed::other_features;
  for (int round = 0; round < most_rounds && confirmed == Confirmed::other_features; ++round) {
    confirmed =
        settle(*this, flat, K, p, q) && flat.squeeze_m() <= farthest_m ? confirm(*this, flat, K, p, q) : Confirmed::no;
  }
  budget = flat.budget;
  return confirmed == Confirmed::yes;
}

}  // namespace proxarm::models
