#include "models/plane_composition.hpp"

#include <limits>
#include <stdexcept>

namespace proxarm::models {
namespace {

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
constexpr std::size_t stored_lines = 32;   // 32² lines of 160 bytes: 160 kB
constexpr std::size_t stored_corners = 8;  // 8³ corners of 104 bytes: 53 kB

}  // namespace

// The faces that may be part of the solution: those that p is behind, and those that a trial ran into.
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

struct PlaneComposition::Choice {
  double distance2 = std::numeric_limits<double>::infinity();  // ‖r − p‖²
  Vec3 r = Vec3::Zero();
  std::array<std::size_t, 3> face{none, none, none};
  std::array<bool, 3> slips{};

  [[nodiscard]] bool found() const noexcept { return distance2 < std::numeric_limits<double>::infinity(); }
  void consider(const Vec3& p, const Vec3& at, std::array<std::size_t, 3> faces, std::array<bool, 3> slip) noexcept {
    const double d2 = (at - p).squaredNorm();
    if (d2 < distance2) {
      distance2 = d2;
      r = at;
      face = faces;
      slips = slip;
    }
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

bool PlaneComposition::fits(const Vec3& q, const Vec3& r, std::size_t i, std::size_t j, std::size_t k, bool creeps,
                            Candidates& candidates) const noexcept {
  bool fits = true;
  for (std::size_t m = 0; m < faces_.size(); ++m) {
    if (m == i || m == j || m == k) continue;
    const FlatSurface<3>& surface = faces_[m].surface;
    const double height = surface.height(r);
    // Within rounding it is on the face; but a face that q was on is not to be entered even by so little, or a proxy
    // that is held by two of them would creep along while one alone can't quite hold it.
    if (height < 0.0 && (height < -surface.rounding(r) || (creeps && height < surface.height(q)))) {
      if (candidates.count == faces_.size()) return false;  // nothing to be added
      candidates.add(m);
      fits = false;
    }
  }
  return fits;
}

void PlaneComposition::try_singles(const Vec3& p, const Vec3& q, Candidates& candidates,
                                   Choice& choice) const noexcept {
  for (std::size_t c = 0; c < candidates.count; ++c) {
    const std::size_t i = candidates.index[c];
    const FaceStep step = step_on_face(faces_[i].surface, candidates.friction ? faces_[i].mu : 0.0, p, q);
    if (step.touches && fits(q, step.r, i, none, none, step.slips, candidates)) {
      choice.consider(p, step.r, {i, none, none}, {step.slips, false, false});
    }
  }
}

void PlaneComposition::try_pairs(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept {
  const std::size_t n = faces_.size();
  for (std::size_t c = 1; c < candidates.count; ++c) {
    for (std::size_t d = 0; d < c; ++d) {
      const std::size_t i = std::min(candidates.index[c], candidates.index[d]);
      const std::size_t j = std::max(candidates.index[c], candidates.index[d]);
      const double mu_i = candidates.friction ? faces_[i].mu : 0.0, mu_j = candidates.friction ? faces_[j].mu : 0.0;
      const auto solve = [&](const GrooveLine& line) {
        return solve_groove(faces_[i].surface, mu_i, faces_[j].surface, mu_j, line, p, q, q);
      };
      const GrooveSolution s =
          lines_.empty() ? solve(GrooveLine(faces_[i].surface, faces_[j].surface)) : solve(lines_[i * n + j]);
      if (s.found && fits(q, s.r, i, j, none, false, candidates)) {
        choice.consider(p, s.r, {i, j, none}, {s.slips1, s.slips2, false});
      }
    }
  }
}

void PlaneComposition::try_corners(const Vec3& p, const Vec3& q, Candidates& candidates,
                                   Choice& choice) const noexcept {
  const std::size_t n = faces_.size();
  for (std::size_t c = 2; c < candidates.count; ++c) {
    for (std::size_t d = 1; d < c; ++d) {
      for (std::size_t e = 0; e < d; ++e) {
        std::array<std::size_t, 3> m{candidates.index[c], candidates.index[d], candidates.index[e]};
        std::sort(m.begin(), m.end());
        const auto [i, j, k] = m;
        const FlatSurface<3>* const surfaces[3] = {&faces_[i].surface, &faces_[j].surface, &faces_[k].surface};
        const double mu[3] = {candidates.friction ? faces_[i].mu : 0.0, candidates.friction ? faces_[j].mu : 0.0,
                              candidates.friction ? faces_[k].mu : 0.0};
        const Vec3* const qs[3] = {&q, &q, &q};
        const CornerSolution s =
            corners_.empty() ? solve_corner(surfaces, mu, CornerPoint(*surfaces[0], *surfaces[1], *surfaces[2]), p, qs)
                             : solve_corner(surfaces, mu, corners_[(i * n + j) * n + k], p, qs);
        if (s.found && fits(q, s.r, i, j, k, false, candidates)) {
          choice.consider(p, s.r, m, {s.slips[0], s.slips[1], s.slips[2]});
        }
      }
    }
  }
}

bool PlaneComposition::search(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept {
  // A trial that runs into a face which p isn't behind makes it a candidate, and the search starts again with it.
  do {
    candidates.grew = false;
    try_singles(p, q, candidates, choice);
    if (choice.found()) return true;
    if (candidates.grew) continue;
    try_pairs(p, q, candidates, choice);
    if (choice.found()) return true;
    if (candidates.grew) continue;
    try_corners(p, q, candidates, choice);
    if (choice.found()) return true;
  } while (candidates.grew);
  return false;
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
    // Friction is the first to be given up: without it the nearest point of a convex space always exists.
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
