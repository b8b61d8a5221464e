// A world of one's own in the closed loop: a torus, without friction, which no scene file knows.
#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <limits>
#include <string>
#include <vector>

#include "controller/library/session.hpp"

using proxarm::Vec3;

// All points within `tube_m_` of a circle about the x axis through `centre_`.
class Torus final : public proxarm::OwnWorld {
 public:
  // 𝒢: the point outside of the torus that is nearest to p. It doesn't depend on K, so that Assumption 1 holds.
  Vec3 operator()(double /*K*/, const Vec3& p, const Vec3& q) noexcept override {
    pressed_ = distance_m(p) < 0.0;
    if (!pressed_) return p;
    const Vec3 on_circle = nearest_on_circle(p), way = p - on_circle;
    // a p exactly on the circle has no direction outwards: take the one in which q lies
    const Vec3 out = way.norm() > 0.0 ? way : Vec3(q - on_circle);
    contact_[0].normal = out.normalized();
    return on_circle + tube_m_ * contact_[0].normal;
  }
  // The contact that presses, for records and summary.
  [[nodiscard]] std::span<const proxarm::models::Contact<3>> contacts() const noexcept override {
    return {contact_.data(), pressed_ ? 1U : 0U};
  }
  [[nodiscard]] std::vector<std::string> objects() const override { return {"torus"}; }
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  [[nodiscard]] double distance_m(const Vec3& p) const noexcept { return (p - nearest_on_circle(p)).norm() - tube_m_; }

 private:
  [[nodiscard]] Vec3 nearest_on_circle(const Vec3& p) const noexcept {
    const Vec3 aside(0.0, p.y() - centre_.y(), p.z() - centre_.z());
    return centre_ + circle_m_ * (aside.norm() > 0.0 ? Vec3(aside.normalized()) : Vec3::UnitZ());
  }

  const Vec3 centre_{0.94, 0.0, 0.5};
  const double circle_m_ = 0.1, tube_m_ = 0.04;
  std::array<proxarm::models::Contact<3>, 1> contact_;
  bool pressed_ = false;
};

int main() try {
  Torus torus;
  proxarm::Session session({{"duration", 6.0}});
  double nearest_m = std::numeric_limits<double>::infinity();
  const proxarm::Summary summary = session.set_world(torus).run([&](const proxarm::CycleRecord& cycle) {
    nearest_m = std::min(nearest_m, torus.distance_m(proxarm::controller::vec3(cycle.proxy_W_m)));
  });
  std::printf("touched %d times, for %.2f s; the proxy was never nearer than %.1e m\n",
              static_cast<int>(summary.contacts), summary.contact_time_s, nearest_m);
  // Rounding of positions of a metre, a few operations.
  return summary.faults.empty() && summary.contacts > 0 && nearest_m > -1e-14 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
