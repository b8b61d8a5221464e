// Runs random worlds under random forces, and checks invariants at every step (the stress study).
//
// A run has a random world, a proxy of 1 g to 1 t, a timestep of 10 µs to 50 ms, order 1 or 2, forces up to 1e6 N
// (steady, noise, jumps, sines, random walks, towards an object), and 1000 steps. After each step, let q be the
// previous proxy as 𝒢 got it, r the new proxy, and f = κ(r − p̂). The invariants are:
//   finite          r and f are finite
//   inside          r is not inside an object (by more than rounding)
//   law             f lies in the sum of the reported contacts' friction cones, and friction is against the slip (17):
//                   no contact pulls, and no contact's force leaves the contact's cone
//   stiffness       𝒢(κ', r − f/κ', q) = r for another κ' (Assumption 1)
//   work            fᵀ(r − q) ≤ f_n ‖r − q‖²/(2R) on one convex surface of radius R, and fᵀ(r − q) ≤ 0 on flat and
//                   concave surfaces
// These steps are counted separately, and are no violations:
//   unresolved      𝒢 itself reports that it found no forces that keep all laws of contact (a squeeze, a jam)
//   several         another κ' gave another point that also obeys (17): Coulomb's law has several solutions there
//   edge            work on edges of boxes, cylinders and meshes, where R is 0
//   not judged      work with several contacts of which one is on a convex surface; with moving objects, which do work;
//                   with layers, which return energy; and at order 2 if 𝒢 starts from a point other than the proxy
// Rigid tools have their own runs (tool_run.hpp) and are judged by their own laws, but the invariants have the same
// names.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "controller/extras/studies/common/study.hpp"
#include "controller/extras/studies/stress/stress_run.hpp"

namespace proxarm::studies {

class Stress final : public Study {
 public:
  using Worlds = StressWorlds;
  static constexpr std::array<std::string_view, 6> worlds_names{"stress",        "stress_meshes", "stress_layers",
                                                                "stress_order2", "stress_tools",  "stress_moving"};
  explicit Stress(Worlds worlds = Worlds::all) : worlds_(worlds) {}

  std::string name() const override { return std::string(worlds_names[static_cast<std::size_t>(worlds_)]); }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;
  bool failed(const nlohmann::json& headline) const override;

  // Repeats one run by its seed. `text` gets the run's world, proxy and force, and each violation with its state.
  // Returns whether there was a violation.
  static bool replay(std::uint64_t run_seed, std::string& text, Worlds worlds = Worlds::all);

 private:
  Worlds worlds_;
};

// Returns the plot's title: the number of steps that broke a law, and of steps that weren't judged.
std::string stress_answer(const Table& table);

}  // namespace proxarm::studies
