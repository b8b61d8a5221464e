// Solves for the forces of several obstacles on the proxy if some of the obstacles are elastic.
//
// A rigid contact fixes the proxy's position in one direction, so at most three rigid contacts matter (world.cpp). An
// elastic layer relates force to depth, so any number of layers may press at once. They share the force f = K (r − p):
//   f = Σ f_i,   r = 𝒢_i(K, r − f_i/K, q)   for each i.
// 𝒢_i is the step of obstacle i alone (Obstacle::step). So each contact is the paper's single contact, with the other
// contacts' forces added to p. By Assumption 1, a solution r, f_i for one K solves the equations for all K.
//
// The equations are solved as follows:
// 1. On tangent planes 𝒢_i is (4) with a layer. This is piecewise smooth: it has kinks where a contact starts to touch,
//    to slip or to reach its core.
// 2. A semismooth Newton method (L. Qi and J. Sun, "A nonsmooth version of Newton's method", Mathematical Programming
//    58, 1993) solves the equations. It starts after one nonlinear Gauss–Seidel sweep.
// 3. If Newton's steps don't reduce the residual, more sweeps follow, and then stiffnesses other than K.
// 4. For curved surfaces, steps 1 to 3 are repeated on the tangent planes at each solution until r settles
//    (settling.hpp).
// 5. A solution is accepted only if the step 𝒢_i of every obstacle itself confirms it.
#pragma once

#include <array>
#include <cstddef>

#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

struct SharedSupport {
  static constexpr std::size_t most = 12;
  std::array<const Obstacle*, most> obstacle{};
  // Before solve(): each obstacle's step alone. After solve(): each obstacle's step with its share of the force;
  // `touches` then says whether the obstacle presses.
  std::array<Obstacle::Step, most> step{};
  std::size_t count = 0;
  Vec3 r = Vec3::Zero();
  // The computing time that solve() may still use, in units of about 40 ns; solve() subtracts its cost. The whole
  // budget is 0.4 ms. More time would endanger a cycle of 1 ms. If the budget is used up, the set is given up and the
  // step counts as unresolved.
  static constexpr int whole_budget = 10'000;
  int budget = whole_budget;

  // Finds r and the forces. Precondition: obstacle, step and count are set. Returns false if it finds no forces that
  // all obstacles confirm; r is then meaningless.
  bool solve(double K, const Vec3& p, const Vec3& q) noexcept;
};

}  // namespace proxarm::models
