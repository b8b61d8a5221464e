// Samples random states of a 𝒢 and checks Assumption 1 and the laws that its forces must obey:
//
//   independent of K   if r = 𝒢(K, r − f/K, q), then r = 𝒢(κ, r − f/κ, q) for any other κ too (Assumption 1)
//   within its laws    f is a sum of forces that the reported contacts can exert, as in (17)
//   rests where it is  𝒢(K, r, r) = r: r isn't inside an object, and no force pulls at the proxy
//   repeatable         the same arguments give the same point, independent of earlier steps
//   finite             the result contains no NaN and no infinity
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

struct CheckOptions {
  std::uint64_t seed = 1;
  std::int64_t states = 20'000;  // number of states for each object, and for the whole scene
  double kappa_decades = 6.0;    // the range of κ extends by this many decades below and above K
  // Largest depth of p below q, for any κ. check_scene() limits it to a tenth of the smallest radius, because a deeper
  // p in a curved world can have several solutions.
  double deepest_m = 0.02;
  // Limit for the mean real time per state; if states take longer, fewer states are tried.
  double most_s_per_state = 250e-6;
  // Largest share of states with several or no solutions for which the verdict is still fine.
  double several_allowed = 0.02;
};

// Where to sample states, and which properties the world has there.
template <int N>
struct CheckRegion {
  models::Vec<N> centre = models::Vec<N>::Zero();
  double size_m = 0.5;                   // half the width of the box around `centre`
  std::vector<models::Vec<N>> places{};  // free points from which states start; empty: anywhere in the box
  // μ of each object; nullopt: only checks that forces don't pull.
  std::optional<std::vector<double>> friction{};
  bool acts_without_contact = false;  // there is a field, a Coulomb medium or a guide
  // Stiffness in N/m that viscous media add to the coupling at q: b/T. The force of these media isn't a contact force.
  std::function<double(const models::Vec<N>& q)> viscous_N_per_m{};
  // There is a Coulomb medium. Whether the proxy sticks in it, and how far a short slip goes, is extrapolated from
  // samples at 4 % or less of the way to p (models/surfaces/coulomb_step.hpp). The extrapolation amplifies rounding by
  // the inverse of that share.
  bool has_coulomb_medium = false;
  bool bends = false;    // there is a polyline; near a corner of it, a point on the other segment may be a solution too
  bool touches = false;  // states start at objects; without a contact there is no verdict
  bool soft = false;     // there is an elastic layer; nothing rests within it without a force
};

struct CheckFigure {
  std::string what;
  double worst = 0.0;  // largest error divided by the rounding allowance: up to 1 is fine
  std::int64_t failures = 0;
  std::string state;  // the state with the largest error
};

// several_solutions isn't an error, for two reasons. Coulomb's law may have several solutions, and which of them is
// found may depend on K. Over the faces of a mesh, the proxy's path may end at another place with another K, because
// Assumption 1 doesn't hold there.
enum class CheckVerdict : std::uint8_t { fine, several_solutions, untouched, wrong };

struct CheckReport {
  std::string subject;
  std::int64_t states = 0, in_contact = 0, slipping = 0;
  std::int64_t asked = 0;  // number of states requested; if it is larger than `states`, fewer were tried
  double seconds = 0.0;
  bool expects_contact = false;  // without a contact there is no verdict
  std::int64_t several = 0;      // number of states with several solutions
  std::int64_t ways = 0;         // number of states whose path over a mesh's faces depends on K
  std::int64_t unresolved = 0;   // number of states without an answer that obeys all laws
  std::string several_state, ways_state, unresolved_state;  // text of the first state of each of these three kinds
  double several_allowed = 0.0;  // largest share of all states that each of these three kinds may have
  std::vector<CheckFigure> figures;

  [[nodiscard]] CheckVerdict verdict() const noexcept;
  [[nodiscard]] std::string text() const;  // a few lines of text for the user
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

// Returns how deep the states of a scene's check push, m: at most options.deepest_m and a tenth of the least radius.
double deepest_push_m(const Scene& scene, const CheckOptions& options);

// If the scene has several objects, checks each object alone and then all objects together. Moving objects are checked
// at rest, at time 0.
std::vector<CheckReport> check_scene(const Scene& scene, const CheckOptions& options = {});

}  // namespace proxarm::scenes
