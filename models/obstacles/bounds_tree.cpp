#include "models/obstacles/bounds_tree.hpp"

namespace proxarm::models {

BoundsTree::BoundsTree(std::vector<Leaf> leaves) {
  if (leaves.empty()) return;
  nodes_.reserve(2 * leaves.size());
  build(leaves, 0, leaves.size());
}

std::uint32_t BoundsTree::build(std::vector<Leaf>& leaves, std::size_t begin, std::size_t end) {
  const auto at = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Bounds all{leaves[begin].bounds.low, leaves[begin].bounds.high};
  for (std::size_t i = begin; i < end; ++i) {
    all.low = all.low.cwiseMin(leaves[i].bounds.low);
    all.high = all.high.cwiseMax(leaves[i].bounds.high);
  }
  if (end - begin == 1) {
    nodes_[at] = {all, 0, 0, leaves[begin].index, true};
    return at;
  }
  Eigen::Index axis = 0;
  (all.high - all.low).maxCoeff(&axis);
  const std::size_t middle = (begin + end) / 2;
  const auto offset = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i); };
  std::nth_element(leaves.begin() + offset(begin), leaves.begin() + offset(middle), leaves.begin() + offset(end),
                   [axis](const Leaf& a, const Leaf& b) {
                     return a.bounds.low[axis] + a.bounds.high[axis] < b.bounds.low[axis] + b.bounds.high[axis];
                   });
  const std::uint32_t left = build(leaves, begin, middle);
  const std::uint32_t right = build(leaves, middle, end);
  nodes_[at] = {all, left, right, 0, false};
  return at;
}

}  // namespace proxarm::models
