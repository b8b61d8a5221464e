// A virtual world of one's own, against the installed package: the inside of a ball, without friction.
#include <cmath>
#include <cstdio>

#include "controller/proxies/admittance_proxy.hpp"
#include "models/geometry/geometric_algorithm.hpp"

using proxarm::controller::AdmittanceProxy;
using proxarm::controller::ProxyFault;
using proxarm::models::GeometricAlgorithm;
using proxarm::models::Vec3;

// The point of the ball nearest to p: thinking about geometry alone is all that it takes.
class InsideOfBall : public GeometricAlgorithm<3> {
 public:
  Vec3 operator()(double /*K*/, const Vec3& p, const Vec3& /*q*/) noexcept override {
    return p.norm() <= radius_m_ ? p : p * (radius_m_ / p.norm());
  }

 private:
  double radius_m_ = 0.1;
};

int main() {
  // A mass of 1 kg is pushed to the right with 5 N for a second at 1 kHz.
  InsideOfBall ball;
  AdmittanceProxy<3> proxy({.mass_kg = 1.0, .period_s = 1e-3}, ball);
  proxy.start({});
  for (int k = 0; k < 1000; ++k) {
    if (proxy.step(Vec3(5.0, 0.0, 0.0)) != ProxyFault::none) {
      return 1;
    }
  }
  std::printf("the proxy rests at x = %.6f m, the world pushes with %.6f N\n", proxy.q().x(), proxy.f().x());
  // Tolerances: rounding of positions near 0.1 m (1.4e-17 m), times M/T² = 1e6 N/m for the force, with room.
  return std::abs(proxy.q().x() - 0.1) < 1e-15 && std::abs(proxy.f().x() + 5.0) < 1e-9 ? 0 : 1;
}
