#include "controller/studies/stress/tool_parts.hpp"

#include <algorithm>

namespace proxarm::studies {
namespace {

constexpr int kEighths = 8;
constexpr double kLeast = 1e-12;  // of the way, a part
constexpr std::size_t kMost = 100;
// A foot may lie so far beside its feature and count (touch.hpp, beside_m): before an edge by that, and behind it.
constexpr double kBeside_m = 1e-10;

// The middle of the widest part of a way between two places; no wider than kLeast: none, 0. (Poses for which no forces
// were found are left out, so that there may be more than one.)
double middle_of_widest(const std::vector<double>& shares, double from, double to) {
  double widest = kLeast, middle = 0.0;
  for (auto i = std::lower_bound(shares.begin(), shares.end(), from); *i < to; ++i) {
    if (!(i[1] - i[0] > widest)) continue;
    widest = i[1] - i[0];
    middle = 0.5 * (i[0] + i[1]);
  }
  return middle;
}

}  // namespace

void ToolParts::follow(const ToolCall& call, const std::vector<double>& shares, std::vector<Pose>& way) const {
  const double reached = way.back().share;
  for (auto share = std::upper_bound(shares.begin(), shares.end(), reached); share != shares.end(); ++share) {
    Pose next{*share, call, 0.0};
    const auto g = fresh_.clone();
    next.call.p = models::moved(call.q, *share * models::difference(call.p, call.q));
    next.call.r = g->step(call.K, next.call.p, way.back().call.r);
    if (g->unresolved()) continue;
    next.call.contacts.assign(g->contacts().begin(), g->contacts().end());
    next.short_m = laws_.depth_m(next.call.r);
    way.push_back(next);
  }
}

double ToolParts::pushed_J(const Pose& from, const Pose& to) const {
  ToolCall part = to.call;
  part.q = from.call.r;
  return laws_.pushed_J(part, std::max(from.short_m, 0.0) + 2.0 * kBeside_m);
}

ToolParts::Sum ToolParts::sum_of(const std::vector<Pose>& way, const std::vector<double>& shares,
                                 const ToolCall& call) const {
  const Pose end{1.0, call, 0.0}, &last = way.back();
  const bool arrives = last.share == 1.0;
  const bool either = arrives && pushed_J(way.front(), end) <= pushed_J(way.front(), last);
  const std::size_t parts = arrives ? way.size() - 1 : way.size();
  Sum sum;
  for (std::size_t k = 0; k < parts; ++k) {
    const bool to_end = k + 1 == parts;
    double pushed = pushed_J(way[k], to_end ? end : way[k + 1]);
    if (to_end && either) pushed = std::min(pushed, pushed_J(way[k], last));
    sum.all_J += pushed;
    const double middle = middle_of_widest(shares, way[k].share, to_end ? 1.0 : way[k + 1].share);
    if (middle == 0.0) sum.undivided_J += pushed;
    if (middle == 0.0 || !(pushed > sum.most_J)) continue;
    sum.most_J = pushed;
    sum.share = middle;
    sum.before = k;
  }
  return sum;
}

bool ToolParts::keep(const ToolCall& call, double short_m, std::vector<models::PoseContact>& touched) const {
  std::vector<double> shares;
  for (int k = 0; k <= kEighths; ++k) shares.push_back(static_cast<double>(k) / kEighths);
  std::vector<Pose> way{{0.0, call, short_m}};
  way.front().call.r = call.q;
  const double allowed_J = laws_.curvature_J(call);
  follow(call, shares, way);
  Sum sum = sum_of(way, shares, call);
  while (sum.all_J > allowed_J && sum.undivided_J <= allowed_J && sum.most_J > 0.0 && shares.size() < kMost) {
    shares.insert(std::upper_bound(shares.begin(), shares.end(), sum.share), sum.share);
    way.erase(way.begin() + static_cast<std::ptrdiff_t>(sum.before) + 1, way.end());
    follow(call, shares, way);
    sum = sum_of(way, shares, call);
  }
  for (std::size_t k = 1; k < way.size(); ++k) {
    if (way[k].share == 1.0) continue;
    touched.insert(touched.end(), way[k].call.contacts.begin(), way[k].call.contacts.end());
  }
  return sum.all_J <= allowed_J;
}

}  // namespace proxarm::studies
