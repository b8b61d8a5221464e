// The step among flat surfaces by brute force in long double, for tests: every set of contacts, every root.
//
// Shares no code with models/: laws are written out from (17) in vectors, roots are found by scanning and halving.
#pragma once

#include <Eigen/LU>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::tests {

using Real = long double;
using RVec = Eigen::Matrix<Real, 3, 1>;
using RMat = Eigen::Matrix<Real, 3, 3>;

struct ReferenceFace {
  RVec x, n;
  Real mu;
};

struct ReferenceSolution {
  RVec r;
  int contacts = 0;
};

class ExactReference {
 public:
  explicit ExactReference(std::vector<ReferenceFace> faces) : faces_(std::move(faces)) {
    for (auto& face : faces_) face.n.normalize();
  }

  // All solutions with the fewest contacts for which there is one; or all there are.
  std::vector<ReferenceSolution> solve(const RVec& p, const RVec& q, bool all = false) const {
    std::vector<ReferenceSolution> out;
    if (feasible(p)) return {{p, 0}};
    const std::size_t m = faces_.size();
    for (std::size_t i = 0; i < m; ++i) {
      RVec r;
      if (single(faces_[i], p, q, r) && feasible(r)) out.push_back({r, 1});
    }
    if (!out.empty() && !all) return out;
    for (std::size_t i = 0; i < m; ++i) {
      for (std::size_t j = i + 1; j < m; ++j) {
        for (const RVec& r : pair(faces_[i], faces_[j], p, q)) {
          if (feasible(r)) out.push_back({r, 2});
        }
      }
    }
    if (!out.empty() && !all) return out;
    for (std::size_t i = 0; i < m; ++i) {
      for (std::size_t j = i + 1; j < m; ++j) {
        for (std::size_t k = j + 1; k < m; ++k) {
          RMat N;
          N << faces_[i].n.transpose(), faces_[j].n.transpose(), faces_[k].n.transpose();
          if (std::abs(N.determinant()) < 1e-9L) continue;
          const RVec r = N.inverse() *
                         RVec(faces_[i].n.dot(faces_[i].x), faces_[j].n.dot(faces_[j].x), faces_[k].n.dot(faces_[k].x));
          if (feasible(r) && corner(i, j, k, r, p, q)) out.push_back({r, 3});
        }
      }
    }
    return out;
  }

 private:
  static constexpr Real zero_ = 1e-13L;  // inputs are doubles of about a metre

  bool feasible(const RVec& r) const {
    for (const auto& face : faces_) {
      if (face.n.dot(r - face.x) < -zero_) return false;
    }
    return true;
  }

  static bool single(const ReferenceFace& face, const RVec& p, const RVec& q, RVec& r) {
    const Real h = face.n.dot(p - face.x);
    if (h > 0) return false;
    const RVec p_sf = p - face.n * h, q_sf = q - face.n * face.n.dot(q - face.x), d = p_sf - q_sf;
    r = d.norm() <= -face.mu * h ? q_sf : RVec(p_sf + face.mu * h * d / d.norm());
    return true;
  }

  // v_i/‖v_i‖ of (17), or zero at rest.
  static RVec slip(const ReferenceFace& face, const RVec& r, const RVec& q) {
    const RVec v = (r - q) - face.n * face.n.dot(r - q);
    return v.norm() > zero_ ? RVec(v / v.norm()) : RVec(RVec::Zero());
  }

  static std::vector<RVec> pair(const ReferenceFace& a, const ReferenceFace& b, const RVec& p, const RVec& q) {
    const RVec c = a.n.cross(b.n);
    if (c.norm() < 1e-9L) return {};
    const RVec e = c / c.norm();
    RMat N;
    N << a.n.transpose(), b.n.transpose(), e.transpose();
    const RMat inverse = N.inverse();
    const auto at = [&](Real s) { return RVec(inverse * RVec(a.n.dot(a.x), b.n.dot(b.x), s)); };
    const Real s_q = e.dot(q), s_p = e.dot(p);
    // What is left of r − p along e when both contacts slip; their normal forces in f.
    const auto left = [&](Real s, bool use_a, bool use_b, Real f[2]) {
      const RVec r = at(s);
      RMat A;
      A.col(0) = a.n - (use_a ? a.mu : 0) * slip(a, r, q);
      A.col(1) = b.n - (use_b ? b.mu : 0) * slip(b, r, q);
      A.col(2) = e;
      const RVec x = A.inverse() * (r - p);
      f[0] = x[0];
      f[1] = x[1];
      return x[2];
    };
    std::vector<RVec> out;
    Real f[2];
    // At rest along e: a contact that came straight down bears friction up to μ f along e.
    const RVec at_q = at(s_q);
    const bool rests_a = slip(a, at_q, q).norm() == 0, rests_b = slip(b, at_q, q).norm() == 0;
    if (rests_a || rests_b) {
      const Real g = left(s_q, !rests_a, !rests_b, f);
      const Real reach = (rests_a ? a.mu * f[0] : 0) + (rests_b ? b.mu * f[1] : 0);
      if (f[0] >= -zero_ && f[1] >= -zero_ && std::abs(g) <= reach) out.push_back(at_q);
    }
    // Slipping: scan between rest and where p pulls.
    const int steps = 400;
    Real last_s = 0, last_g = 0;
    for (int k = 0; k <= steps; ++k) {
      // Finer towards rest, where the direction of slip turns.
      const Real s = s_q + (s_p - s_q) * std::pow(Real(10), -15 * (1 - Real(k) / steps));
      const Real g = left(s, true, true, f);
      if (k > 0 && (g <= 0) != (last_g <= 0)) {
        Real lo = last_s, hi = s, g_lo = last_g;
        for (int n = 0; n < 200; ++n) {
          const Real mid = (lo + hi) / 2, g_mid = left(mid, true, true, f);
          if ((g_mid <= 0) == (g_lo <= 0)) {
            lo = mid;
          } else {
            hi = mid;
          }
        }
        const Real g_end = left(hi, true, true, f);
        const bool crossing = std::abs(g_end) < 1e-9L;  // a pole changes sign too
        if (crossing && f[0] >= -zero_ && f[1] >= -zero_) out.push_back(at(hi));
      }
      last_s = s;
      last_g = g;
    }
    return out;
  }

  bool corner(std::size_t i, std::size_t j, std::size_t k, const RVec& r, const RVec& p, const RVec& q) const {
    RMat A;
    const std::size_t m[3] = {i, j, k};
    int at_rest = 0;
    for (int c = 0; c < 3; ++c) {
      const ReferenceFace& face = faces_[m[c]];
      const RVec v = slip(face, r, q);
      at_rest += v.norm() == 0 ? 1 : 0;
      A.col(c) = face.n - face.mu * v;
    }
    if (at_rest == 3) return true;  // all other sets have failed
    const RVec f = A.inverse() * (r - p);
    return at_rest > 0 || f.minCoeff() >= -zero_;
  }

  std::vector<ReferenceFace> faces_;
};

}  // namespace proxarm::tests
