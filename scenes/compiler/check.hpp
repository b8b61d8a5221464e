// Samples random states of a 𝒢 and checks Assumption 1 and the laws that its forces obey.
//
//   independent of K   if r = 𝒢(K, r − f/K, q), then r = 𝒢(κ, r − f/κ, q) for other κ too (Assumption 1)
//   within its laws    f is a sum of forces that the reported contacts can bear, as in (17)
//   rests where it is  𝒢(K, r, r) = r: r isn't inside an object, and no force pulls it
//   repeatable         the same arguments give the same point, independent of earlier steps
//   finite             no NaN, no infinity
//
//   MyWorld g;                                                        // your own 𝒢, in three dimensions
//   const CheckReport report = check_algorithm<3>(g, {.centre = {0, 0, 0}, .size_m = 0.5}, {});
//   if (!report.passed()) std::puts(report.text().c_str());
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
  std::int64_t states = 20'000;  // for each object, and for the whole scene
  double kappa_decades = 6.0;    // on either side of K
  // Largest depth of p below q, for any κ. check_scene() limits it to a tenth of the smallest radius: beyond, curved
  // worlds have several solutions.
  double deepest_m = 0.02;
  double most_s_per_state = 250e-6;  // average of real time; if states take longer, fewer are tried
  double several_allowed = 0.02;     // share of states with several or no solutions above which the verdict isn't fine
};

// Where to sample states, and properties of the world there.
template <int N>
struct CheckRegion {
  models::Vec<N> centre = models::Vec<N>::Zero();
  double size_m = 0.5;                            // half-width
  std::vector<models::Vec<N>> places{};           // free points to start from; empty: anywhere in the box
  std::optional<std::vector<double>> friction{};  // μ by object; nullopt: only checks that forces don't pull
  bool acts_without_contact = false;              // a field, a Coulomb medium or a guide
  // Stiffness that viscous media add to the coupling at q: b/T, N/m. Their force isn't a contact force.
  std::function<double(const models::Vec<N>& q)> viscous_N_per_m{};
  // There is a Coulomb medium. Whether the proxy sticks in it, and how far a short slip goes, is extrapolated from
  // samples at 4 % of the way to p or less (models/surfaces/coulomb_step.hpp), which amplifies rounding by the inverse
  // of that share.
  bool has_coulomb_medium = false;
  bool bends = false;    // there is a polyline: near a corner, a point on the other segment may also be a solution
  bool touches = false;  // states start at objects: without a contact there is no verdict
  bool soft = false;     // there is an elastic layer: nothing rests within it without a force
};

struct CheckFigure {
  std::string what;
  double worst = 0.0;  // largest error relative to the rounding allowance: up to 1 is fine
  std::int64_t failures = 0;
  std::string state;  // the state with the largest error
};

// several_solutions is no error: Coulomb's law may have several solutions, and the one found may depend on K. Also, the
// path over a mesh's faces may end elsewhere with another K, although Assumption 1 doesn't hold there.
enum class CheckVerdict : std::uint8_t { fine, several_solutions, untouched, wrong };

struct CheckReport {
  std::string subject;
  std::int64_t states = 0, in_contact = 0, slipping = 0;
  std::int64_t asked = 0;  // states requested; fewer were tried if states < asked
  double seconds = 0.0;
  bool expects_contact = false;                             // without a contact there is no verdict
  std::int64_t several = 0;                                 // states with several solutions
  std::int64_t ways = 0;                                    // states whose path over a mesh's faces depends on K
  std::int64_t unresolved = 0;                              // states without an answer that keeps all laws
  std::string several_state, ways_state, unresolved_state;  // the first of each
  double several_allowed = 0.0;                             // largest share of each among all states
  std::vector<CheckFigure> figures;

  [[nodiscard]] CheckVerdict verdict() const noexcept;
  [[nodiscard]] std::string text() const;  // a few lines for the user
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

// Checks each object alone, if there are several, and then all together. Moving objects are checked at rest, at time 0.
std::vector<CheckReport> check_scene(const Scene& scene, const CheckOptions& options = {});

}  // namespace proxarm::scenes
