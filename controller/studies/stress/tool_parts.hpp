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
// 0 at both, or came down to its feature since. It also holds for a jump from next before an edge, r⁻, to next behind
// it, r⁺, if what holds the tool in r⁺ is met there first: in r⁻ the place lies on the edge, and so on what is behind
// it. Its gap there is 0 at both, nᵀ(x⁺ − x⁻) = 0, and whatever else lets the tool go or comes to hold it meanwhile,
// its gap is 0 at r⁺ if it presses, and was not below before. (So without friction the tool's potential ½‖r − p̂‖²_K
// falls by ½‖r⁺ − r⁻‖²_K or more.)
//
// But let go at one edge a tool may come far, and over others: a vertex leaves its face, one of the tool's edges slides
// along the object's to a corner, and over that onto a side that the place was behind in r⁻, beyond the edge (replay
// 5381286054045804, step 12: 1 mm with p̂ as good as at rest, and up along the normal at r⁺ by 0.6). So a jump is a way,
// too. There p̂ waits, and draws the tool on against a drag,
//
//   K dr/dτ = K (p̂ − r) + what the contacts exert,   r(0) = r⁻,   r(∞) = r⁺
//
// by steps of 𝒢 again: one of h has K (r(b) − p̂) + K (r(b) − r(a))/h for its wrench, that of 𝒢 with (1 + 1/h) K for
// p' = r(a) + η (p̂ − r(a)), η = h/(1 + h), or by Assumption 1 with K, 1/η of the forces. For parts of it the bound
// holds as it does for those of the step.
//
// Thus what the forces push forward by, f_n nᵀ(x(b) − x(a)), summed over smaller and smaller parts, goes to zero, but
// for places where the tool springs: there it stays. Those may give what curvature_J() says of the step, no more.
//
// A step asks the world at p̂ alone, and next to an edge it may have several solutions there. An edge of the tool that
// comes onto a vertex lies on it for a part of the way, from 0.62 to 0.72 in replay 5530763864440370, step 74; from q a
// place up to 51 µm beyond is found all along that part, or no forces (1126755579853460, step 435). So a pose of the
// way goes on from the one before, not from q. And at p̂ the tool that follows may come to another solution than the
// step did (54327521292900, step 25, with 0.19 mm between them). Both keep the law; the energy that a step may get at
// an edge is what it gets where its parts lead. So the step's end, too, must push forward since q by no more than that
// one does.
//
// And where two vertices meet, or a vertex and an edge that leans over it, the tool may lie for long, held by normals
// of which each alone would let it go: as on a needle's point. On which side of that place p̂'s first poses are decides
// whether it comes to lie there (1958603531041721, step 829: of ways that begin with eighths, quarters or fifths, but
// not of those with halves, thirds or sevenths). A step that goes by keeps the law, if one of the ways leads to where
// it does. None leads to where a fault does: 5459542357847018, step 719, was by a wedge, held by two vertices beyond
// it, and of ways of 1 to 64 parts all came to lie in the wedge.
//
// All of a step's ways may lead through such a place, onto the needle, and the step beyond it (5693172070329278, step
// 17: an edge of the tool slides along a mesh's edge to its end, and over the vertex there on one of its sides). As on
// a needle it doesn't stay there: put a nanometre aside it falls. In a wedge it does. So a way may go on from next to
// where it lies on a point; that it was put there, and what pushes it on from the point itself, counts as any part's.
//
// Along an edge that crosses another one at a small angle the normal turns fast, and 𝒢 allows for what the tool turns
// by, no more: such parts may be unresolved, however small (replay 5930090148271672, step 429: from 0.9102 of the way
// on, on along the object's edge, until from 0.92 to 0.95 a vertex holds the tool). What is found from q at 0.92 is a
// step of 𝒢, too, by the same p̂. So where no way keeps the bound, one may have such poses, if none are found from the
// one before: what pushes on to them from there counts as any part's.
//
// Friction is against the slip, by which it takes energy; what part of it a place comes back in a jump says nothing.
// Nor does a pose for which no forces are found: parts are those between the others.
#pragma once

#include <compare>
#include <optional>
#include <vector>

#include "controller/studies/stress/tool_laws.hpp"

namespace proxarm::studies {

class ToolParts {
 public:
  // `fresh`: a world that knows of no step. Precondition: the laws and it outlive this.
  ToolParts(const ToolLaws& laws, const models::PoseAlgorithm& fresh) : laws_(laws), fresh_(fresh) {}

  // Whether what is pushed forward in the parts is no more than curvature may give, and edges that it goes over account
  // for `rest_J`, by what touched before the step, to be given, and on the way, added: at each eighth at least where
  // forces were found, and closer where the parts push while something isn't accounted for. If that isn't so of a way
  // that is divided in eighths first, of one that is divided otherwise, put aside, or goes on from q. `short_m`: of
  // gaps at q.
  [[nodiscard]] bool keep(const ToolCall& call, double short_m, double rest_J,
                          std::vector<models::PoseContact>& touched) const;

 private:
  // A place on the way: of p̂, and while p̂ waits there, of time: τ = waited/(1 − waited). At 1 it goes on.
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
  // How a way goes on: put aside where it lies on a point (and whether it has lain on one), and from q where nothing is
  // found from the pose before.
  struct Going {
    models::Twist aside = models::Twist::Zero();
    bool lay = false;
    bool from_q = false;
  };
  struct Sum {
    double all_J = 0.0, undivided_J = 0.0;  // of what can't be divided any more
    double most_J = 0.0;                    // the part that pushes most,
    Mark divide;                            // where to divide it
    std::size_t before = 0;                 // and the pose that it begins at
  };
  static std::optional<Mark> between(const Mark& a, const Mark& b);
  static std::optional<Mark> divide(const std::vector<Mark>& marks, const Mark& from, const Mark& to);
  [[nodiscard]] bool keep_from(int parts, Going& going, const ToolCall& call, double short_m, double rest_J,
                               std::vector<models::PoseContact>& touched) const;
  // From the last of the poses on, to p̂.
  void follow(const ToolCall& call, const std::vector<Mark>& marks, Going& going, std::vector<Pose>& way) const;
  // Whether forces are found for a pose of the way: a step to its p̂. `drawn`: its share of K (p̂ − r).
  [[nodiscard]] bool find(Pose& pose, const Pose& last, const models::ToolPose& start, double drawn) const;
  // Where a way goes on from.
  [[nodiscard]] models::ToolPose from(const Pose& pose, Going& going) const;
  [[nodiscard]] double pushed_J(const Pose& from, const Pose& to) const;
  // Of a way's parts, the last of which leads to the step's end, or to the way's where that one pushes since q by as
  // much or more.
  [[nodiscard]] Sum sum_of(const std::vector<Pose>& way, const std::vector<Mark>& marks, const ToolCall& call) const;

  const ToolLaws& laws_;
  const models::PoseAlgorithm& fresh_;
};

}  // namespace proxarm::studies
