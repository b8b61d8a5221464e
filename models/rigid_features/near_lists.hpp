// Lists the leaves or triangles of meshes that are near each other, for each pair of a part of the tool and an object.
// A list is made for a pose and a reach. It then serves several searches with smaller reaches at poses nearby.
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
  // Allocates memory for `most` items and for `pairs` pairs of a part and an object. Nothing is allocated later.
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
  // Returns false if there is no room. The list is then incomplete: all() is false.
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
  // Returns the items of a part and an object; nullopt if there is no list of these two.
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

using NearLeaves = NearList<MeshPairs::Leaves>;  // a leaf of the tool's mesh and a leaf of an object's mesh
using NearTriangles = NearList<std::uint32_t>;   // triangles of the part or of the object, whichever is a mesh

}  // namespace proxarm::models
