// Tests whether the contacts that a 𝒢 reports can exert the 𝒢's force. Used by `proxarm check`, the stress study and
// the contract tests; the cycle doesn't use it.
//
// By (17), the force f = K (r − p) must be a sum of forces, one per contact. The force of a sticking contact is in its
// friction cone. The force of a slipping contact is on the line of the friction cone that opposes the slip N Nᵀ (r −
// q). in_sum_of_cones (cone_sum.hpp) tests this. The caller chooses the tolerance for rounding.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/cone_sum.hpp"

namespace proxarm::models {

// Returns the factor by which contacts amplify rounding: 4 for a single contact; for several contacts 4 over the
// smallest sine of the angle between two of their normals, at most 4e8.
template <int N>
double rounding_amplification(std::span<const Contact<N>> contacts) {
  double least = 1.0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double cos = contacts[i].normal.dot(contacts[j].normal);
      least = std::min(least, std::sqrt(std::max(0.0, 1.0 - cos * cos)));
    }
  }
  return 4.0 / std::max(least, 1e-8);
}

// Returns the largest distance (m) that the proxy slid along a contact that is reported to stick. This finds a proxy
// that creeps along a wall; the test of the cones doesn't find it, because (17) lets a sticking contact exert any force
// of its cone. Skips contacts without friction, contacts with unknown friction, and contacts with Contact::reached. The
// arguments are those of cones_of_contacts().
template <int N, typename Friction, typename Motion>
double creep_m(std::span<const Contact<N>> contacts, Friction friction, Motion motion) {
  double most = 0.0;
  for (const Contact<N>& contact : contacts) {
    const std::optional<double> mu = friction(contact);
    if (contact.slips || contact.reached || !mu || !(*mu > 0.0)) continue;
    const Vec3 n = lift<N>(contact.normal), moved = motion(contact);
    most = std::max(most, (moved - n * n.dot(moved)).norm());
  }
  return most;
}

// Returns, for each contact, the cone of the forces that the contact can exert.
//   size_m                the size of the coordinates of r and q, which determines their rounding
//   friction(contact)     returns μ, or nullopt if μ is unknown: then any force that doesn't pull is accepted
//   motion(contact)       returns r − q in 3D relative to the contact's object: a moving object carries q along
//   slipping(μ, angle)    is called for each slipping contact; because of the rounding of r and q, the direction of the
//                         slip, and so of the force, is uncertain by `angle` (rad)
// If this direction is uncertain by more than 1e-3 rad, the contact counts as sticking and gets its whole cone.
template <int N, typename Friction, typename Motion, typename Slipping>
std::vector<ForceCone> cones_of_contacts(std::span<const Contact<N>> contacts, double size_m, Friction friction,
                                         Motion motion, Slipping slipping) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  constexpr double nearly_a_half_space = 1e6;
  std::vector<ForceCone> cones;
  for (const Contact<N>& contact : contacts) {
    const Vec3 n = lift<N>(contact.normal);
    const std::optional<double> known = friction(contact);
    if (!known) {
      cones.push_back({n, nearly_a_half_space});
      continue;
    }
    const double mu = *known;
    const Vec3 moved = motion(contact);
    const Vec3 v = moved - n * n.dot(moved);
    const double angle = 16.0 * epsilon * size_m / v.norm();
    if (contact.slips && angle < 1e-3) {
      cones.push_back({(n - mu * v.normalized()).normalized(), 0.0});
      slipping(mu, angle);
    } else {
      cones.push_back({n, mu});
    }
  }
  return cones;
}

}  // namespace proxarm::models
