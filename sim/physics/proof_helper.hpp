// Somebody beside the simulated arm who pushes as `proxarm prove` asks for it.
//
// The arm that is a process of its own doesn't hear what the controller asks a person for, so the helper goes by what a
// proof's arm does: it stands still for longer than elsewhere where a push is waited for, and the pushes are along x, y
// and then x of W (controller/proof/proof.hpp, Station). Each time that all drives have been enabled and the arm has
// stood for wait_ns, the helper leans on the handle for lean_ns. A drive that goes off ends it; the next proof begins
// anew. Whoever moves the arm otherwise is pushed at the wrong moments.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/physics/clamp.hpp"
#include "sim/physics/plant.hpp"

namespace proxarm::sim {

// 15 N along a unit vector of W, from somebody who leans on a handle that is at from_W. Less if the handle yields.
[[nodiscard]] Clamp leaning(const models::Vec3& from_W, const models::Vec3& along_W) noexcept;

class ProofHelper {
 public:
  // A proof reads a station within 0.7 s and asks for a push 0.4 s after that; it takes 0.6 s of a push.
  static constexpr std::int64_t wait_ns = 2'000'000'000, lean_ns = 2'000'000'000;

  // The plant must outlive it.
  explicit ProofHelper(Plant& plant);

  // To be called every few milliseconds; allocates nothing.
  void on_time(std::int64_t time_ns) noexcept;

 private:
  [[nodiscard]] bool enabled() const noexcept;
  [[nodiscard]] bool was_moved() noexcept;
  void lean(std::int64_t time_ns) noexcept;
  void let_go(std::int64_t time_ns) noexcept;

  Plant& plant_;
  std::vector<std::int32_t> demand_counts_;
  std::int64_t since_ns_ = 0;  // it has stood, or has been leant on
  int pushes_ = 0;             // since the drives were enabled
  bool leans_ = false;
};

}  // namespace proxarm::sim
