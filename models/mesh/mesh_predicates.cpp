#include "models/mesh/mesh_predicates.hpp"

#include <array>
#include <cmath>
#include <limits>

namespace proxarm::models {
namespace {

constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();

// A rounded sum or product, and its rounding error: high + low is the exact result.
struct Pair {
  double high, low;
};

Pair exact_sum(double a, double b) noexcept {
  const double x = a + b, b_part = x - a, a_part = x - b_part;
  return {x, (a - a_part) + (b - b_part)};
}

Pair exact_product(double a, double b) noexcept {
  // Dekker's method: splits a and b into halves of 26 bits, whose products are exact. (Not every machine has a fused
  // multiply-add.)
  constexpr double split = 134217729.0;  // 2²⁷ + 1
  const double x = a * b;
  const double a_big = split * a, a_high = a_big - (a_big - a), a_low = a - a_high;
  const double b_big = split * b, b_high = b_big - (b_big - b), b_low = b - b_high;
  return {x, a_low * b_low - (((x - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}

// An exact sum as Shewchuk's expansion: doubles that don't overlap, the smallest first, without zeros. The last double
// has the sign of the sum.
template <std::size_t Most>
class ExactSum {
 public:
  void add(double value) noexcept {
    std::size_t kept = 0;
    double carry = value;
    for (std::size_t i = 0; i < count_; ++i) {
      const Pair s = exact_sum(carry, part_[i]);
      carry = s.high;
      if (s.low != 0.0) part_[kept++] = s.low;
    }
    if (carry != 0.0) part_[kept++] = carry;
    count_ = kept;
  }

  template <std::size_t Other>
  void add_product(const ExactSum<Other>& sum, double factor) noexcept {
    for (std::size_t i = 0; i < sum.count(); ++i) {
      const Pair product = exact_product(sum.part(i), factor);
      add(product.low);
      add(product.high);
    }
  }

  [[nodiscard]] int sign() const noexcept { return count_ == 0 ? 0 : (part_[count_ - 1] > 0.0 ? 1 : -1); }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] double part(std::size_t i) const noexcept { return part_[i]; }

 private:
  std::array<double, Most> part_;
  std::size_t count_ = 0;
};

// The vector b − a, exact: a pair of doubles for each coordinate.
struct ExactVector {
  std::array<Pair, 3> of;
  ExactVector(const Vec3& a, const Vec3& b) noexcept
      : of{exact_sum(b.x(), -a.x()), exact_sum(b.y(), -a.y()), exact_sum(b.z(), -a.z())} {}
};

// Returns v_i w_j − v_j w_i, exact.
ExactSum<16> minor_of(const ExactVector& v, const ExactVector& w, std::size_t i, std::size_t j) noexcept {
  ExactSum<16> sum;
  const auto add = [&sum](double a, double b) {
    const Pair product = exact_product(a, b);
    sum.add(product.low);
    sum.add(product.high);
  };
  const auto add_all = [&add](const Pair& a, const Pair& b, double sign) {
    add(sign * a.low, b.low);
    add(sign * a.low, b.high);
    add(sign * a.high, b.low);
    add(sign * a.high, b.high);
  };
  add_all(v.of[i], w.of[j], 1.0);
  add_all(v.of[j], w.of[i], -1.0);
  return sum;
}

int exact_orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) noexcept {
  const ExactVector v(a, b), w(a, c), d(a, x);
  ExactSum<192> sum;
  for (std::size_t k = 0; k < 3; ++k) {
    const ExactSum<16> minor = minor_of(v, w, (k + 1) % 3, (k + 2) % 3);
    sum.add_product(minor, d.of[k].low);
    sum.add_product(minor, d.of[k].high);
  }
  return sum.sign();
}

// Whether a segment and a triangle in one plane touch. Both are convex, so they are apart if and only if the line of a
// side of the triangle, or the line of the segment, separates them. The orientation of two points of a line, a third
// point beside the plane and a point x tells on which side of the line x is.
bool touches_in_plane(const Vec3& x, const Vec3& y, const std::array<Vec3, 3>& t) noexcept {
  Eigen::Index axis = 0;
  (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs().maxCoeff(&axis);
  const double size = (t[1] - t[0]).lpNorm<1>() + (t[2] - t[0]).lpNorm<1>() + 1e-3 * t[0].lpNorm<1>();
  Vec3 beside = t[0];
  beside[axis] += size;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &from = t[k], &to = t[(k + 1) % 3];
    const int own = orientation(from, to, beside, t[(k + 2) % 3]);
    if (own * orientation(from, to, beside, x) < 0 && own * orientation(from, to, beside, y) < 0) return false;
  }
  Vec3 beside_x = x;
  beside_x[axis] += size;
  const int s0 = orientation(x, y, beside_x, t[0]), s1 = orientation(x, y, beside_x, t[1]);
  const int s2 = orientation(x, y, beside_x, t[2]);
  return !(s0 != 0 && s0 == s1 && s1 == s2);
}

}  // namespace

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) noexcept {
  const Vec3 v = b - a, w = c - a, d = x - a;
  const double yz = v.y() * w.z(), zy = v.z() * w.y(), zx = v.z() * w.x(), xz = v.x() * w.z();
  const double xy = v.x() * w.y(), yx = v.y() * w.x();
  const double determinant = (yz - zy) * d.x() + (zx - xz) * d.y() + (xy - yx) * d.z();
  const double size = (std::abs(yz) + std::abs(zy)) * std::abs(d.x()) +
                      (std::abs(zx) + std::abs(xz)) * std::abs(d.y()) + (std::abs(xy) + std::abs(yx)) * std::abs(d.z());
  const double bound = (7.0 + 56.0 * u) * u * size;  // source: Shewchuk 1997, section 4.2
  if (determinant > bound) return 1;
  if (determinant < -bound) return -1;
  return exact_orientation(a, b, c, x);
}

bool collinear(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
  const Vec3 d = b - a, e = c - a;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Index j = (i + 1) % 3;
    const double m = d[i] * e[j], n = d[j] * e[i];
    // m − n has an error of at most 4 u (|m| + |n|): beyond twice that it is certainly not zero.
    if (std::abs(m - n) > 8.0 * u * (std::abs(m) + std::abs(n))) return false;
  }
  const ExactVector v(a, b), w(a, c);
  return minor_of(v, w, 0, 1).sign() == 0 && minor_of(v, w, 1, 2).sign() == 0 && minor_of(v, w, 2, 0).sign() == 0;
}

bool segment_touches_triangle(const Vec3& x, const Vec3& y, const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
  return segment_touches_triangle(x, y, orientation(a, b, c, x), orientation(a, b, c, y), a, b, c);
}

bool segment_touches_triangle(const Vec3& x, const Vec3& y, int side_x, int side_y, const Vec3& a, const Vec3& b,
                              const Vec3& c) noexcept {
  if (side_x == 0 && side_y == 0) return touches_in_plane(x, y, {a, b, c});
  if (side_x == side_y) return false;
  const int ab = orientation(x, y, a, b), bc = orientation(x, y, b, c);
  if (ab * bc < 0) return false;
  const int ca = orientation(x, y, c, a);
  return ab * ca >= 0 && bc * ca >= 0;
}

}  // namespace proxarm::models
