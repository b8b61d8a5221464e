// What of meshes is near, of each pair of a part of the tool and an object, as far around a pose as it says. A list is
// made once for several looks, which ask less far around poses nearby.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "models/geometry/tool_pose.hpp"
#include "models/rigid_features/mesh_pairs.hpp"

namespace proxarm::models {

template <typename Item>
class NearList {
 public:
  using Items = std::span<const Item>;
  // For so many, of so many pairs of a part and an object. (Nothing is allocated later.)
  void make_room(std::size_t most, std::size_t pairs) {
    list_.resize(most);
    begins_.resize(pairs);
  }
  [[nodiscard]] bool has_room() const noexcept { return !list_.empty(); }

  void begin(const ToolPose& at, double reach) noexcept {
    at_ = at;
    reach_ = reach;
    all_ = true;
    count_ = pairs_ = 0;
  }
  void begin_with(std::uint16_t part, std::uint16_t entry) noexcept { begins_[pairs_++] = {part, entry, count_}; }
  // False where there is no room: then the list lacks something.
  bool add(const Item& item) noexcept {
    if (count_ == list_.size()) return all_ = false;
    list_[count_++] = item;
    return true;
  }
  void forget() noexcept { all_ = false; }

  [[nodiscard]] bool all() const noexcept { return all_; }
  [[nodiscard]] const ToolPose& at() const noexcept { return at_; }
  [[nodiscard]] double reach() const noexcept { return reach_; }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  // Nothing: of these two there is no list.
  [[nodiscard]] std::optional<Items> of(std::uint16_t part, std::uint16_t entry) const noexcept {
    for (std::size_t k = 0; k < pairs_; ++k) {
      if (begins_[k].part != part || begins_[k].entry != entry) continue;
      const std::size_t end = k + 1 < pairs_ ? begins_[k + 1].first : count_;
      return Items(list_).subspan(begins_[k].first, end - begins_[k].first);
    }
    return {};
  }

 private:
  struct Begin {
    std::uint16_t part = 0, entry = 0;
    std::size_t first = 0;
  };
  std::vector<Item> list_;
  std::vector<Begin> begins_;
  std::size_t count_ = 0, pairs_ = 0;
  bool all_ = false;
  ToolPose at_;
  double reach_ = 0.0;
};

using NearLeaves = NearList<MeshPairs::Leaves>;  // of the tool's mesh and of an object's
using NearTriangles = NearList<std::uint32_t>;   // of the one that is a mesh

}  // namespace proxarm::models
