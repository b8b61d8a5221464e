// Whether a step whose contacts gave energy did so by going over an edge.
//
// Over an edge the normal turns at once, and the force of the step's end, λn, counts for all of the way s from q, also
// for what lay before the edge, where n₀ᵀs = 0 and nᵀs > 0. That is of the first order in s, and so is what a tool gets
// that springs from a place by a fault of the step. The way tells them apart. p̂ comes straight from q, and with each
// part of its way, p̂(σ) = q + σ (p̂ − q), the step has a pose r(σ) and forces f(σ). Between two of them, a and b,
//
//   nᵀ(x(b) − x(a)) ≤ what the normal's turn and the surface's bend allow of the way from r(a) to r(b)
//
// holds for each contact that presses at r(b), where no edge is between them: it either pressed at r(a), with a gap of
// 0 at both, or came down to its feature since. It also holds for a whole jump from next before an edge, r⁻, to next
// behind it, r⁺: in r⁻ the place lies on the edge, and so on what is behind it. Its gap there is 0 at both,
// nᵀ(x⁺ − x⁻) = 0, and whatever else lets the tool go or comes to hold it meanwhile, its gap is 0 at r⁺ if it presses,
// and was not below before. (So without friction the tool's potential ½‖r − p̂‖²_K falls by ½‖r⁺ − r⁻‖²_K or more.) Thus
// what the forces push forward by, f_n nᵀ(x(b) − x(a)), summed over smaller and smaller parts, goes to zero, but for
// places where the tool springs: there it stays. Those may give what curvature_J() says of the step, no more. That
// leaves a step the choice where two solutions are next to each other: it may come over an edge from d before it, by
// d sin α, which of replay 2679357126334080, step 23, is a micrometre of 1.9 mm. Where poses on the way take now the
// one and now the other (7836632257535979, step 214), parts may leave out those in between.
//
// Friction is against the slip since q, by which it takes energy; what part of it a place comes back in a jump says
// nothing. Nor does a pose for which no forces are found, from q and from the pose before it: parts are those between
// the others.
#pragma once

#include <vector>

#include "controller/studies/stress/tool_laws.hpp"

namespace proxarm::studies {

class ToolParts {
 public:
  // `fresh`: a world that knows of no step. Precondition: the laws and it outlive this.
  ToolParts(const ToolLaws& laws, const models::PoseAlgorithm& fresh) : laws_(laws), fresh_(fresh) {}

  // Whether what is pushed forward in the parts is no more than curvature may give. What touched on the way, at each
  // eighth at least, is added. `short_m`: of gaps at q.
  [[nodiscard]] bool keep(const ToolCall& call, double short_m, std::vector<models::PoseContact>& touched) const;

 private:
  struct Pose {
    double share;
    ToolCall call;
    double short_m;
  };
  struct Part {  // between two poses
    double pushed_J;
    bool divides;
  };
  // Of a step from a pose.
  [[nodiscard]] Pose pose_at(const ToolCall& call, double share, const models::ToolPose& from) const;
  [[nodiscard]] double pushed_J(const Pose& from, const Pose& to) const;
  // Of all divisions by some of the poses, from the first to the last.
  [[nodiscard]] double least_J(const std::vector<Pose>& poses) const;

  const ToolLaws& laws_;
  const models::PoseAlgorithm& fresh_;
};

}  // namespace proxarm::studies
