#include "controller/studies/stress/tool_parts.hpp"

#include <algorithm>

namespace proxarm::studies {
namespace {

constexpr int kHalves = 40;  // 1e-12 of the way
// A foot may lie so far beside its feature and count (touch.hpp, beside_m): before an edge by that, and behind it.
constexpr double kBeside_m = 1e-10;

}  // namespace

ToolParts::At ToolParts::at(const ToolCall& call, double share) const {
  At out{share, call, 0.0};
  const auto g = fresh_.clone();
  out.call.p = models::moved(call.q, share * models::difference(call.p, call.q));
  out.call.r = g->step(call.K, out.call.p, call.q);
  out.call.contacts.assign(g->contacts().begin(), g->contacts().end());
  out.call.unresolved = g->unresolved();
  out.short_m = laws_.depth_m(out.call.r);
  return out;
}

bool ToolParts::keep(const ToolCall& call, double short_m, std::vector<models::PoseContact>& touched) const {
  At begin{0.0, call, short_m};
  begin.call.p = begin.call.r = call.q;
  begin.call.contacts.clear();
  return keep(call, begin, {1.0, call, 0.0}, kHalves, touched);
}

bool ToolParts::keep(const ToolCall& call, const At& from, const At& to, int halves,
                     std::vector<models::PoseContact>& touched) const {
  ToolCall part = to.call;
  part.q = from.call.r;
  if (!(laws_.left_J(part, part.pushed_J(), std::max(from.short_m, 0.0) + 2.0 * kBeside_m) > 0.0)) return true;
  if (halves == 0) return false;
  const At middle = at(call, 0.5 * (from.share + to.share));
  if (middle.call.unresolved) return false;
  touched.insert(touched.end(), middle.call.contacts.begin(), middle.call.contacts.end());
  return keep(call, from, middle, halves - 1, touched) && keep(call, middle, to, halves - 1, touched);
}

}  // namespace proxarm::studies
