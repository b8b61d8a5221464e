// A simulated person who pushes the arm when `proxarm prove` asks for it.
//
// `proxarm sim` doesn't know what the controller asks the person to do, so the helper watches the arm. In a proof, the
// arm stands longer than at any other time when it waits for a push. Whenever all drives are enabled and the arm has
// stood for wait_ns, the helper leans on the handle for lean_ns. The pushes are along x, y and then x of W
// (controller/extras/proof/proof.hpp, Station). If a drive goes off, the helper lets go; in the next proof it begins
// again with the first push. In a session without a proof, the pushes come at wrong times.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/physics/clamp.hpp"
#include "sim/physics/plant.hpp"

namespace proxarm::sim {

// Returns the push of a person who leans on a handle at from_W: 15 N along the unit vector along_W, less if the handle
// yields.
[[nodiscard]] Clamp leaning(const models::Vec3& from_W, const models::Vec3& along_W) noexcept;

class ProofHelper {
 public:
  // A proof needs 0.7 s to read a station, asks for a push 0.4 s later, and uses 0.6 s of the push.
  static constexpr std::int64_t wait_ns = 2'000'000'000, lean_ns = 2'000'000'000;

  // The plant must outlive the helper.
  explicit ProofHelper(Plant& plant);

  // Must be called every few milliseconds. Allocates nothing.
  void on_time(std::int64_t time_ns) noexcept;

 private:
  [[nodiscard]] bool enabled() const noexcept;
  [[nodiscard]] bool was_moved() noexcept;
  void lean(std::int64_t time_ns) noexcept;
  void let_go(std::int64_t time_ns) noexcept;

  Plant& plant_;
  std::vector<std::int32_t> demand_counts_;
  std::int64_t since_ns_ = 0;  // start of the current standstill or push
  int pushes_ = 0;             // number of pushes since the drives were enabled
  bool leans_ = false;
};

}  // namespace proxarm::sim
