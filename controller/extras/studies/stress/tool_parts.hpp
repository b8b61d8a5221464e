// Judges whether a step whose contacts added energy did so by going over an edge, or by a fault of 𝒢.
//
// The step alone doesn't tell. At an edge the normal turns at once, from n₀ to n. The force at the step's end, λn, is
// multiplied by the whole displacement s from q. That includes the part of s before the edge, where n₀ᵀs = 0 and
// nᵀs > 0. So the added energy is of first order in s. If the tool jumps by a fault in the step, the added energy is
// also of first order.
//
// The path from q to r tells an edge and a fault apart. Let p̂ move straight from q: p̂(σ) = q + σ (p̂ − q). A tool that
// follows p̂(σ) has poses r(σ) and forces f(σ), each found from the pose before. For two successive poses r(a) and r(b),
//
//   nᵀ(x(b) − x(a)) ≤ what the normal's turn and the surface's curvature permit from r(a) to r(b)
//
// is called the bound. It holds for each contact that presses at r(b), in two cases:
//   1. No edge lies between the poses. Then the contact also pressed at r(a), with a gap of 0 at both poses, or its
//      point came down to the feature between the poses.
//   2. The tool jumps from just before an edge, r⁻, to just behind it, r⁺, and the feature that holds the tool at r⁺ is
//      met at the edge. Then the contact point lies on the edge at r⁻, so its gap is 0 at both poses, and
//      nᵀ(x⁺ − x⁻) = 0. Any other contact that presses at r⁺ has a gap of 0 there, and had none below 0 before. (So
//      without friction the tool's potential ½‖r − p̂‖²_K falls by ½‖r⁺ − r⁻‖²_K or more.)
//
// A jump is divided, too, because a tool that is released at one edge may move far, and over other edges. For example,
// a vertex leaves its face; then one of the tool's edges slides along the object's edge to a corner, and over the
// corner onto a side that the contact point was behind at r⁻ (replay 5381286054045804, step 12: the tool moves 1 mm,
// 0.6 mm of it along the normal at r⁺, while p̂ hardly moves). During a jump p̂ waits and draws the tool against a drag,
//
//   K dr/dτ = K (p̂ − r) + the contacts' wrench,   r(0) = r⁻,   r(∞) = r⁺
//
// This motion is also computed by steps of 𝒢:
//   1. A step of length h in τ from r(a) to r(b) has the wrench K (r(b) − p̂) + K (r(b) − r(a))/h.
//   2. That is the wrench of 𝒢 with (1 + 1/h) K for p' = r(a) + η (p̂ − r(a)), where η = h/(1 + h).
//   3. By Assumption 1, 𝒢 with K gives the same pose, and η times the forces.
// The bound holds for parts of a jump as for parts of a step.
//
// Consequently, with smaller and smaller parts, the sum of f_n nᵀ(x(b) − x(a)) over the parts goes to zero, except
// where the tool jumps by a fault. A step went over an edge if the sum is at most the step's curvature_J().
//
// Near an edge 𝒢 may have several solutions for one p̂. If an edge of the tool reaches a vertex, the edge lies on the
// vertex along a part of the path (σ = 0.62 to 0.72 in replay 5530763864440370, step 74). On that part a step from q
// finds a place up to 51 µm beyond the vertex, or no forces (replay 1126755579853460, step 435). So each pose of the
// path starts from the pose before, not from q. At σ = 1 the path may reach another solution than the step did (replay
// 54327521292900, step 25: 0.19 mm apart). Both solutions obey the law, but at an edge a step may gain only the energy
// that its parts gain. So the step's end must not push forward from q by more than the path's end does.
//
// Where two vertices meet, or a vertex and an edge that leans over it, the tool may balance as on a needle's point. It
// is held by normals of which each alone would let it go. Whether a path gets onto the point depends on the side of the
// point on which the path's first poses lie (replay 1958603531041721, step 829: paths that start with eighths, quarters
// or fifths get there, paths that start with halves, thirds or sevenths don't). A step that goes past the point obeys
// the law if one of the paths ends where the step ends. If the step has a fault, no path ends there: in replay
// 5459542357847018, step 719, the step ended beside a wedge, held by two vertices beyond the wedge, while all paths of
// 1 to 64 parts ended in the wedge.
//
// All paths may lead onto such a point while the step goes beyond it (replay 5693172070329278, step 17: an edge of the
// tool slides along a mesh's edge to the end of that edge, and over the vertex there to one side). A tool that is
// displaced by a nanometre falls off a needle's point, but stays in a wedge. So a path may continue from a pose next to
// the point. The displacement, and what pushes the tool on from the point, count in the sum as for any part.
//
// Along an edge that crosses another edge at a small angle, the normal turns fast. 𝒢 allows only for the tool's own
// turn, so even small parts may be unresolved (replay 5930090148271672, step 429: from σ = 0.9102 on the tool moves
// along the object's edge, until a vertex holds the tool from σ = 0.92 to 0.95). A pose found from q at σ = 0.92 is
// also a step of 𝒢, to the same p̂(σ). So if no path keeps the bound, a path may use poses found from q where no pose is
// found from the pose before. What pushes the tool on to such a pose counts in the sum as for any part.
//
// Only normal forces are judged. Friction acts against the slip and takes energy, and a point that moves back in a jump
// proves nothing about friction. Poses without forces are left out, and parts lie between the remaining poses.
#pragma once

#include <compare>
#include <optional>
#include <vector>

#include "controller/extras/studies/stress/tool_laws.hpp"

namespace proxarm::studies {

class ToolParts {
 public:
  // `fresh`: a world that hasn't made a step. Precondition: `laws` and `fresh` outlive this object.
  ToolParts(const ToolLaws& laws, const models::PoseAlgorithm& fresh) : laws_(laws), fresh_(fresh) {}

  // Returns whether the step's parts push forward by at most curvature_J(), and the edges on the path explain the
  // energy `rest_J`. `touched` holds the contacts before the step; the contacts on the path are added. The path is
  // divided into eighths, and divided further where parts push forward while energy is unexplained. If this path fails,
  // tries paths that are divided otherwise, then paths that are displaced from points, then paths that continue from q.
  // `short_m`: by how much gaps at q fall short of 0.
  [[nodiscard]] bool keep(const ToolCall& call, double short_m, double rest_J,
                          std::vector<models::PoseContact>& touched) const;

 private:
  // A place on the path. `share` is σ, p̂'s share of the way from q. While p̂ waits at that share, τ = waited/(1 −
  // waited). At waited = 1, p̂ moves on.
  struct Mark {
    double share = 0.0, waited = 1.0;
    friend auto operator<=>(const Mark&, const Mark&) = default;
  };
  struct Pose {
    Mark mark;
    ToolCall call;
    double short_m;
  };
  [[nodiscard]] static double time_of(const ToolCall& call, const Mark& mark) {
    return call.since_s + mark.share * (call.time_s - call.since_s);
  }
  // How a path continues. Where the path lies on a point, it is displaced by `aside`; `lay` is whether it has lain on a
  // point. With `from_q`, a pose may be found from q if no forces are found from the pose before.
  struct Going {
    models::Twist aside = models::Twist::Zero();
    bool lay = false;
    bool from_q = false;
  };
  struct Sum {
    double all_J = 0.0, undivided_J = 0.0;  // undivided_J: of the parts that can't be divided further
    double most_J = 0.0;                    // the largest of the parts that can be divided
    Mark divide;                            // where to divide the largest part
    std::size_t before = 0;                 // index of the pose at which the largest part starts
  };
  static std::optional<Mark> between(const Mark& a, const Mark& b);
  static std::optional<Mark> divide(const std::vector<Mark>& marks, const Mark& from, const Mark& to);
  [[nodiscard]] bool keep_from(int parts, Going& going, const ToolCall& call, double short_m, double rest_J,
                               std::vector<models::PoseContact>& touched) const;
  // Continues the path from its last pose to p̂.
  void follow(const ToolCall& call, const std::vector<Mark>& marks, Going& going, std::vector<Pose>& way) const;
  // Finds a pose by a step of 𝒢 from `start` to pose.call.p. `drawn` is η, by which the found forces are divided.
  // Returns whether forces are found.
  [[nodiscard]] bool find(Pose& pose, const Pose& last, const models::ToolPose& start, double drawn) const;
  // Returns the pose of the tool from which a path continues after `pose`.
  [[nodiscard]] models::ToolPose from(const Pose& pose, Going& going) const;
  [[nodiscard]] double pushed_J(const Pose& from, const Pose& to) const;
  // Sums how much the parts of a path push forward. The last part leads to the step's end. If the path's own end pushes
  // forward from q by as much as the step's end or more, the last part may also lead to the path's own end, and the
  // smaller value counts.
  [[nodiscard]] Sum sum_of(const std::vector<Pose>& way, const std::vector<Mark>& marks, const ToolCall& call) const;

  const ToolLaws& laws_;
  const models::PoseAlgorithm& fresh_;
};

}  // namespace proxarm::studies
