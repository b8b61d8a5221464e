// Which leaves of the tool's meshes are near which ones of objects', as far around a pose as it says. The list is made
// once for several gatherings of pairs, which ask less far around poses nearby.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "models/geometry/tool_pose.hpp"
#include "models/rigid_features/mesh_pairs.hpp"

namespace proxarm::models {

class NearLeaves {
 public:
  // For so many, of so many pairs of a part and an object. (Nothing is allocated later.)
  void make_room(std::size_t most, std::size_t pairs_of_meshes) {
    list_.resize(most);
    begins_.resize(pairs_of_meshes);
  }
  [[nodiscard]] bool has_room() const noexcept { return !list_.empty(); }

  void begin(const ToolPose& at, double reach) noexcept {
    at_ = at;
    reach_ = reach;
    all_ = true;
    count_ = meshes_ = 0;
  }
  void begin_with(std::uint16_t part, std::uint16_t entry) noexcept { begins_[meshes_++] = {part, entry, count_}; }
  // False where there is no room: then the list lacks something.
  bool add(const MeshPairs::Leaves& leaves) noexcept {
    if (count_ == list_.size()) return all_ = false;
    list_[count_++] = leaves;
    return true;
  }
  void forget() noexcept { all_ = false; }

  [[nodiscard]] bool all() const noexcept { return all_; }
  [[nodiscard]] const ToolPose& at() const noexcept { return at_; }
  [[nodiscard]] double reach() const noexcept { return reach_; }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] std::span<const MeshPairs::Leaves> of(std::uint16_t part, std::uint16_t entry) const noexcept {
    for (std::size_t k = 0; k < meshes_; ++k) {
      if (begins_[k].part != part || begins_[k].entry != entry) continue;
      const std::size_t end = k + 1 < meshes_ ? begins_[k + 1].first : count_;
      return std::span(list_).subspan(begins_[k].first, end - begins_[k].first);
    }
    return {};
  }

 private:
  struct Begin {
    std::uint16_t part = 0, entry = 0;
    std::size_t first = 0;
  };
  std::vector<MeshPairs::Leaves> list_;
  std::vector<Begin> begins_;
  std::size_t count_ = 0, meshes_ = 0;
  bool all_ = false;
  ToolPose at_;
  double reach_ = 0.0;
};

}  // namespace proxarm::models
