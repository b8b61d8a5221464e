// The contract that every 𝒢 and every composition keeps; adding one is one line:
//
//   TEST(Contract, FrictionPlane3) { expect_contract<3>(FrictionPlane<3>(point, normal, 0.3), {.friction = {0.3}}); }
//
// At random states (K, p, q), with q reached by the 𝒢 itself:
//   finite        the result has no NaN and no infinity
//   repeatable    the same arguments give the same result, bit for bit, whatever was asked before
//   κ-independent Assumption 1, over twelve decades of κ
//   never inside  the result is where the world lets a proxy rest: 𝒢(K, r, r) = r
//   never pulls   f lies in the sum of the friction cones of the contacts that are reported
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <optional>
#include <sstream>
#include <vector>

#include "models/surfaces/contact_judge.hpp"
#include "models/surfaces/mechanistic_map.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::tests {

template <int N>
struct ContractOptions {
  std::uint64_t seed = 20070322;
  double states = 20'000;                          // at scale 1
  models::Vec<N> centre = models::Vec<N>::Zero();  // states are drawn around here
  double size_m = 1.0;                             // within this half-width
  double smallest_depth_m = 1e-9;                  // ‖p − q‖ is drawn log-uniformly between this and size_m
  double kappa_decades = 6.0;                      // on either side of K
  double scene_m = 0.0;    // how far from the origin the world's own coordinates are, where states are nearer
  double condition = 1.0;  // multiplies the allowance for rounding
  double inside_tolerance_m = 1e-12;  // relative to a 1 m scene
  // μ of each contact by object index; a single entry stands for all. Empty: reported contacts aren't checked.
  std::vector<double> friction{};
  bool near_surface = false;  // q is brought to a surface, and p starts from there
  double reach_m = 1e300;     // κ is drawn so that ‖f‖/κ stays below this
  bool soft = false;          // a layer: a proxy in it doesn't rest without a force
  // Far steps among bodies with edges: friction that would hold a proxy beside the face that it enters holds it at the
  // face's edge, which counts as sticking though the proxy has slid there (models/obstacles/box_obstacle.hpp).
  bool slides_to_edges = false;
  bool forces_without_contact = false;  // a field or a layer acts on a proxy that touches nothing
  // Where Coulomb's law has several solutions (two faces that can jam, a proxy that flies far into a groove), the one
  // that is found may change with κ. A failure of Assumption 1 is counted apart, not hidden, if both results satisfy
  // (17) for each of their contacts; at most this share of all states may be of this kind.
  double several = 0.0;
  // States that fail Assumption 1 where the world itself counts that it found no complete set of contacts, as a share
  // of all: it then goes as far as a shorter step leads, which depends on K.
  double unresolved = 0.0;
};

template <int N>
std::string state_text(double K, const models::Vec<N>& p, const models::Vec<N>& q, const models::Vec<N>& r) {
  std::ostringstream text;
  text.precision(17);
  text << "K = " << K << ", p = [" << p.transpose() << "], q = [" << q.transpose() << "], r = [" << r.transpose()
       << "]";
  return text.str();
}

// The rounding of f = K (r − p): K times that of r and p, and its own.
template <int N>
double force_rounding(double K, const models::Vec<N>& p, const models::Vec<N>& q, const models::Vec<N>& r) {
  return 64.0 * std::numeric_limits<double>::epsilon() * K * (r.norm() + p.norm() + q.norm() + (r - p).norm());
}

// f = K (r − p) is a sum of forces that each contact can bear: of its friction cone if it sticks, of the cone's edge
// against N Nᵀ (r − q) if it slips (17).
template <int N>
testing::AssertionResult obeys_17(std::span<const models::Contact<N>> contacts, const ContractOptions<N>& options,
                                  double K, const models::Vec<N>& p, const models::Vec<N>& q, const models::Vec<N>& r) {
  double tolerance = options.condition * force_rounding<N>(K, p, q, r);
  for (const auto& contact : contacts) {
    const double length = contact.normal.norm();
    if (std::abs(length - 1.0) > 1e-14) return testing::AssertionFailure() << "normal of length " << length;
  }
  const auto friction = [&](const models::Contact<N>& contact) -> std::optional<double> {
    const auto object = static_cast<std::size_t>(contact.object);
    return N == 1 ? 0.0 : options.friction.size() == 1 ? options.friction[0] : options.friction.at(object);
  };
  const auto moved = [&](const auto& /*contact*/) { return models::lift<N>(models::Vec<N>(r - q)); };
  const double creep = models::creep_m<N>(contacts, friction, moved);
  if (!options.slides_to_edges && creep > options.condition * force_rounding<N>(1.0, p, q, r)) {
    return testing::AssertionFailure() << "slid by " << creep << " m where it sticks";
  }
  const std::vector<models::ForceCone> cones = models::cones_of_contacts<N>(
      contacts, r.norm() + q.norm(), friction, moved,
      [&](double mu, double angle) { tolerance += mu * K * (r - p).norm() * angle * options.condition; });
  if (models::in_sum_of_cones(models::lift<N>(K * (r - p)), cones, tolerance)) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "force outside what " << contacts.size() << " contacts can bear";
}

// Assumption 1 at a random κ. What Coulomb's law leaves open is counted in `several`.
template <int N>
testing::AssertionResult keeps_assumption_1(models::GeometricAlgorithm<N>& g, const ContractOptions<N>& options,
                                            Random& random, double K, const models::Vec<N>& p, const models::Vec<N>& q,
                                            const models::Vec<N>& r, std::int64_t& several) {
  using models::Vec;
  const Vec<N> f = K * (r - p);
  const double kappa = std::max(K * std::pow(10.0, random.uniform(-options.kappa_decades, options.kappa_decades)),
                                f.norm() / options.reach_m);
  const Vec<N> p_kappa = r - f / kappa, r_kappa = g(kappa, p_kappa, q);
  const double error = (r_kappa - r).norm();
  const double scene = 64.0 * std::numeric_limits<double>::epsilon() * options.scene_m * (1.0 + K / kappa);
  if (error <= options.condition * (models::map_9_rounding<N>(r, q, f, K, kappa) + scene)) {
    return testing::AssertionSuccess();
  }
  ++several;
  const std::vector<models::Contact<N>> other(g.contacts().begin(), g.contacts().end());
  if (options.several > 0.0 && obeys_17<N>(other, options, kappa, p_kappa, q, r_kappa)) {
    return testing::AssertionSuccess();
  }
  return testing::AssertionFailure() << "depends on K: κ = " << kappa << " gives [" << r_kappa.transpose()
                                     << "], off by " << error << " m";
}

template <int N>
void expect_contract(models::GeometricAlgorithm<N>&& g, const ContractOptions<N>& options = {}) {
  using models::Vec;
  Random random(options.seed);
  std::int64_t several = 0, pressed = 0, slipped = 0, unresolved = 0;
  const std::int64_t states = scaled(options.states);
  for (std::int64_t i = 0; i < states; ++i) {
    const double K = random.log_uniform(1.0, 1e7);
    const Vec<N> start = options.centre + random.in_box<N>(options.size_m);
    // A proxy is where the world let it go: half of them have slid there, half were resting where they are.
    Vec<N> q = g(K, start, options.centre + random.in_box<N>(options.size_m));
    if (random.chance(0.5)) q = g(K, start, start);
    if (options.near_surface) {
      // Flown at the origin of the states and back, half of them slid a little further.
      q = options.centre + 2.0 * random.direction<N>();
      q = g(K, options.centre + 0.3 * random.in_box<N>(1.0), g(K, q, q));
      if (random.chance(0.5)) q = g(K, q + options.size_m * random.direction<N>(), q);
    }
    const Vec<N> p = q + random.log_uniform(options.smallest_depth_m, options.size_m) * random.direction<N>();

    const std::uint64_t unresolved_before = g.unresolved_steps();
    const Vec<N> r = g(K, p, q);
    const auto state = [&] { return state_text<N>(K, p, q, r) + ", seed " + std::to_string(options.seed); };
    ASSERT_TRUE(r.allFinite()) << state();
    if (options.unresolved > 0.0 && g.unresolved_steps() != unresolved_before) {
      ++unresolved;
      continue;
    }
    const std::vector<models::Contact<N>> contacts(g.contacts().begin(), g.contacts().end());
    const Vec<N> f = K * (r - p);  // (1b)
    pressed += contacts.empty() ? 0 : 1;
    for (const auto& contact : contacts) slipped += contact.slips ? 1 : 0;

    if (contacts.empty() && !options.forces_without_contact) {
      ASSERT_LE(f.norm(), options.condition * force_rounding<N>(K, p, q, r)) << "force without contact; " << state();
    }
    if (!options.friction.empty()) {
      ASSERT_TRUE(obeys_17<N>(contacts, options, K, p, q, r)) << state();
    }

    const std::int64_t several_before = several;
    for (int k = 0; k < 4 && several == several_before; ++k) {
      const auto kept = keeps_assumption_1<N>(g, options, random, K, p, q, r, several);
      if (!kept && options.unresolved > 0.0 && g.unresolved_steps() != unresolved_before) {
        ++unresolved;
        --several;
        break;
      }
      ASSERT_TRUE(kept) << state();
    }

    if (!options.forces_without_contact && !options.soft) {
      const Vec<N> rest = g(K, r, r);
      ASSERT_LE((rest - r).norm(), options.inside_tolerance_m) << "inside; " << state();
    }
    const Vec<N> again = g(K, p, q);
    ASSERT_TRUE((again.array() == r.array()).all()) << "depends on what was asked before; " << state();
  }
  std::cout << "  " << states << " states, seed " << options.seed << ": " << pressed << " in contact, " << slipped
            << " slipping contacts, " << several << " with several solutions, " << unresolved
            << " where no set of contacts was complete\n";
  EXPECT_LE(static_cast<double>(unresolved),
            std::max(options.unresolved > 0.0 ? 3.0 : 0.0, options.unresolved * static_cast<double>(states)));
  // Three are no share at all where few states are asked for.
  EXPECT_LE(static_cast<double>(several), std::max(3.0, options.several * static_cast<double>(states)));
}

// Assumption 1 alone, along ways that go on from state to state: so cheap that a million states take seconds.
template <int N>
void expect_independent_of_K(models::GeometricAlgorithm<N>&& g, const ContractOptions<N>& options) {
  using models::Vec;
  Random random(options.seed);
  std::int64_t several = 0, pressed = 0, unresolved = 0;
  const std::int64_t states = scaled(1'000'000);
  Vec<N> q = options.centre;
  for (std::int64_t i = 0; i < states; ++i) {
    const double K = random.log_uniform(1.0, 1e7);
    if (i % 50 == 0) {
      q = options.centre + 2.0 * random.direction<N>();
      q = g(K, options.centre + 0.3 * random.in_box<N>(1.0), g(K, q, q));
    }
    const Vec<N> p = q + random.log_uniform(options.smallest_depth_m, options.size_m) * random.direction<N>();
    const std::uint64_t unresolved_before = g.unresolved_steps();
    const Vec<N> r = g(K, p, q);
    const bool contact = !g.contacts().empty();
    pressed += contact ? 1 : 0;
    const auto kept = keeps_assumption_1<N>(g, options, random, K, p, q, r, several);
    if (!kept && g.unresolved_steps() != unresolved_before) {
      ++unresolved;
    } else {
      ASSERT_TRUE(kept) << state_text<N>(K, p, q, r) << ", state " << i << ", seed " << options.seed;
    }
    q = r;
    if (contact) continue;
    // Free: half of the time back to a surface.
    if (random.chance(0.5)) q = g(K, options.centre + 0.3 * random.in_box<N>(1.0), r);
  }
  std::cout << "  " << states << " states, seed " << options.seed << ": " << pressed << " in contact, " << several
            << " with several solutions, " << unresolved << " where no set of contacts was complete\n";
  EXPECT_LE(static_cast<double>(unresolved),
            std::max(options.unresolved > 0.0 ? 3.0 : 0.0, options.unresolved * static_cast<double>(states)));
  EXPECT_GT(pressed, states / 10);
  EXPECT_LE(static_cast<double>(several), std::max(3.0, options.several * static_cast<double>(states)));
}

}  // namespace proxarm::tests
