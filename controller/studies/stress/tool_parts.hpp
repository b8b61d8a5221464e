// Judges whether a step whose contacts added energy did so by going over an edge.
//
// At an edge the normal turns at once. The force at the step's end, λn, is multiplied by the whole displacement s from
// q, also by the part before the edge, where n₀ᵀs = 0 and nᵀs > 0. This energy is of first order in s, as is that of a
// tool that jumps by a fault in the step. The path from q to r tells the two apart. p̂ moves straight from q, p̂(σ) = q
// + σ (p̂ − q), and a tool that follows it has poses r(σ) and forces f(σ), each found from the pose before. Between two
// of these poses, a and b,
//
//   nᵀ(x(b) − x(a)) ≤ what the normal's turn and the surface's curvature permit from r(a) to r(b)
//
// holds for each contact that presses at r(b), if no edge lies between them: it either pressed at r(a), too, with a gap
// of 0 at both, or its point came down to the feature meanwhile. The bound also holds for a jump from just before an
// edge, r⁻, to just behind it, r⁺, if the feature that holds the tool at r⁺ is met at the edge. The contact point then
// lies on the edge at r⁻, so its gap is 0 at both poses and nᵀ(x⁺ − x⁻) = 0. Any other contact that presses at r⁺ has a
// gap of 0 there, and had none below 0 before. (So without friction the tool's potential ½‖r − p̂‖²_K falls by ½‖r⁺ −
// r⁻‖²_K or more.)
//
// A tool released at one edge may move far, and over other edges. For example, a vertex leaves its face; one of the
// tool's edges slides along the object's edge to a corner, and over it onto a side that the contact point was behind at
// r⁻ (replay 5381286054045804, step 12: 1 mm, 0.6 mm of it along the normal at r⁺, while p̂ hardly moves). So a jump is
// divided, too. During it p̂ waits and draws the tool against a drag,
//
//   K dr/dτ = K (p̂ − r) + the contacts' wrench,   r(0) = r⁻,   r(∞) = r⁺
//
// again by steps of 𝒢. A step of length h has the wrench K (r(b) − p̂) + K (r(b) − r(a))/h, which is that of 𝒢 with (1
// + 1/h) K for p' = r(a) + η (p̂ − r(a)), η = h/(1 + h). By Assumption 1 𝒢 gives the same pose with K, and η times the
// forces. The bound holds for parts of a jump as for parts of a step.
//
// So with smaller and smaller parts the sum of f_n nᵀ(x(b) − x(a)) goes to zero, except where the tool jumps by a
// fault. The sum may be at most the step's curvature_J().
//
// Near an edge p̂ may have several solutions. An edge of the tool that reaches a vertex lies on it along a part of the
// path (σ = 0.62 to 0.72 in replay 5530763864440370, step 74); there a step from q finds a place up to 51 µm beyond, or
// no forces (replay 1126755579853460, step 435). So each pose of the path starts from the pose before, not from q. At
// p̂ itself the following tool may reach another solution than the step did (replay 54327521292900, step 25: 0.19 mm
// apart). Both obey the law, but at an edge a step may gain only the energy that its parts gain. So the step's end must
// not push forward from q by more than the path's end does.
//
// Where two vertices meet, or a vertex and an edge that leans over it, the tool may balance as on a needle's point,
// held by normals of which each alone would let it go. The side of the point on which the first poses lie decides
// whether it gets there (replay 1958603531041721, step 829: paths that start with eighths, quarters or fifths get
// there, those with halves, thirds or sevenths don't). A step that goes past the point obeys the law if one of the
// paths ends where the step does. For a fault none does: in replay 5459542357847018, step 719, the step ended beside a
// wedge, held by two vertices beyond it, while all paths of 1 to 64 parts ended in the wedge.
//
// All of a step's paths may lead onto such a point, and the step beyond it (replay 5693172070329278, step 17: an edge
// of the tool slides along a mesh's edge to its end, and over the vertex there to one side). Displaced by a nanometre a
// tool falls off a needle's point, but stays in a wedge. So a path may continue from a pose next to the point. The
// displacement, and what pushes the tool on from the point, count as for any part.
//
// Along an edge that crosses another one at a small angle the normal turns fast, but 𝒢 allows only for the tool's own
// turn, so even small parts may be unresolved (replay 5930090148271672, step 429: from σ = 0.9102 on the tool moves
// along the object's edge, until a vertex holds it from 0.92 to 0.95). A pose found from q at 0.92 is also a step of 𝒢,
// by the same p̂. So if no path keeps the bound, a path may use poses found from q where none is found from the pose
// before. What pushes the tool on to them counts as for any part.
//
// Only normal forces are judged. Friction acts against the slip and takes energy; a point that moves back in a jump
// proves nothing about it. Poses without forces are left out, and parts lie between the remaining ones.
#pragma once

#include <compare>
#include <optional>
#include <vector>

#include "controller/studies/stress/tool_laws.hpp"

namespace proxarm::studies {

class ToolParts {
 public:
  // `fresh`: a world that hasn't made a step. Precondition: `laws` and `fresh` outlive this object.
  ToolParts(const ToolLaws& laws, const models::PoseAlgorithm& fresh) : laws_(laws), fresh_(fresh) {}

  // Returns whether the step's parts push forward by at most curvature_J(), and the edges on its path account for
  // `rest_J`. `touched` holds the contacts before the step; those on the path are added. The path is divided into
  // eighths, and further where parts push forward while energy is unexplained. If this path fails, tries paths divided
  // otherwise, displaced from points, or continued from q. `short_m`: by how much gaps at q fall short of 0.
  [[nodiscard]] bool keep(const ToolCall& call, double short_m, double rest_J,
                          std::vector<models::PoseContact>& touched) const;

 private:
  // A place on the path: p̂'s share of the way from q, and while p̂ waits there, the time τ = waited/(1 − waited). At
  // waited = 1 p̂ moves on.
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
  // How a path continues: displaced by `aside` where it lies on a point (`lay`: it has lain on one), or from q if no
  // forces are found from the pose before.
  struct Going {
    models::Twist aside = models::Twist::Zero();
    bool lay = false;
    bool from_q = false;
  };
  struct Sum {
    double all_J = 0.0, undivided_J = 0.0;  // of parts that can't be divided further
    double most_J = 0.0;                    // the part that pushes forward most
    Mark divide;                            // where to divide that part
    std::size_t before = 0;                 // the pose at which that part starts
  };
  static std::optional<Mark> between(const Mark& a, const Mark& b);
  static std::optional<Mark> divide(const std::vector<Mark>& marks, const Mark& from, const Mark& to);
  [[nodiscard]] bool keep_from(int parts, Going& going, const ToolCall& call, double short_m, double rest_J,
                               std::vector<models::PoseContact>& touched) const;
  // Continues the path from its last pose to p̂.
  void follow(const ToolCall& call, const std::vector<Mark>& marks, Going& going, std::vector<Pose>& way) const;
  // Makes a step to the pose's p̂; returns whether forces are found. `drawn`: η, which scales K (p̂ − r).
  [[nodiscard]] bool find(Pose& pose, const Pose& last, const models::ToolPose& start, double drawn) const;
  // The pose from which a path continues.
  [[nodiscard]] models::ToolPose from(const Pose& pose, Going& going) const;
  [[nodiscard]] double pushed_J(const Pose& from, const Pose& to) const;
  // Sums the parts of a path. The last part leads to the step's end, or to the path's own end if that pushes forward
  // from q by as much or more.
  [[nodiscard]] Sum sum_of(const std::vector<Pose>& way, const std::vector<Mark>& marks, const ToolCall& call) const;

  const ToolLaws& laws_;
  const models::PoseAlgorithm& fresh_;
};

}  // namespace proxarm::studies
