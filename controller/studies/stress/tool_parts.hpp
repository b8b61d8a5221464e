// Whether a step whose contacts gave energy did so by going over an edge.
//
// Over an edge the normal turns at once, and the force of the step's end, λn, counts for all of the way s from q, also
// for what lay before the edge, where n₀ᵀs = 0 and nᵀs > 0. That is of the first order in s, and so is what a tool gets
// that springs from a place by a fault of the step. The way tells them apart. p̂ comes straight from q, and with each
// part of its way, p̂(σ) = q + σ (p̂ − q), the step has a pose r(σ) and forces w(σ). For two of them
//
//   f_n nᵀ(x(b) − x(a)) ≤ what curvature_J() allows for the way from r(a) to r(b)
//
// holds for each contact that presses at r(b), where no edge is between them: it either pressed at r(a), with a gap of
// 0 at both, or came down to its feature since; its normal turns as the tool and the surface do. It also holds for a
// whole jump from next before an edge, r⁻, to next behind it, r⁺: in r⁻ the place lies on the edge, and so on what is
// behind it. Its gap there is 0 at both, nᵀ(x⁺ − x⁻) = 0, and whatever else lets the tool go or comes to hold it
// meanwhile, its gap is 0 at r⁺ if it presses, and was not below before. (So without friction the tool's potential
// ½‖r − p̂‖²_K falls by ½‖r⁺ − r⁻‖²_K or more.) Thus of the two halves of what doesn't keep the bound, the one without
// the edge does, and the other one, halved again, comes down to the jump: what is of the way before the edge shrinks
// with the part. A spring doesn't: it stays as large as it is in one of the halves, however small they are. Nor does a
// step that jumps over an edge from before it, by d sin α for a distance of d. Friction is against the slip since q, by
// which it takes energy; what part of it a place comes back in a jump says nothing.
//
// A pose on the way for which no forces are found says nothing: the step counts as one that has sprung.
#pragma once

#include <vector>

#include "controller/studies/stress/tool_laws.hpp"

namespace proxarm::studies {

class ToolParts {
 public:
  // `fresh`: a world that knows of no step. Precondition: the laws and it outlive this.
  ToolParts(const ToolLaws& laws, const models::PoseAlgorithm& fresh) : laws_(laws), fresh_(fresh) {}

  // Whether each part of the step keeps the bound, halved as often as it takes; what touched on the way is added.
  // `short_m`: of gaps at q.
  [[nodiscard]] bool keep(const ToolCall& call, double short_m, std::vector<models::PoseContact>& touched) const;

 private:
  struct At {
    double share;
    ToolCall call;
    double short_m;
  };
  [[nodiscard]] At at(const ToolCall& call, double share) const;
  [[nodiscard]] bool keep(const ToolCall& call, const At& from, const At& to, int halves,
                          std::vector<models::PoseContact>& touched) const;

  const ToolLaws& laws_;
  const models::PoseAlgorithm& fresh_;
};

}  // namespace proxarm::studies
