#include "controller/extras/studies/error/error_cases.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "models/obstacles/plane_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/plane.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "models/world/media.hpp"

namespace proxarm::studies {
namespace {

using models::GeometricAlgorithm;
using models::Vec3;
using World = std::unique_ptr<GeometricAlgorithm<3>>;

constexpr double g_m_per_s2 = 9.80665;

World free_space() { return std::make_unique<models::FreeSpace<3>>(); }

// The 𝒢 of a single object.
class OneObstacle final : public GeometricAlgorithm<3> {
 public:
  explicit OneObstacle(std::unique_ptr<models::Obstacle> obstacle) : obstacle_(std::move(obstacle)) {}

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override {
    const models::Obstacle::Step s = obstacle_->step(K, p, q);
    count_ = s.touches ? 1 : 0;
    contact_.feature = s.feature;
    contact_.slips = s.slips;
    contact_.normal = s.normal;
    return s.touches ? s.r : p;
  }
  [[nodiscard]] std::span<const models::Contact<3>> contacts() const noexcept override { return {&contact_, count_}; }

 private:
  std::unique_ptr<models::Obstacle> obstacle_;
  models::Contact<3> contact_;
  std::size_t count_ = 0;
};

World inside_sphere(double radius_m) {
  return std::make_unique<OneObstacle>(
      std::make_unique<models::Sphere>(models::PointCore{Vec3::Zero()}, radius_m, 0.0, true));
}

// Jacobi's elliptic functions sn, cn, dn of modulus k. Source: descending Landen transformations with the
// arithmetic-geometric mean, Abramowitz and Stegun 16.4.
struct Elliptic {
  double sn, cn, dn;
};
Elliptic elliptic(double u, double k) {
  std::array<double, 12> a{}, c{};
  a[0] = 1.0;
  c[0] = k;
  double b = std::sqrt(1.0 - k * k);
  std::size_t n = 0;
  while (std::abs(c[n]) > 1e-16 && n + 1 < a.size()) {
    a[n + 1] = 0.5 * (a[n] + b);
    c[n + 1] = 0.5 * (a[n] - b);
    b = std::sqrt(a[n] * b);
    ++n;
  }
  double phi = std::ldexp(a[n] * u, static_cast<int>(n));
  for (; n > 0; --n) phi = 0.5 * (phi + std::asin(c[n] * std::sin(phi) / a[n]));
  const double sn = std::sin(phi);
  return {sn, std::cos(phi), std::sqrt(1.0 - k * k * sn * sn)};
}

ErrorCase free_constant() {
  ErrorCase c{.name = "free_constant", .title = "free flight, constant force"};
  c.force.constant = {2.0, -1.0, 0.5};
  c.exact = [F = c.force.constant](double t) {
    const Vec3 v0(0.1, 0.2, -0.1);
    return CaseState{v0 * t + 0.5 * t * t * F, v0 + t * F, Vec3::Zero()};
  };
  c.world = free_space;
  return c;
}

ErrorCase free_sine() {
  ErrorCase c{.name = "free_sine", .title = "free flight, sinusoidal force"};
  c.force.sine = {5.0, 0.0, 2.0};
  c.force.omega_rad_per_s = 4.0 * std::numbers::pi;
  c.exact = [A = c.force.sine, w = c.force.omega_rad_per_s](double t) {
    const Vec3 v0 = -A / w;  // with this initial velocity the proxy moves to and fro
    return CaseState{v0 * t + A * ((w * t - std::sin(w * t)) / (w * w)), v0 + A * ((1.0 - std::cos(w * t)) / w),
                     Vec3::Zero()};
  };
  // v0 makes the mean velocity 0, because x = −A sin(ωt)/ω² + (A/ω + v0) t.
  c.world = free_space;
  return c;
}

ErrorCase impact() {
  ErrorCase c{.name = "impact", .title = "impact and rest on a wall", .duration_s = 0.5};
  c.force.constant = {0.0, 0.0, -5.0};
  static constexpr double height = 0.0317, speed = 0.1, a = 5.0;
  // height = speed t + a t²/2
  c.stop_s = (-speed + std::sqrt(speed * speed + 2.0 * a * height)) / a;
  c.exact = [hit = c.stop_s](double t) {
    CaseState s;
    if (t < hit) {
      s.q.z() = height - speed * t - 0.5 * a * t * t;
      s.v.z() = -speed - a * t;
    } else {
      s.f.z() = 5.0;
    }
    return s;
  };
  c.surfaces.push_back({});
  c.world = [] { return std::make_unique<models::Plane<3>>(Vec3::Zero(), Vec3::UnitZ()); };
  return c;
}

ErrorCase slide() {
  ErrorCase c{.name = "slide", .title = "slide to stop under friction", .duration_s = 0.4, .friction = 0.3};
  c.force.constant = {0.0, 0.0, -5.0};
  c.starts_in_contact = true;
  const Vec3 v0(0.3, 0.2, 0.0);
  const double a = c.friction * 5.0;
  c.stop_s = v0.norm() / a;
  c.exact = [v0, a, stop = c.stop_s](double t) {
    CaseState s;
    const double u = std::min(t, stop);
    const Vec3 e = v0.normalized();
    s.q = v0 * u - 0.5 * a * u * u * e;
    s.v = t < stop ? Vec3(v0 - a * t * e) : Vec3::Zero();
    s.f = Vec3(0.0, 0.0, 5.0);
    if (t < stop) s.f -= a * e;
    return s;
  };
  c.surfaces.push_back({});
  c.world = [mu = c.friction] { return std::make_unique<models::FrictionPlane<3>>(Vec3::Zero(), Vec3::UnitZ(), mu); };
  return c;
}

ErrorCase stick_slip() {
  ErrorCase c{.name = "stick_slip", .title = "stick-slip under a ramp", .duration_s = 0.8, .friction = 0.3};
  c.force.constant = {0.0, 0.0, -5.0};
  c.force.ramp_N_per_s = {4.0, 2.0, 0.0};
  c.starts_in_contact = true;
  const double rate = c.force.ramp_N_per_s.norm(), begins = c.friction * 5.0 / rate;
  c.exact = [rate, begins, e = Vec3(c.force.ramp_N_per_s / rate)](double t) {
    CaseState s;
    const double u = std::max(0.0, t - begins);
    s.q = rate * u * u * u / 6.0 * e;
    s.v = 0.5 * rate * u * u * e;
    s.f = Vec3(0.0, 0.0, 5.0) - rate * std::min(t, begins) * e;
    return s;
  };
  c.surfaces.push_back({});
  c.world = [mu = c.friction] { return std::make_unique<models::FrictionPlane<3>>(Vec3::Zero(), Vec3::UnitZ(), mu); };
  return c;
}

ErrorCase geodesic() {
  ErrorCase c{.name = "geodesic", .title = "geodesic inside a sphere"};
  static constexpr double R = 0.1, speed = 0.5;
  c.starts_in_contact = true;
  c.turns = true;
  c.exact = [](double t) {
    const double w = speed / R, cos = std::cos(w * t), sin = std::sin(w * t);
    const Vec3 x(1.0, 0.0, 0.0), y = Vec3(0.0, 1.0, 1.0).normalized();
    return CaseState{R * (cos * x + sin * y), speed * (cos * y - sin * x), -speed * speed / R * (cos * x + sin * y)};
  };
  c.surfaces.push_back({.radius_m = R});
  c.world = [] { return inside_sphere(R); };
  return c;
}

ErrorCase pendulum() {
  ErrorCase c{.name = "pendulum", .title = "pendulum inside a sphere"};
  static constexpr double R = 0.1, angle = 1.0;
  c.force.constant = {0.0, 0.0, -g_m_per_s2};
  c.starts_in_contact = true;
  c.turns = true;
  c.exact = [](double t) {
    // sin(θ/2) = k cd(ω₀t), θ̇ = −2 k k' ω₀ sd(ω₀t)·…; from sn, cn, dn: cd = cn/dn, d cd/du = −(1 − k²) sn/dn²
    const double k = std::sin(0.5 * angle), w = std::sqrt(g_m_per_s2 / R);
    const Elliptic e = elliptic(w * t, k);
    const double half = std::asin(k * e.cn / e.dn), theta = 2.0 * half;
    const double rate = -2.0 * k * (1.0 - k * k) * e.sn / (e.dn * e.dn) * w / std::cos(half);
    const Vec3 out(std::sin(theta), 0.0, -std::cos(theta)), along(std::cos(theta), 0.0, std::sin(theta));
    return CaseState{R * out, R * rate * along, -(R * rate * rate + g_m_per_s2 * std::cos(theta)) * out};
  };
  c.surfaces.push_back({.radius_m = R});
  c.world = [] { return inside_sphere(R); };
  return c;
}

ErrorCase groove() {
  ErrorCase c{.name = "groove", .title = "groove with friction", .duration_s = 0.4, .friction = 0.2};
  c.force.constant = {0.0, 0.0, -5.0};
  c.starts_in_contact = true;
  const Vec3 n1 = Vec3(0.0, 1.0, 1.0).normalized(), n2 = Vec3(0.0, -1.0, 1.0).normalized();
  const double a = c.friction * 5.0 * std::numbers::sqrt2;  // both sides press with 5/√2 N
  static constexpr double speed = 0.37;
  c.stop_s = speed / a;
  c.exact = [a, stop = c.stop_s](double t) {
    CaseState s;
    const double u = std::min(t, stop);
    s.q.x() = speed * u - 0.5 * a * u * u;
    if (t < stop) s.v.x() = speed - a * t;
    s.f = Vec3(t < stop ? -a : 0.0, 0.0, 5.0);
    return s;
  };
  c.surfaces.push_back({Vec3::Zero(), n1, 0.0});
  c.surfaces.push_back({Vec3::Zero(), n2, 0.0});
  c.world = [n1, n2, mu = c.friction] {
    std::vector<models::Face> faces;
    faces.push_back({models::FlatSurface<3>(Vec3::Zero(), n1), mu, 0, 0});
    faces.push_back({models::FlatSurface<3>(Vec3::Zero(), n2), mu, 1, 0});
    return std::make_unique<models::PlaneComposition>(std::move(faces));
  };
  return c;
}

ErrorCase viscous() {
  ErrorCase c{.name = "viscous", .title = "into a viscous region", .duration_s = 0.6};
  static constexpr double from = -0.0317, speed = 0.4, b = 8.0, F = 1.0;
  c.force.constant = {F, 0.0, 0.0};
  c.medium_Ns_per_m = b;
  const double enters = -speed + std::sqrt(speed * speed - 2.0 * from * F), fast = speed + F * enters;
  c.exact = [enters, fast](double t) {
    CaseState s;
    if (t < enters) {
      s.q.x() = from + speed * t + 0.5 * F * t * t;
      s.v.x() = speed + F * t;
    } else {
      const double u = t - enters, e = std::exp(-b * u);
      s.q.x() = F / b * u + (fast - F / b) * (1.0 - e) / b;
      s.v.x() = F / b + (fast - F / b) * e;
      s.f.x() = -b * s.v.x();
    }
    return s;
  };
  c.world = [] {
    std::vector<models::Medium> media;
    media.push_back({b, 0.0, std::make_unique<models::PlaneObstacle>(Vec3::Zero(), Vec3(-Vec3::UnitX()), 0.0)});
    return std::make_unique<models::Media<3>>(free_space(), std::move(media));
  };
  return c;
}

// The exact motion obeys M ẍ + D_h ẋ + K_h (x − x_int) = 0 until the proxy hits the wall. Its solution is the matrix
// exponential of two states in closed form.
ErrorCase hand_wall() {
  ErrorCase c{.name = "hand_wall", .title = "a hand pushes against a wall", .mass_kg = 2.0, .duration_s = 0.4};
  static constexpr double K = 500.0, D = 20.0, x0 = 0.03, target = -0.02;
  c.force.hand_stiffness_N_per_m = K;
  c.force.hand_damping_Ns_per_m = D;
  c.force.intention_m = {0.0, 0.0, target};
  const double s = D / (2.0 * c.mass_kg), w = std::sqrt(K / c.mass_kg - s * s), y0 = x0 - target;
  const auto free = [s, w, y0](double t) {
    const double e = std::exp(-s * t), cos = std::cos(w * t), sin = std::sin(w * t);
    return std::pair{target + y0 * e * (cos + s / w * sin), -y0 * e * (s * s / w + w) * sin};
  };
  double low = 0.0, high = std::numbers::pi / w;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (free(middle).first > 0.0 ? low : high) = middle;
  }
  c.stop_s = high;
  c.exact = [free, hit = c.stop_s](double t) {
    CaseState state;
    if (t < hit) {
      const auto both = free(t);
      state.q.z() = both.first;
      state.v.z() = both.second;
    } else {
      state.f.z() = -K * target;
    }
    return state;
  };
  c.surfaces.push_back({});
  c.world = [] { return std::make_unique<models::Plane<3>>(Vec3::Zero(), Vec3::UnitZ()); };
  return c;
}

}  // namespace

std::vector<ErrorCase> error_cases() {
  std::vector<ErrorCase> cases;
  cases.push_back(free_constant());
  cases.push_back(free_sine());
  cases.push_back(impact());
  cases.push_back(slide());
  cases.push_back(stick_slip());
  cases.push_back(geodesic());
  cases.push_back(pendulum());
  cases.push_back(groove());
  cases.push_back(viscous());
  cases.push_back(hand_wall());
  return cases;
}

}  // namespace proxarm::studies
