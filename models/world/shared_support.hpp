// How several obstacles share the force on the proxy where some of them are elastic: any number, each by its own law.
//
// A rigid contact says where the proxy is, so at most three of them matter (world.cpp). An elastic layer says how force
// and depth are related, and any number of layers may press at once. So here the force f = K (r − p) is shared out:
//   f = Σ f_i,   r = 𝒢_i(K, r − f_i/K, q)   for each i,
// where 𝒢_i is what obstacle i does alone (Obstacle::step). Each contact is thus the single contact that the paper
// solves, with the forces of the others added to p. By Assumption 1 of each 𝒢_i the equations in r and f_i hold for all
// K if they hold for one.
//
// On tangent planes 𝒢_i is (4) with a layer: piecewise smooth, with kinks where a contact starts to touch, to slip or
// to be pressed through. The equations are solved by a semismooth Newton method (L. Qi and J. Sun, "A nonsmooth version
// of Newton's method", Mathematical Programming 58, 1993). It starts from one nonlinear Gauss–Seidel sweep, in which
// each contact takes the latest forces of the others. Where Newton's steps don't reduce the residual, more sweeps
// follow, and then other stiffnesses in the place of K. The tangent planes of curved surfaces are taken again at the
// solution until it settles (settling.hpp). A solution is accepted only if every 𝒢_i itself confirms it.
#pragma once

#include <array>
#include <cstddef>

#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

struct SharedSupport {
  static constexpr std::size_t most = 12;
  std::array<const Obstacle*, most> obstacle{};
  std::array<Obstacle::Step, most> step{};  // in: of each obstacle alone; out: with its share (touches: it presses)
  std::size_t count = 0;
  Vec3 r = Vec3::Zero();
  // What solve() may still spend, in units of about 40 ns; it leaves what remains. The whole budget is 0.4 ms. A step
  // that needs more would endanger a cycle of 1 ms, so its set is given up and counted as unresolved.
  static constexpr int whole_budget = 10'000;
  int budget = whole_budget;

  // Precondition: obstacle, step and count are set. False if no forces were found that all obstacles confirm; r is
  // then meaningless.
  bool solve(double K, const Vec3& p, const Vec3& q) noexcept;
};

}  // namespace proxarm::models
