// Assumption 1 as a tool: samples states of a 𝒢 and verifies what makes its forces make sense.
//
//   independent of K   if r = 𝒢(K, r − f/K, q), then r = 𝒢(κ, r − f/κ, q) for other κ too (Assumption 1)
//   within its laws    f is a sum of forces that the reported contacts can bear, as (17) says for each
//   rests where it is  𝒢(K, r, r) = r: r isn't inside of anything, and nothing pulls it
//   repeatable         the same arguments give the same point, whatever was asked before
//   finite             no NaN, no infinity
//
//   MyWorld g;                                                        // a 𝒢 of one's own, in three dimensions
//   const CheckReport report = check_algorithm<3>(g, {.centre = {0, 0, 0}, .size_m = 0.5}, {});
//   if (!report.passed()) std::puts(report.text().c_str());
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "models/geometric_algorithm.hpp"
#include "scenes/scene.hpp"

namespace proxarm::scenes {

struct CheckOptions {
  std::uint64_t seed = 1;
  std::int64_t states = 20'000;  // for each object, and for the whole
  double kappa_decades = 6.0;    // on either side of K
  // Of p below q, for any κ: deeper, curved worlds have several solutions. At most a tenth of the least radius.
  double deepest_m = 0.02;
  double several_allowed = 0.02;  // share of states in which κ may choose another of several solutions
};

// Where to look, and what is known of the world there.
template <int N>
struct CheckRegion {
  models::Vec<N> centre = models::Vec<N>::Zero();
  double size_m = 0.5;                            // half-width
  std::vector<models::Vec<N>> places{};           // points of the free space to look around; none: anywhere
  std::optional<std::vector<double>> friction{};  // μ by contact's object; unknown: forces must only not pull
  bool acts_without_contact = false;              // a field, a Coulomb medium or a guide
  // What viscous media add to the coupling at q: b/T, N/m. Their force isn't the contacts'.
  std::function<double(const models::Vec<N>& q)> viscous_N_per_m{};
  // A Coulomb medium: whether a proxy slips in it, and how little, is seen from a few thousandths of its way
  // (models/coulomb_step.hpp), so that rounding counts by their inverse.
  bool rubs = false;
  bool bends = false;  // a chain of pieces: near its corners another piece may be a solution too
  bool soft = false;   // an elastic layer: nothing rests in it without a force
};

struct CheckFigure {
  std::string what;
  double worst = 0.0;  // in parts of what rounding explains: up to 1 is fine
  std::int64_t failures = 0;
  std::string state;  // that gave the worst figure
};

struct CheckReport {
  std::string subject;
  std::int64_t states = 0, in_contact = 0, slipping = 0;
  std::int64_t several = 0;      // states with several solutions, counted apart
  std::int64_t unresolved = 0;   // where elastic layers share a force: states without an answer that all agree on
  double several_allowed = 0.0;  // of either, as a share of all states
  std::vector<CheckFigure> figures;

  [[nodiscard]] bool passed() const noexcept;
  [[nodiscard]] std::string text() const;  // a few lines for a person
};

template <int N>
CheckReport check_algorithm(models::GeometricAlgorithm<N>& g, const CheckRegion<N>& region,
                            const CheckOptions& options);
extern template CheckReport check_algorithm<1>(models::GeometricAlgorithm<1>&, const CheckRegion<1>&,
                                               const CheckOptions&);
extern template CheckReport check_algorithm<2>(models::GeometricAlgorithm<2>&, const CheckRegion<2>&,
                                               const CheckOptions&);
extern template CheckReport check_algorithm<3>(models::GeometricAlgorithm<3>&, const CheckRegion<3>&,
                                               const CheckOptions&);

// Each object alone (of a scene of several), then all together. Objects that move are looked at as they stand at time
// 0.
std::vector<CheckReport> check_scene(const Scene& scene, const CheckOptions& options = {});

}  // namespace proxarm::scenes
