#include "models/surfaces/plane_composition.hpp"

#include <limits>
#include <stdexcept>

namespace proxarm::models {
namespace {

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
// Up to these numbers of faces, the constructor computes all lines (32² of 160 bytes: 160 kB) and all corners (8³ of
// 104 bytes: 53 kB). Larger tables would be larger than the processor's cache.
constexpr std::size_t stored_lines = 32;
constexpr std::size_t stored_corners = 8;

}  // namespace

// The faces that may be part of the solution: faces that p is behind, and faces that a trial ran into.
struct PlaneComposition::Candidates {
  static constexpr std::size_t most = 12;
  std::array<std::size_t, most> index;
  std::size_t count = 0;
  bool friction = true;
  bool grew = false;

  void add(std::size_t i) noexcept {
    for (std::size_t c = 0; c < count; ++c) {
      if (index[c] == i) return;
    }
    if (count == most) return;
    index[count++] = i;
    grew = true;
  }
};

struct PlaneComposition::Choice : NearestSet {
  std::array<std::size_t, 3> face{none, none, none};
  std::array<bool, 3> slips{};

  void consider(const Vec3& p, const Vec3& at, std::array<std::size_t, 3> faces, std::array<bool, 3> slip) noexcept {
    if (!improve(p, at)) return;
    face = faces;
    slips = slip;
  }
};

PlaneComposition::PlaneComposition(std::vector<Face> faces) : faces_(std::move(faces)) {
  const std::size_t n = faces_.size();
  for (const Face& face : faces_) {
    if (!std::isfinite(face.mu) || !(face.mu >= 0.0)) {
      throw std::invalid_argument("a friction coefficient must be finite and not negative");
    }
  }
  if (n <= stored_lines) {
    lines_.resize(n * n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) lines_[i * n + j] = GrooveLine(faces_[i].surface, faces_[j].surface);
    }
  }
  if (n <= stored_corners) {
    corners_.resize(n * n * n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        for (std::size_t k = j + 1; k < n; ++k) {
          corners_[(i * n + j) * n + k] = CornerPoint(faces_[i].surface, faces_[j].surface, faces_[k].surface);
        }
      }
    }
  }
}

double PlaneComposition::friction(std::size_t face, const Candidates& candidates) const noexcept {
  return candidates.friction ? faces_[face].mu : 0.0;
}

bool PlaneComposition::fits(const Vec3& q, const Vec3& r, const std::array<std::size_t, 3>& contacts, bool creeps,
                            Candidates& candidates) const noexcept {
  bool fits = true;
  for (std::size_t m = 0; m < faces_.size(); ++m) {
    if (m == contacts[0] || m == contacts[1] || m == contacts[2]) continue;
    const FlatSurface<3>& surface = faces_[m].surface;
    const double height = surface.height(r);
    // A proxy whose height is within rounding counts as on the face. There is one exception: a proxy that slips on a
    // single face must not end lower over another face than q was. Otherwise, if both faces hold the proxy at rest, it
    // would creep along the first face by less than rounding in each step.
    if (height < 0.0 && (height < -surface.rounding(r) || (creeps && height < surface.height(q)))) {
      if (candidates.count == faces_.size()) return false;  // all faces are already candidates
      candidates.add(m);
      fits = false;
    }
  }
  return fits;
}

StepResult PlaneComposition::try_singles(const Vec3& p, const Vec3& q, Candidates& candidates,
                                         Choice& choice) const noexcept {
  for (std::size_t c = 0; c < candidates.count; ++c) {
    const std::size_t i = candidates.index[c];
    const FaceStep step = step_on_face(faces_[i].surface, friction(i, candidates), p, q);
    if (step.touches && fits(q, step.r, {i, none, none}, step.slips, candidates)) {
      choice.consider(p, step.r, {i, none, none}, {step.slips, false, false});
    }
  }
  return choice.result(candidates.grew);
}

StepResult PlaneComposition::try_pairs(const Vec3& p, const Vec3& q, Candidates& candidates,
                                       Choice& choice) const noexcept {
  const std::size_t n = faces_.size();
  try_each_pair(candidates.count, [&](std::size_t d, std::size_t c) {
    const std::size_t i = std::min(candidates.index[c], candidates.index[d]);
    const std::size_t j = std::max(candidates.index[c], candidates.index[d]);
    const PlaneContact a{faces_[i].surface, friction(i, candidates), q};
    const PlaneContact b{faces_[j].surface, friction(j, candidates), q};
    const GrooveSolution s = lines_.empty() ? solve_groove(a, b, GrooveLine(a.surface, b.surface), p)
                                            : solve_groove(a, b, lines_[i * n + j], p);
    if (s.found && fits(q, s.r, {i, j, none}, false, candidates)) {
      choice.consider(p, s.r, {i, j, none}, {s.slips1, s.slips2, false});
    }
    return StepResult::no_progress;
  });
  return choice.result(candidates.grew);
}

StepResult PlaneComposition::try_corners(const Vec3& p, const Vec3& q, Candidates& candidates,
                                         Choice& choice) const noexcept {
  const std::size_t n = faces_.size();
  try_each_triple(candidates.count, [&](std::size_t e, std::size_t d, std::size_t c) {
    std::array<std::size_t, 3> m{candidates.index[c], candidates.index[d], candidates.index[e]};
    std::sort(m.begin(), m.end());
    const auto contact = [&](std::size_t i) { return PlaneContact{faces_[i].surface, friction(i, candidates), q}; };
    const std::array<PlaneContact, 3> contacts{contact(m[0]), contact(m[1]), contact(m[2])};
    const CornerSolution s =
        corners_.empty()
            ? solve_corner(contacts, CornerPoint(contacts[0].surface, contacts[1].surface, contacts[2].surface), p)
            : solve_corner(contacts, corners_[(m[0] * n + m[1]) * n + m[2]], p);
    if (s.found && fits(q, s.r, m, false, candidates)) {
      choice.consider(p, s.r, m, {s.slips[0], s.slips[1], s.slips[2]});
    }
    return StepResult::no_progress;
  });
  return choice.result(candidates.grew);
}

bool PlaneComposition::search(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept {
  return search_contacts(
      [&] {
        candidates.grew = false;
        return true;
      },
      [&] { return try_singles(p, q, candidates, choice); }, [&] { return try_pairs(p, q, candidates, choice); },
      [&] { return try_corners(p, q, candidates, choice); });
}

Vec3 PlaneComposition::operator()(double /*K*/, const Vec3& p, const Vec3& q) noexcept {
  Candidates candidates;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    if (!(faces_[i].surface.height(p) > 0.0)) candidates.add(i);
  }
  count_ = 0;
  if (candidates.count == 0) return p;
  Choice choice;
  if (!search(p, q, candidates, choice)) {
    // Leaves friction out. Without friction a solution always exists: the point of the convex free space nearest to p.
    ++without_friction_;
    candidates.friction = false;
    if (!search(p, q, candidates, choice)) return q;
  }
  for (std::size_t c = 0; c < 3 && choice.face[c] != none; ++c) {
    const Face& face = faces_[choice.face[c]];
    contacts_[c] = {face.object < 0 ? static_cast<std::int32_t>(choice.face[c]) : face.object, face.feature,
                    choice.slips[c], face.surface.normal()};
    ++count_;
  }
  return choice.r;
}

}  // namespace proxarm::models
