#include "controller/extras/studies/stress/tool_parts.hpp"

#include <algorithm>
#include <array>

#include "models/base/random.hpp"

namespace proxarm::studies {
namespace {

// The numbers of parts into which a path is divided at first. They are tried in this order.
constexpr std::array kFirst{8, 1, 3, 5, 7, 13, 29};
constexpr double kLeast = 1e-12;  // smallest size of a part, as a share of the path or of a wait
constexpr std::size_t kMost = 400;
// How far a contact point may lie beside its feature, before and behind an edge (touch.hpp, beside_m).
constexpr double kBeside_m = 1e-10;
// How far a path is displaced from a point. Contacts that are nearer to each other than this count as being at one
// point.
constexpr double kAside_m = 10.0 * kBeside_m;
// Number of directions in which a tool is displaced. In replay 5693172070329278 a fifth of the directions lead away
// from the vertex: those that lead out of the object and to the other side.
constexpr int kAsides = 32;

// Returns whether several contacts with one object press at one place.
bool lies_on_point(const std::vector<models::PoseContact>& contacts) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const models::PoseContact &a = contacts[i], &b = contacts[j];
      if (a.object != b.object || a.force_W.isZero(0.0) || b.force_W.isZero(0.0)) continue;
      if ((a.point_W - b.point_W).norm() <= kAside_m) return true;
    }
  }
  return false;
}

}  // namespace

// Returns the middle between two successive marks: on the path, or, if the path can't be divided there, in the wait at
// the second mark. Returns nullopt if the wait can't be divided either.
std::optional<ToolParts::Mark> ToolParts::between(const Mark& a, const Mark& b) {
  if (b.share - a.share > kLeast) return Mark{0.5 * (a.share + b.share), 1.0};
  const double waited = a.share == b.share ? a.waited : 0.0;
  if (b.waited - waited > kLeast) return Mark{b.share, 0.5 * (waited + b.waited)};
  return {};
}

// Returns where to divide the path between the poses at `from` and `to`; nullopt if it can't be divided. The marks
// between them found no forces. A smaller step from the first pose may find some, so the gap after `from` is divided.
// If that gap can't be divided, the widest one of the others is.
std::optional<ToolParts::Mark> ToolParts::divide(const std::vector<Mark>& marks, const Mark& from, const Mark& to) {
  auto i = std::lower_bound(marks.begin(), marks.end(), from);
  if (const auto first = between(i[0], i[1])) return first;
  double widest = 0.0;
  std::optional<Mark> out;
  for (++i; *i < to; ++i) {
    const auto middle = between(i[0], i[1]);
    if (!middle || !(i[1].share - i[0].share > widest)) continue;
    widest = i[1].share - i[0].share;
    out = middle;
  }
  return out;
}

models::ToolPose ToolParts::from(const Pose& pose, Going& going) const {
  const models::ToolPose& r = pose.call.r;
  if (!lies_on_point(pose.call.contacts)) return r;
  going.lay = true;
  if (going.aside.isZero(0.0)) return r;
  const models::ToolPose out = models::moved(r, going.aside);
  return laws_.depth_m(out, pose.call.time_s) <= 0.0 ? out : r;
}

bool ToolParts::find(Pose& pose, const Pose& last, const models::ToolPose& start, double drawn) const {
  const auto g = fresh_.clone();
  ToolCall& call = pose.call;
  g->set_time({.time_s = call.time_s, .period_s = call.time_s - last.call.time_s});
  call.r = g->step(call.K, call.p, start);
  if (g->unresolved()) return false;
  call.contacts.assign(g->contacts().begin(), g->contacts().end());
  for (models::PoseContact& contact : call.contacts) contact.force_W /= drawn;
  pose.short_m = laws_.depth_m(call.r, call.time_s);
  return true;
}

void ToolParts::follow(const ToolCall& call, const std::vector<Mark>& marks, Going& going,
                       std::vector<Pose>& way) const {
  const Mark reached = way.back().mark;
  for (auto mark = std::upper_bound(marks.begin(), marks.end(), reached); mark != marks.end(); ++mark) {
    Pose next{*mark, call, 0.0};
    const Pose& last = way.back();
    const models::ToolPose start = from(last, going);
    next.call.p = models::moved(call.q, mark->share * models::difference(call.p, call.q));
    const double since = last.mark.share == mark->share ? last.mark.waited : 0.0, waited = mark->waited;
    // η = h/(1 + h), where h is the difference of τ from `since` to `waited`.
    const double drawn = waited == 1.0 ? 1.0 : (waited - since) / (waited - since + (1.0 - since) * (1.0 - waited));
    if (drawn < 1.0) next.call.p = models::moved(start, drawn * models::difference(next.call.p, start));
    next.call.time_s = time_of(call, *mark);
    const bool found =
        find(next, last, start, drawn) || (going.from_q && drawn == 1.0 && find(next, way.front(), call.q, 1.0));
    if (found) way.push_back(next);
  }
}

double ToolParts::pushed_J(const Pose& from, const Pose& to) const {
  ToolCall part = to.call;
  part.q = from.call.r;
  part.since_s = from.call.time_s;
  laws_.carry(part);
  return laws_.pushed_J(part, std::max(from.short_m, 0.0) + 2.0 * kBeside_m);
}

ToolParts::Sum ToolParts::sum_of(const std::vector<Pose>& way, const std::vector<Mark>& marks,
                                 const ToolCall& call) const {
  const Pose end{{1.0, 1.0}, call, 0.0}, &last = way.back();
  const bool arrives = last.mark == end.mark;
  const bool either = arrives && pushed_J(way.front(), end) <= pushed_J(way.front(), last);
  const std::size_t parts = arrives ? way.size() - 1 : way.size();
  Sum sum;
  for (std::size_t k = 0; k < parts; ++k) {
    const bool to_end = k + 1 == parts;
    double pushed = pushed_J(way[k], to_end ? end : way[k + 1]);
    if (to_end && either) pushed = std::min(pushed, pushed_J(way[k], last));
    sum.all_J += pushed;
    const auto middle = divide(marks, way[k].mark, to_end ? end.mark : way[k + 1].mark);
    if (!middle) sum.undivided_J += pushed;
    if (!middle || !(pushed > sum.most_J)) continue;
    sum.most_J = pushed;
    sum.divide = *middle;
    sum.before = k;
  }
  return sum;
}

bool ToolParts::keep(const ToolCall& call, double short_m, double rest_J,
                     std::vector<models::PoseContact>& touched) const {
  const std::size_t before = touched.size();
  Going going;
  const auto keeps = [&](int parts) {
    touched.resize(before);
    return keep_from(parts, going, call, short_m, rest_J, touched);
  };
  if (std::any_of(kFirst.begin(), kFirst.end(), keeps)) return true;
  models::Random random(std::uint64_t{1});
  for (int k = 0; k < kAsides && going.lay; ++k) {
    going.aside << kAside_m * random.direction(), kAside_m / ToolLaws::lever_m * random.direction();
    if (keeps(kFirst.front())) return true;
  }
  going = {.from_q = true};
  return std::any_of(kFirst.begin(), kFirst.end(), keeps);
}

bool ToolParts::keep_from(int parts, Going& going, const ToolCall& call, double short_m, double rest_J,
                          std::vector<models::PoseContact>& touched) const {
  std::vector<Mark> marks;
  for (int k = 0; k <= parts; ++k) marks.push_back({static_cast<double>(k) / parts, 1.0});
  std::vector<Pose> way{{marks.front(), call, short_m}};
  way.front().call.r = call.q;
  way.front().call.time_s = call.since_s;
  const double allowed_J = laws_.curvature_J(call);
  const std::size_t before = touched.size();
  while (true) {
    follow(call, marks, going, way);
    touched.resize(before);
    for (std::size_t k = 1; k < way.size(); ++k) {
      if (way[k].mark.share == 1.0) continue;
      const auto met = laws_.carried(way[k].call.contacts, way[k].call.time_s, call.time_s);
      touched.insert(touched.end(), met.begin(), met.end());
    }
    const Sum sum = sum_of(way, marks, call);
    if (sum.all_J <= allowed_J && rest_J <= laws_.edges_J(call, touched)) return true;
    if (sum.undivided_J > allowed_J || !(sum.most_J > 0.0) || marks.size() >= kMost) return false;
    marks.insert(std::upper_bound(marks.begin(), marks.end(), sum.divide), sum.divide);
    way.erase(way.begin() + static_cast<std::ptrdiff_t>(sum.before) + 1, way.end());
  }
}

}  // namespace proxarm::studies
