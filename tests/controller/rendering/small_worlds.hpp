// Small 𝒢s for the tests of the integrators: written from the paper's equations, apart from those of models/.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::controller::testing {

using models::Contact;
using models::GeometricAlgorithm;
using models::Vec;

template <int N>
class OneContact : public GeometricAlgorithm<N> {
 public:
  std::span<const Contact<N>> contacts() const noexcept override { return {contact_.data(), count_}; }

 protected:
  void touch(const Vec<N>& normal, bool slips) {
    contact_[0].normal = normal;
    contact_[0].slips = slips;
    count_ = 1;
  }
  void release() { count_ = 0; }

 private:
  std::array<Contact<N>, 1> contact_{};
  std::size_t count_ = 0;
};

template <int N>
class Nothing : public GeometricAlgorithm<N> {
 public:
  Vec<N> operator()(double /*K*/, const Vec<N>& p, const Vec<N>& /*q*/) noexcept override { return p; }
};

// (2) for μ = 0, (4) for μ > 0; the half-space below n·x = offset is solid.
template <int N>
class Wall : public OneContact<N> {
 public:
  Wall(const Vec<N>& n, double mu, double offset = 0.0) : n_(n.normalized()), mu_(mu), offset_(offset) {}

  Vec<N> operator()(double /*K*/, const Vec<N>& p, const Vec<N>& q) noexcept override {
    const double height = n_.dot(p) - offset_;
    if (height > 0.0) {
      this->release();
      return p;
    }
    const Vec<N> p_sf = p - height * n_;
    if (mu_ == 0.0) {
      this->touch(n_, false);
      return p_sf;
    }
    const Vec<N> q_sf = q - (n_.dot(q) - offset_) * n_;
    const Vec<N> slide = p_sf - q_sf;
    if (slide.norm() <= -mu_ * height) {
      this->touch(n_, false);
      return q_sf;
    }
    this->touch(n_, true);
    return p_sf + mu_ * height * slide / slide.norm();
  }

 private:
  Vec<N> n_;
  double mu_, offset_;
};

// (3), which reports no contacts.
template <int N>
class DryFriction : public GeometricAlgorithm<N> {
 public:
  explicit DryFriction(double F) : F_(F) {}

  Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept override {
    const Vec<N> d = p - q;
    return d.norm() > F_ / K ? Vec<N>(p - F_ / K * d / d.norm()) : q;
  }

 private:
  double F_;
};

// Inside of a frictionless ball around the origin.
template <int N>
class InsideBall : public OneContact<N> {
 public:
  explicit InsideBall(double R) : R_(R) {}

  Vec<N> operator()(double /*K*/, const Vec<N>& p, const Vec<N>& /*q*/) noexcept override {
    const double r = p.norm();
    if (r < R_) {
      this->release();
      return p;
    }
    this->touch(-p / r, false);
    return p * (R_ / r);
  }

 private:
  double R_;
};

// Solid between x = −thickness and 0; entered from where q is. Thin walls are what a step must not jump over.
template <int N>
class Slab : public OneContact<N> {
 public:
  explicit Slab(double thickness) : thickness_(thickness) {}

  Vec<N> operator()(double /*K*/, const Vec<N>& p, const Vec<N>& q) noexcept override {
    const bool above = q[0] > -0.5 * thickness_;
    Vec<N> r = p;
    if (above ? p[0] > 0.0 : p[0] < -thickness_) {
      this->release();
      return r;
    }
    r[0] = above ? 0.0 : -thickness_;
    this->touch(above ? Vec<N>::Unit(0) : Vec<N>(-Vec<N>::Unit(0)), false);
    return r;
  }

 private:
  double thickness_;
};

// Gives back what a broken world might.
template <int N>
class Broken : public GeometricAlgorithm<N> {
 public:
  Vec<N> operator()(double /*K*/, const Vec<N>& /*p*/, const Vec<N>& /*q*/) noexcept override {
    return Vec<N>::Constant(std::numeric_limits<double>::quiet_NaN());
  }
};

}  // namespace proxarm::controller::testing
