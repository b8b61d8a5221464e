#include "models/rigid_gaps/touch_search.hpp"

#include <algorithm>
#include <utility>

#include "models/rigid_gaps/deeper_touches.hpp"
#include "models/rigid_gaps/gaps.hpp"
#include "models/rigid_gaps/near_sides.hpp"

namespace proxarm::models {
namespace {

// Additional cost of a pair, in units of the cost of a pair of flat features (15 ns): for a cylinder and another body,
// for two cylinders, for two rims.
constexpr int kOfCylinder = 10, kOfTwoCylinders = 30, kRims = 600;

int extra_cost(PairKind kind) noexcept {
  if (kind == PairKind::rims) return kRims;
  return is_of_two_cylinders(kind) ? kOfTwoCylinders : is_of_cylinder(kind) ? kOfCylinder : 0;
}

}  // namespace

void TouchSearch::find(const ToolPose& pose, double within_m) noexcept {
  attempt_->looks_left -= static_cast<int>(candidates_->count);
  look_at_pairs(pose, within_m);
  const auto needs = [&](const Found& found) { return needs_others(found); };
  const std::span<const Found> all = std::as_const(*out_).all();
  if (out_->within_m < Touches::everywhere_m && std::any_of(all.begin(), all.end(), needs)) {
    look_at_pairs(pose, Touches::everywhere_m);
  }
  drop_deeper(*bodies_, *candidates_, view(pose), *out_);
}

// Whether far pairs must be looked at to decide whether this touch holds the tool. This is so for edges that cross
// behind each other, and for features that are further behind than within_m.
bool TouchSearch::needs_others(const Found& found) const noexcept {
  const PairKind kind = candidates_->pairs[found.pair].kind;
  return found.touch.gap < (kind == PairKind::edges ? -kGap_m : -out_->within_m);
}

void TouchSearch::look_at_pairs(const ToolPose& pose, double within_m) noexcept {
  out_->count = 0;
  out_->within_m = Touches::everywhere_m;
  Gaps gaps(*bodies_, *sides_);
  const View at_W = view(pose);
  std::uint16_t entry = static_cast<std::uint16_t>(bodies_->setup().first_moving);
  for (MovingEntry& m : bodies_->moving()) m.tool = bodies_->seen_from(entry++, at_W);
  // If the tool is behind a feature, the depth is at most the tool's motion since the sides were taken, when the tool
  // was outside. In addition, a foot may lie beside a feature.
  const FootReach& feet = attempt_->feet;
  const double near_m = within_m == Touches::everywhere_m ? Touches::everywhere_m
                                                          : bodies_->motion_m(pose, candidates_->gathered_at) +
                                                                bodies_->motion_m(pose, sides_->from()) + within_m +
                                                                std::max(feet.beside, feet.over) + kFront_m;
  for (std::size_t i = candidates_->first(*bodies_); i < candidates_->count; ++i) {
    const Pair& pair = candidates_->pairs[i];
    const MovingEntry* on = i < candidates_->still_count ? nullptr : &bodies_->moving(pair.entry);
    if (pair.barred || (on != nullptr && !on->close)) continue;
    if (on == nullptr && pair.apart_m > near_m && !pair.pressed) {
      out_->within_m = within_m;
      continue;
    }
    look_at(i, on == nullptr ? at_W : on->tool, on, pose, gaps);
  }
}

void TouchSearch::look_at(std::size_t index, const View& at, const MovingEntry* on, const ToolPose& pose,
                          Gaps& gaps) noexcept {
  Pair& pair = candidates_->pairs[index];
  const FootReach& feet = attempt_->feet;
  attempt_->looks_left -= extra_cost(pair.kind);
  if (is_flat_rim(pair.kind)) gaps.remember_lowest(pair, at);
  if (has_several_places(pair.kind)) {
    Gaps::Places places;
    const int count = gaps.touches_of(pair, at, feet.beside, places);
    for (int k = 0; k < count; ++k) add(places[static_cast<std::size_t>(k)], index, k, on, pose);
    return;
  }
  const std::size_t before = out_->count;
  if (const std::optional<Touch> touch = gaps.touch_of(pair, at, feet.beside)) add(*touch, index, 0, on, pose);
  if (out_->count > before && gaps.is_beyond_edge(pair, out_->found[before].touch.gap, at)) out_->count = before;
  if (out_->count > before || !pair.pressed || !(feet.over > beside_m)) return;
  const std::optional<Touch> over = gaps.touch_over(pair, at, feet);
  if (over) add(*over, index, 0, on, pose);
  if (out_->count > before) out_->found[before].over = true;
}

void TouchSearch::add(const Touch& touch, std::size_t index, int which, const MovingEntry* on,
                      const ToolPose& pose) noexcept {
  // A step that stays among the gathered pairs moves the tool by less than their reach.
  if (touch.gap > candidates_->gathered_reach_m) return;
  if (out_->count == Touches::most) {
    attempt_->overflow = true;
    return;
  }
  Found& found = out_->found[out_->count++];
  found.touch = touch;
  if (on != nullptr) {
    found.touch.point = on->mover.at() * touch.point;
    found.touch.normal = on->mover.at().R * touch.normal;
  }
  found.pair = static_cast<std::uint16_t>(index);
  found.which = static_cast<std::uint8_t>(which);
  found.working = found.over = false;
  const Pair& pair = candidates_->pairs[index];
  if (!is_along_side(pair.kind)) return;
  const PressedPlaces::Place* last = candidates_->pressed.of(found.pair, found.which);
  if (last != nullptr) stay_along_side(*bodies_, pair, pose, last->point_W, found.touch);
}

}  // namespace proxarm::models
