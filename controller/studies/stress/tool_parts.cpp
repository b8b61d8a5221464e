#include "controller/studies/stress/tool_parts.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace proxarm::studies {
namespace {

constexpr int kEighths = 8;
constexpr double kLeast = 1e-12;  // of the way, a part
constexpr std::size_t kMost = 200;
// A foot may lie so far beside its feature and count (touch.hpp, beside_m): before an edge by that, and behind it.
constexpr double kBeside_m = 1e-10;

}  // namespace

ToolParts::Pose ToolParts::pose_at(const ToolCall& call, double share, const models::ToolPose& from) const {
  Pose out{share, call, 0.0};
  const auto g = fresh_.clone();
  out.call.p = models::moved(call.q, share * models::difference(call.p, call.q));
  out.call.r = g->step(call.K, out.call.p, from);
  out.call.contacts.assign(g->contacts().begin(), g->contacts().end());
  out.call.unresolved = g->unresolved();
  out.short_m = laws_.depth_m(out.call.r);
  return out;
}

double ToolParts::pushed_J(const Pose& from, const Pose& to) const {
  ToolCall part = to.call;
  part.q = from.call.r;
  return laws_.pushed_J(part, std::max(from.short_m, 0.0) + 2.0 * kBeside_m);
}

double ToolParts::least_J(const std::vector<Pose>& poses) const {
  std::vector<double> least(poses.size(), std::numeric_limits<double>::infinity());
  least.front() = 0.0;
  for (std::size_t j = 1; j < poses.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) least[j] = std::min(least[j], least[i] + pushed_J(poses[i], poses[j]));
  }
  return least.back();
}

bool ToolParts::keep(const ToolCall& call, double short_m, std::vector<models::PoseContact>& touched) const {
  Pose begin{0.0, call, short_m};
  begin.call.r = call.q;
  std::vector<Pose> poses{begin, {1.0, call, 0.0}};
  std::vector<Part> parts{{pushed_J(poses[0], poses[1]), true}};
  // Divides the part that ends at a pose; false if nothing is known there.
  const auto divide = [&](std::size_t i, double share) {
    Pose middle = pose_at(call, share, call.q);
    if (middle.call.unresolved) middle = pose_at(call, share, poses[i - 1].call.r);
    if (middle.call.unresolved) return false;
    touched.insert(touched.end(), middle.call.contacts.begin(), middle.call.contacts.end());
    parts[i - 1] = {pushed_J(middle, poses[i]), poses[i].share - share > kLeast};
    parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(i) - 1,
                 {pushed_J(poses[i - 1], middle), share - poses[i - 1].share > kLeast});
    poses.insert(poses.begin() + static_cast<std::ptrdiff_t>(i), middle);
    return true;
  };
  for (int k = 1; k < kEighths; ++k) divide(poses.size() - 1, static_cast<double>(k) / kEighths);
  const auto less = [](const Part& a, const Part& b) {
    return std::pair(a.divides, a.pushed_J) < std::pair(b.divides, b.pushed_J);
  };
  const double allowed_J = laws_.curvature_J(call);
  while (poses.size() < kMost) {
    double sum_J = 0.0;
    for (const Part& part : parts) sum_J += part.pushed_J;
    if (sum_J <= allowed_J) return true;
    const auto most = std::max_element(parts.begin(), parts.end(), less);
    if (!most->divides) break;
    const auto i = static_cast<std::size_t>(most - parts.begin()) + 1;
    if (!divide(i, 0.5 * (poses[i - 1].share + poses[i].share))) parts[i - 1].divides = false;
  }
  return least_J(poses) <= allowed_J;
}

}  // namespace proxarm::studies
