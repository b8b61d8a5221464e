// A simulated person who pushes the arm as `proxarm prove` asks.
//
// `proxarm sim` doesn't know what the controller asks the person to do, so the helper watches the arm: during a proof,
// the arm stands longer than elsewhere when it waits for a push. The pushes are along x, y and then x of W
// (controller/proof/proof.hpp, Station). Each time that all drives are enabled and the arm has stood for wait_ns, the
// helper leans on the handle for lean_ns. A drive that goes off ends this; the next proof begins again. In sessions
// other than a proof, the pushes come at wrong times.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/physics/clamp.hpp"
#include "sim/physics/plant.hpp"

namespace proxarm::sim {

// A push of 15 N along a unit vector of W, by a person leaning on a handle at from_W. Less if the handle yields.
[[nodiscard]] Clamp leaning(const models::Vec3& from_W, const models::Vec3& along_W) noexcept;

class ProofHelper {
 public:
  // A proof reads a station within 0.7 s, asks for a push 0.4 s later, and uses 0.6 s of the push.
  static constexpr std::int64_t wait_ns = 2'000'000'000, lean_ns = 2'000'000'000;

  // The plant must outlive it.
  explicit ProofHelper(Plant& plant);

  // Call every few milliseconds; allocates nothing.
  void on_time(std::int64_t time_ns) noexcept;

 private:
  [[nodiscard]] bool enabled() const noexcept;
  [[nodiscard]] bool was_moved() noexcept;
  void lean(std::int64_t time_ns) noexcept;
  void let_go(std::int64_t time_ns) noexcept;

  Plant& plant_;
  std::vector<std::int32_t> demand_counts_;
  std::int64_t since_ns_ = 0;  // start of the present standstill or push
  int pushes_ = 0;             // since the drives were enabled
  bool leans_ = false;
};

}  // namespace proxarm::sim
