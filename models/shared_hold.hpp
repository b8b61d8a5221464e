// What holds the proxy together with others where some of them are elastic: any number of obstacles, each by its own
// law.
//
// Sets of rigid contacts are solved on tangent planes (world.cpp). A layer is a contact whose force depends on how deep
// it is pressed, and any number of them may press at once. So here the force f = K (r − p) is shared out,
//   f = Σ f_i,   r = 𝒢_i(K, r − f_i/K, q)   for each i,
// with 𝒢_i what obstacle i does alone (Obstacle::step): each contact is the single one that the paper solves, seen with
// the others' forces held. In r and f no K is left (Assumption 1 of each 𝒢_i), so a solution for one K is one for all.
//
// On tangent planes 𝒢_i is (4), with its layer, and smooth where nothing starts to touch, to slip or to be pressed
// through: the equations are solved by Newton's method with those derivatives (semismooth: L. Qi and J. Sun, "A
// nonsmooth version of Newton's method", Mathematical Programming 58, 1993), from a sweep over all contacts, each with
// the latest forces of the others; where its steps lead nowhere, by more sweeps, and with other stiffnesses in the
// place of K. Curved surfaces' planes are taken again at the solution until it stays. What comes out is accepted if
// every 𝒢_i itself says so.
#pragma once

#include <array>
#include <cstddef>

#include "models/obstacle.hpp"

namespace proxarm::models {

struct SharedHold {
  static constexpr std::size_t most = 12;
  std::array<const Obstacle*, most> obstacle{};
  std::array<Obstacle::Step, most> step{};  // of each: alone, then with the others' forces held; touches: it presses
  std::size_t count = 0;
  Vec3 r = Vec3::Zero();
  // What may still be spent, in parts of some 40 ns; less is left afterwards. Whole cycles depend on it.
  static constexpr int whole_budget = 10'000;
  int budget = whole_budget;

  // False if no forces are found that all agree on; then r means nothing.
  bool solve(double K, const Vec3& p, const Vec3& q) noexcept;
};

}  // namespace proxarm::models
