#include "models/mesh/mesh_walk.hpp"

#include <algorithm>
#include <cmath>

#include "models/surfaces/cone_sum.hpp"
#include "models/surfaces/corner.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/groove.hpp"

namespace proxarm::models {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
// Costs, in units of about 15 ns. One step may cost kBudget, which is 0.36 ms; typical steps cost some tens of units. A
// step that needs more would endanger a cycle of 1 ms, so it ends, and the proxy stays where it is at that point.
// Testing a path costs kLook, or kFarLook if the path leaves the remembered faces. Solving for two or three faces costs
// kSolve.
constexpr int kBudget = 24'000, kLook = 20, kFarLook = 100, kSolve = 20;

// Lengths, in lifts. A face holds a proxy up to kPast beyond the face's edge.
//
// kPast: if the next face turns away by the angle φ, a proxy kPast beyond the edge is at the height cos φ + kPast sin φ
// over the next face. This height is positive up to φ = 165°.
//
// kAround: on the line of an edge, the proxy is tan(φ/2) beyond the edges of both faces. kAround covers this up to φ =
// 172°.
constexpr double kPast = 4.0;
constexpr double kAround = 16.0;
// A face counts as touched if the proxy's height over the face's touched surface is between these two heights, in
// lifts. The face itself is at −1. A proxy that passes a side is at a height of up to cos φ + kPast sin φ − 1 ≤ 3.2.
constexpr double kBelow = -1.5, kAbove = 4.0;
constexpr double kSharpest = 0.0078;  // 1 + cos φ at φ = 172°

}  // namespace

MeshSurface::Walk::Walk(MeshSurface& surface, const Vec3& to, const Vec3& from) noexcept
    : s(surface),
      mesh(*surface.mesh_),
      lift(surface.lift_),
      p(to),
      q(from),
      c(from),
      p_at(to),
      came_from(kNone),
      budget(kBudget) {
  const double far = (p - q).lpNorm<1>();
  // A point at 1e12 m is beyond any mesh, and within the range in which the predicates are exact.
  if (far > 1e12) p_at = q + (p - q) * (1e12 / far);
  for (double& x : c) {
    if (std::abs(x) < 1e-60) x = 0.0;
  }
  for (double& x : p_at) {
    if (std::abs(x) < 1e-60) x = 0.0;
  }
}

Vec3 MeshSurface::Walk::run() noexcept {
  if (!p.allFinite() || !q.allFinite() || p == q) return q;
  touch();
  if (count == 0) {
    s.find_clearance(q);
    if (s.is_clear(p, q)) return p;
  }
  const bool beside_all = leave_planes();
  const Vec3 start = c;
  const auto begin_round = [this] {
    if (budget <= 0) return false;
    budget -= kLook;
    return true;
  };
  const auto try_pairs = [this] {
    return try_each_pair(count, [this](std::size_t i, std::size_t j) {
      if (budget <= 0) return StepResult::no_progress;
      --budget;
      return try_pair(i, j);
    });
  };
  const auto try_triples = [this] {
    if (count > kAll) return StepResult::no_progress;
    return try_each_triple(count, [this](std::size_t i, std::size_t j, std::size_t k) {
      return try_triple({i, j, k});
    });
  };
  if (!beside_all ||
      !search_contacts(
          begin_round, [this] { return try_free(); }, [this] { return try_singles(); }, try_pairs, try_triples)) {
    hold();
  }
  s.last_move_ = c - start;
  return c;
}

bool MeshSurface::Walk::touches(std::uint32_t index) const noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    if (touched[i].face == index) return true;
  }
  return false;
}

TriangleMesh::Hit MeshSurface::Walk::look(const Vec3& x, const Vec3& y) noexcept {
  const TriangleMesh::Hit hit = s.first_hit(x, y);
  budget -= s.has_near(x) && s.has_near(y) ? kLook : kFarLook;
  return hit;
}

// Adds a touched face. The faces are sorted by index, so that results don't depend on the order in which they are
// found.
void MeshSurface::Walk::add(std::uint32_t index, const TriangleMesh::Face& face, int side) noexcept {
  std::size_t at = count;
  while (at > 0 && touched[at - 1].face > index) --at;
  if (at == kMost) return;
  if (count == kMost) --count;
  for (std::size_t i = count; i > at; --i) touched[i] = touched[i - 1];
  const Vec3 n = side < 0 ? Vec3(-face.normal) : face.normal;
  touched[at] = {index, side, face.corner + lift * n, n};
  ++count;
}

void MeshSurface::Walk::touch(std::uint32_t index, const TriangleMesh::Face& face) noexcept {
  const double h = TriangleMesh::height(face, c);
  if (std::abs(h) > (kAbove + 1.0) * lift || face.trust > 1.0) return;
  if (!is_around(index, c, kAround)) return;
  const int side = mesh.side(index, c);
  const double over = (side * h - lift);
  if (over >= kBelow * lift && over <= kAbove * lift) add(index, face, side);
}

void MeshSurface::Walk::touch() noexcept {
  count = 0;
  if (!s.has_near(c) && !s.is_clear(c, c)) s.come_near(c, s.last_move_);
  if (s.has_near(c)) {
    s.maybe_between(c, c, (kAbove + 1.0) * lift, [this](std::uint32_t f) { touch(f, mesh.face(f)); });
  } else {
    mesh.within(c, 2.0 * kAround * lift, [this](std::uint32_t f) {
      touch(f, mesh.face(f));
      return true;
    });
  }
}

// Whether the path from c to x meets a touched face. Faces in whose plane c lies don't count.
bool MeshSurface::Walk::crosses(const Vec3& x) const noexcept {
  return std::any_of(touched.begin(), touched.begin() + static_cast<std::ptrdiff_t>(count),
                     [&](const Side& face) { return face.side != 0 && mesh.touched_by(face.face, c, x); });
}

// Moves a q that lies exactly in the planes of touched triangles out of these planes, by one lift along the sum of
// their normals. If another touched face blocks only the path along this sum, moves q in the opposite direction.
// Repeats this if q is then in further planes. Returns false if the normals cancel each other, or after four rounds.
bool MeshSurface::Walk::leave_planes() noexcept {
  for (int round = 0; round < 4; ++round) {
    Vec3 out = Vec3::Zero();
    bool inside = false;
    for (std::size_t i = 0; i < count; ++i) {
      if (touched[i].side != 0) continue;
      inside = true;
      out += touched[i].normal;
    }
    if (!inside) return true;
    const double size = out.norm();
    if (!(size > 0.1)) return false;
    const Vec3 away = (lift / size) * out;
    if (crosses(c + away) && !crosses(c - away)) {
      c -= away;
    } else {
      c += away;
    }
    touch();
  }
  return false;
}

bool MeshSurface::Walk::is_around(std::uint32_t face, const Vec3& x, double lifts) const noexcept {
  const Vec3& n = mesh.face(face).normal;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& a = mesh.corner(face, k);
    const Vec3 out = (mesh.corner(face, (k + 1) % 3) - a).cross(n);
    const double past = out.dot(x - a);
    if (past > 0.0 && past * past > lifts * lifts * lift * lift * out.squaredNorm()) return false;
  }
  return true;
}

// Returns the fraction of the path from c to `to` on which the face holds the proxy: 1 for the whole path, 0 for no
// part of it.
double MeshSurface::Walk::share_on(std::uint32_t face, const Vec3& to, std::size_t& exit) const noexcept {
  const Vec3& n = mesh.face(face).normal;
  double share = 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& a = mesh.corner(face, k);
    const Vec3 out = (mesh.corner(face, (k + 1) % 3) - a).cross(n);
    const double past_to = out.dot(to - a);
    if (!(past_to > 0.0)) continue;
    const double size = out.norm(), there = past_to / size - kPast * lift;
    if (!(there > 0.0)) continue;
    const double here = out.dot(c - a) / size - kPast * lift;
    if (here >= -lift) return 0.0;
    const double at = -here / (there - here);
    if (at < share) {
      share = at;
      exit = k;
    }
  }
  return share;
}

// Whether the target leads back over the side over which the proxy has just left another face. Then neither of these
// faces holds the proxy alone; their common edge may hold it.
bool MeshSurface::Walk::goes_back(const Target& target) const noexcept {
  if (came_from == kNone || target.exit > 2) return false;
  const auto &own = mesh.triangle(touched[target.of[0]].face), &other = mesh.triangle(came_from);
  const auto has = [&other](std::uint32_t v) { return std::find(other.begin(), other.end(), v) != other.end(); };
  return touched[target.of[0]].face != came_from && has(own[target.exit]) && has(own[(target.exit + 1) % 3]);
}

// Moves the proxy up to a face that blocks its path. This face is then added to the touched faces.
StepResult MeshSurface::Walk::run_into(const TriangleMesh::Hit& hit, const Vec3& towards) noexcept {
  const TriangleMesh::Face& face = mesh.face(hit.face);
  if (touches(hit.face) || face.trust > 1.0) return StepResult::no_progress;
  const int side = mesh.side(hit.face, c);
  if (side == 0) return StepResult::no_progress;
  const double over = side * TriangleMesh::height(face, c) - lift;
  const double there = side * TriangleMesh::height(face, towards) - lift;
  if (over > 0.0 && there < over) {
    const Vec3 x = c + (over / (over - there)) * (towards - c);
    if (x.allFinite() && !look(c, x).any()) {
      c = x;
      touch();
    }
  }
  if (!touches(hit.face)) add(hit.face, face, side);
  return StepResult::progress;
}

StepResult MeshSurface::Walk::go(const Target& target) noexcept {
  const bool whole = target.share >= 1.0;
  if (!whole && goes_back(target)) return StepResult::no_progress;
  const Vec3 x = whole ? target.r : Vec3(c + target.share * (target.r - c));
  if (!x.allFinite()) return StepResult::no_progress;
  if (x != c) {
    const TriangleMesh::Hit hit = look(c, x);
    if (hit.any()) return run_into(hit, x);
  }
  if (whole) report(target.count, target.of, target.slips);
  c = x;
  if (whole) return StepResult::arrived;
  came_from = target.count == 1 ? touched[target.of[0]].face : kNone;
  touch();
  return StepResult::progress;
}

StepResult MeshSurface::Walk::try_free() noexcept {
  const double size_c = c.lpNorm<1>(), size_p = p_at.lpNorm<1>();
  TriangleMesh::Hit hit;
  for (std::size_t i = 0; i < count && !hit.any(); ++i) {
    mesh.test(touched[i].face, mesh.face(touched[i].face), c, p_at, size_c, size_p, hit);
  }
  if (hit.any()) return StepResult::no_progress;
  hit = look(c, p_at);
  if (hit.any()) return run_into(hit, p_at);
  c = p;
  return StepResult::arrived;
}

StepResult MeshSurface::Walk::try_singles() noexcept {
  std::array<Target, kMost> targets;
  std::array<double, kMost> distance2;
  std::size_t found = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const FaceStep<3> step = step_on_face(touched[i].surface(), s.friction(touched[i].face), p, q);
    if (!step.touches) continue;
    std::size_t exit = 3;
    const double share = share_on(touched[i].face, step.r, exit);
    if (!(share > 0.0)) continue;
    targets[found] = {step.r, share, {i, 0, 0}, {step.slips, false, false}, 1, exit};
    // Faces that hold the proxy on the whole path come first. At a convex edge, the proxy may be able to stick on one
    // face and to slide on the other face. Then the end nearer to p is chosen, because it depends least on K.
    distance2[found++] = (step.r - p).squaredNorm() * (share < 1.0 ? 1e100 : 1.0);
  }
  for (std::size_t tried = 0; tried < found && budget > 0; ++tried) {
    const auto best = std::min_element(distance2.begin(), distance2.begin() + static_cast<std::ptrdiff_t>(found));
    const StepResult result = go(targets[static_cast<std::size_t>(best - distance2.begin())]);
    if (result != StepResult::no_progress) return result;
    *best = kInfinity;
  }
  return StepResult::no_progress;
}

StepResult MeshSurface::Walk::try_pair(std::size_t i, std::size_t j) noexcept {
  const auto &a = mesh.triangle(touched[i].face), &b = mesh.triangle(touched[j].face);
  std::array<std::uint32_t, 3> shared;
  const auto shares = std::copy_if(a.begin(), a.end(), shared.begin(),
                                   [&](std::uint32_t v) { return std::find(b.begin(), b.end(), v) != b.end(); });
  const bool edge = shares - shared.begin() == 2;
  if (!edge && count > kAll) return StepResult::no_progress;

  budget -= kSolve;
  const FlatSurface<3> f = touched[i].surface(), g = touched[j].surface();
  GrooveLine line(f, g);
  if (!line.exists || 1.0 + line.cos < kSharpest) return StepResult::no_progress;
  // The line's origin is moved next to q, so that short slides aren't lost in the rounding of large coordinates.
  double begin = 0.0, end = 0.0;  // the positions of the edge's ends along the line
  if (edge) {
    // The line is computed from the edge's vertices, because the planes determine it only to rounding divided by the
    // angle between them.
    const Vec3 &start = mesh.vertex(shared[0]), along = mesh.vertex(shared[1]) - start;
    const double length = along.norm();
    const bool forth = line.e.dot(along) > 0.0;
    line.x0 = start + lift / (1.0 + line.cos) * (f.normal() + g.normal());
    line.e = (forth ? along : Vec3(-along)) / length;
    line.t1 = line.e.cross(f.normal());
    line.t2 = line.e.cross(g.normal());
    const double beside_q = line.e.dot(q - line.x0);
    line.x0 += beside_q * line.e;
    begin = (forth ? 0.0 : -length) - beside_q;
    end = begin + length;
  } else {
    for (int k = 0; k < 3; ++k) line.x0 = line.settle(f, g, k == 0 ? q : line.x0);
  }
  // q counts as on the line if both heights are at most kAbove · lift.
  const bool in_line = std::abs(f.height(q)) <= kAbove * lift && std::abs(g.height(q)) <= kAbove * lift;
  const Vec3 from = !in_line || (f.holds(q) && g.holds(q)) ? q : line.settle(f, g, line.settle(f, g, q));
  const GrooveSolution solution =
      solve_groove({f, s.friction(touched[i].face), from}, {g, s.friction(touched[j].face), from}, line, p);
  if (!solution.found) return StepResult::no_progress;
  Target target{solution.r, 1.0, {i, j, 0}, {solution.slips1, solution.slips2, false}, 2};
  if (edge) {
    if (target.r != q) target.r = line.x0 + line.e * line.e.dot(target.r - line.x0);
    const double to = line.e.dot(target.r - line.x0), here = line.e.dot(c - line.x0);
    const double past = std::max(begin - to, to - end), here_past = to < begin ? begin - here : here - end;
    if (past > kPast * lift) {
      if (here_past >= (kPast - 1.0) * lift) return StepResult::no_progress;
      target.share = (kPast * lift - here_past) / (past - here_past);
    }
  } else {
    std::size_t exit = 3;
    target.share = std::min(share_on(touched[i].face, target.r, exit), share_on(touched[j].face, target.r, exit));
    if (!(target.share > 0.0)) return StepResult::no_progress;
  }
  return go(target);
}

StepResult MeshSurface::Walk::try_triple(const std::array<std::size_t, 3>& of) noexcept {
  if (budget <= 0) return StepResult::no_progress;
  budget -= kSolve;
  const std::array<FlatSurface<3>, 3> surface{touched[of[0]].surface(), touched[of[1]].surface(),
                                              touched[of[2]].surface()};
  const auto contact = [&](std::size_t m) { return PlaneContact{surface[m], s.friction(touched[of[m]].face), q}; };
  const CornerSolution solution =
      solve_corner({contact(0), contact(1), contact(2)}, CornerPoint(surface[0], surface[1], surface[2]), p);
  if (!solution.found) return StepResult::no_progress;
  for (const std::size_t m : of) {
    if (!is_around(touched[m].face, solution.r, kAround)) return StepResult::no_progress;
  }
  return go({solution.r, 1.0, of, {solution.slips[0], solution.slips[1], solution.slips[2]}, 3});
}

void MeshSurface::Walk::report(std::size_t contacts, const std::array<std::size_t, 3>& of,
                               const std::array<bool, 3>& slips) noexcept {
  s.count_ = contacts;
  for (std::size_t k = 0; k < contacts; ++k) {
    const Side& side = touched[of[k]];
    s.contacts_[k] = {0, static_cast<std::int32_t>(side.face), slips[k], side.normal, false};
  }
}

// Whether these faces can exert the force if the proxy sticks to all of them: the force is in the sum of their friction
// cones.
bool MeshSurface::Walk::can_support(std::size_t contacts, const std::array<std::size_t, 3>& of) const noexcept {
  std::array<ForceCone, 3> cones;
  for (std::size_t k = 0; k < contacts; ++k) cones[k] = {touched[of[k]].normal, s.friction(touched[of[k]].face)};
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  return in_sum_of_cones(c - p, {cones.data(), contacts}, lift + 8.0 * u * p.lpNorm<1>());
}

// Ends a step in which no set of faces lets the proxy move: the proxy stays where it is, for example at a vertex.
void MeshSurface::Walk::hold() noexcept {
  // A move of at most kAround · lift comes only from leave_planes(). It is undone.
  if (c != q && (c - q).norm() <= kAround * lift) c = q;
  report_holding();
  for (std::size_t k = 0; k < s.count_; ++k) s.contacts_[k].reached = c != q;
}

// Reports at most three faces that can exert the force.
void MeshSurface::Walk::report_holding() noexcept {
  const std::size_t n = std::min(count, std::size_t{16});
  constexpr std::array<bool, 3> at_rest{false, false, false};
  for (std::size_t i = 0; i < n; ++i) {
    if (can_support(1, {i, 0, 0})) return report(1, {i, 0, 0}, at_rest);
  }
  const auto hold_by = [&](std::size_t contacts, const std::array<std::size_t, 3>& of) {
    if (!can_support(contacts, of)) return StepResult::no_progress;
    report(contacts, of, at_rest);
    return StepResult::arrived;
  };
  if (try_each_pair(n,
                    [&](std::size_t j, std::size_t i) {
                      return hold_by(2, {i, j, 0});
                    }) == StepResult::arrived ||
      try_each_triple(n, [&](std::size_t k, std::size_t j, std::size_t i) {
        return hold_by(3, {i, j, k});
      }) == StepResult::arrived) {
    return;
  }
  ++s.unresolved_;
  report(std::min(count, std::size_t{3}), {0, 1, 2}, at_rest);
}

}  // namespace proxarm::models
