// Whether a step whose contacts gave energy did so by going over an edge.
//
// Over an edge the normal turns at once, and the force of the step's end, λn, counts for all of the way s from q, also
// for what lay before the edge, where n₀ᵀs = 0 and nᵀs > 0. That is of the first order in s, and so is what a tool gets
// that springs from a place by a fault of the step. The way tells them apart. p̂ comes straight from q, and a tool that
// follows it, p̂(σ) = q + σ (p̂ − q), has poses r(σ) and forces f(σ), each found from the pose before it. Between two of
// them, a and b,
//
//   nᵀ(x(b) − x(a)) ≤ what the normal's turn and the surface's bend allow of the way from r(a) to r(b)
//
// holds for each contact that presses at r(b), where no edge is between them: it either pressed at r(a), with a gap of
// 0 at both, or came down to its feature since. It also holds for a whole jump from next before an edge, r⁻, to next
// behind it, r⁺: in r⁻ the place lies on the edge, and so on what is behind it. Its gap there is 0 at both,
// nᵀ(x⁺ − x⁻) = 0, and whatever else lets the tool go or comes to hold it meanwhile, its gap is 0 at r⁺ if it presses,
// and was not below before. (So without friction the tool's potential ½‖r − p̂‖²_K falls by ½‖r⁺ − r⁻‖²_K or more.) Thus
// what the forces push forward by, f_n nᵀ(x(b) − x(a)), summed over smaller and smaller parts, goes to zero, but for
// places where the tool springs: there it stays. Those may give what curvature_J() says of the step, no more.
//
// A step asks the world at p̂ alone, and next to an edge it may have several solutions there. An edge of the tool that
// comes onto a vertex lies on it for a part of the way, from 0.62 to 0.72 in replay 5530763864440370, step 74; from q a
// place up to 51 µm beyond is found all along that part, or no forces (1126755579853460, step 435). So a pose of the
// way goes on from the one before, not from q. And at p̂ the tool that follows may come to another solution than the
// step did (54327521292900, step 25, with 0.19 mm between them). Both keep the law; the energy that a step may get at
// an edge is what it gets where its parts lead. So the step's end, too, must push forward since q by no more than that
// one does.
//
// Friction is against the slip, by which it takes energy; what part of it a place comes back in a jump says nothing.
// Nor does a pose for which no forces are found: parts are those between the others.
#pragma once

#include <vector>

#include "controller/studies/stress/tool_laws.hpp"

namespace proxarm::studies {

class ToolParts {
 public:
  // `fresh`: a world that knows of no step. Precondition: the laws and it outlive this.
  ToolParts(const ToolLaws& laws, const models::PoseAlgorithm& fresh) : laws_(laws), fresh_(fresh) {}

  // Whether what is pushed forward in the parts is no more than curvature may give. What touched on the way, at each
  // eighth at least where forces were found, is added. `short_m`: of gaps at q.
  [[nodiscard]] bool keep(const ToolCall& call, double short_m, std::vector<models::PoseContact>& touched) const;

 private:
  struct Pose {
    double share;
    ToolCall call;
    double short_m;
  };
  struct Sum {
    double all_J = 0.0, undivided_J = 0.0;  // of what can't be divided any more
    double most_J = 0.0, share = 0.0;       // the part that pushes most, and where to divide it
    std::size_t before = 0;                 // the pose that it begins at
  };
  // From the last of the poses on, to p̂.
  void follow(const ToolCall& call, const std::vector<double>& shares, std::vector<Pose>& way) const;
  [[nodiscard]] double pushed_J(const Pose& from, const Pose& to) const;
  // Of a way's parts, the last of which leads to the step's end, or to the way's where that one pushes since q by as
  // much or more.
  [[nodiscard]] Sum sum_of(const std::vector<Pose>& way, const std::vector<double>& shares, const ToolCall& call) const;

  const ToolLaws& laws_;
  const models::PoseAlgorithm& fresh_;
};

}  // namespace proxarm::studies
