// How several obstacles share the force on the proxy if some of them are elastic.
//
// A rigid contact fixes the proxy's position, so at most three matter (world.cpp). An elastic layer relates force to
// depth, and any number of layers may press at once. So the force f = K (r − p) is shared:
//   f = Σ f_i,   r = 𝒢_i(K, r − f_i/K, q)   for each i,
// where 𝒢_i is the step of obstacle i alone (Obstacle::step). Each contact is thus the paper's single contact, with the
// other forces added to p. By Assumption 1, a solution r, f_i for one K solves the equations for all K.
//
// On tangent planes 𝒢_i is (4) with a layer: piecewise smooth, with kinks where a contact starts to touch, to slip or
// to reach its core. A semismooth Newton method (L. Qi and J. Sun, "A nonsmooth version of Newton's method",
// Mathematical Programming 58, 1993) solves the equations, from one nonlinear Gauss–Seidel sweep. If Newton's steps
// don't reduce the residual, more sweeps follow, then other stiffnesses in place of K. For curved surfaces this repeats
// on the tangent planes at each solution until it settles (settling.hpp). A solution counts only if every 𝒢_i itself
// confirms it.
#pragma once

#include <array>
#include <cstddef>

#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

struct SharedSupport {
  static constexpr std::size_t most = 12;
  std::array<const Obstacle*, most> obstacle{};
  std::array<Obstacle::Step, most> step{};  // in: each obstacle's step alone; out: with its share of force; touches: it
                                            // presses
  std::size_t count = 0;
  Vec3 r = Vec3::Zero();
  // What solve() may still spend, in units of about 40 ns; solve() deducts its cost. The whole budget is 0.4 ms. More
  // would endanger a cycle of 1 ms, so the set is then given up and counted as unresolved.
  static constexpr int whole_budget = 10'000;
  int budget = whole_budget;

  // Precondition: obstacle, step and count are set. Returns false if it found no forces that all obstacles confirm; r
  // is then meaningless.
  bool solve(double K, const Vec3& p, const Vec3& q) noexcept;
};

}  // namespace proxarm::models
