// Energies at the two ports of the loop; passivity.hpp has the equations.
#pragma once

namespace proxarm::controller {

// Energies in J since rendering began. They include the rotation of a tool that turns.
struct PortEnergies {
  double hand = 0.0;     // W_h
  double proxy = 0.0;    // W_p
  double world = 0.0;    // W_w
  double kinetic = 0.0;  // ½Mv² (+ ½Jω²) of the proxy, now
  double damping = 0.0;  // Σ T B v²: dissipated by the virtual damping, B_a included
  double added = 0.0;    // B_a's share of `damping`
};

}  // namespace proxarm::controller
