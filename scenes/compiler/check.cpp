#include "scenes/compiler/check.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>

#include "models/base/random.hpp"
#include "models/surfaces/contact_judge.hpp"
#include "models/surfaces/mechanistic_map.hpp"
#include "models/world/media.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/compiler/obstacles.hpp"
#include "scenes/compiler/section.hpp"

namespace proxarm::scenes {
namespace {

using models::lift;
using models::Random;
using models::Vec;
using models::Vec3;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

template <int N>
struct State {
  double K = 0.0;
  Vec<N> p, q, r;
  std::vector<models::Contact<N>> contacts;
  bool unresolved = false;

  [[nodiscard]] Vec<N> f() const { return K * (r - p); }
  [[nodiscard]] double size() const { return 0.1 + r.norm() + p.norm() + q.norm() + (r - p).norm(); }
  [[nodiscard]] std::string text() const {
    std::ostringstream out;
    out.precision(17);
    const auto vector = [&](const char* name, const Vec<N>& v) {
      out << ", " << name << " = [";
      for (int i = 0; i < N; ++i) out << (i > 0 ? ", " : "") << v[i];
      out << "]";
    };
    out << "K = " << K;
    vector("p", p);
    vector("q", q);
    vector("r", r);
    return out.str();
  }
};

template <int N>
State<N> ask(models::GeometricAlgorithm<N>& g, double K, const Vec<N>& p, const Vec<N>& q) {
  const std::uint64_t before = g.unresolved_steps();
  State<N> s{K, p, q, g(K, p, q), {}, false};
  s.contacts.assign(g.contacts().begin(), g.contacts().end());
  s.unresolved = g.unresolved_steps() != before;
  return s;
}

template <int N>
double condition(const State<N>& s) {
  return models::rounding_amplification<N>(s.contacts);
}

// Returns 0 if the contacts can exert the force f within rounding, else 2 (a failure).
template <int N>
double outside_laws(const State<N>& s, const CheckRegion<N>& region) {
  const double viscous = region.viscous_N_per_m ? region.viscous_N_per_m(s.q) : 0.0;
  double tolerance = condition(s) * 64.0 * epsilon * (s.K + viscous) * s.size();
  const Vec3 f = lift<N>(s.f() + viscous * (s.r - s.q)), motion = lift<N>(s.r - s.q);
  const auto friction = [&](const models::Contact<N>& contact) -> std::optional<double> {
    if (!region.friction) return std::nullopt;
    const auto object = static_cast<std::size_t>(contact.object);
    return N == 1 || object >= region.friction->size() ? 0.0 : (*region.friction)[object];
  };
  const auto moved = [&](const auto& /*contact*/) { return motion; };
  if (models::creep_m<N>(s.contacts, friction, moved) > condition(s) * 64.0 * epsilon * s.size()) return 2.0;
  const std::vector<models::ForceCone> cones =
      models::cones_of_contacts<N>(s.contacts, s.size(), friction, moved,
                                   [&](double mu, double angle) { tolerance += mu * f.norm() * angle * condition(s); });
  return models::in_sum_of_cones(f, cones, tolerance) ? 0.0 : 2.0;
}

enum Figure { finite, repeatable, independent, laws, rest, figure_count };

template <int N>
class Checker {
 public:
  Checker(models::GeometricAlgorithm<N>& g, const CheckRegion<N>& region, const CheckOptions& options)
      : g_(g), region_(region), options_(options), random_(options.seed) {
    report_.several_allowed = options.several_allowed;
    report_.figures.resize(figure_count);
    report_.figures[finite].what = "finite";
    report_.figures[repeatable].what = "repeatable";
    report_.figures[independent].what = "independent of K";
    report_.figures[laws].what = region.friction ? "force within its laws" : "force doesn't pull";
    report_.figures[rest].what = "rests where it is";
  }

  CheckReport run() {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begin = Clock::now();
    const double most_s = options_.most_s_per_state * static_cast<double>(options_.states);
    report_.asked = options_.states;
    report_.expects_contact = region_.touches;
    const auto is_late = [&] {
      report_.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
      return report_.seconds > most_s;
    };
    for (std::int64_t i = 0; i < options_.states && !is_late(); ++i) one();
    return report_;
  }

 private:
  void note(Figure figure, double worst, const State<N>& s, const std::string& more = {}) {
    CheckFigure& f = report_.figures[figure];
    if (!(worst <= 1.0)) ++f.failures;
    if (!(worst <= f.worst)) {
      f.worst = worst;
      f.state = s.text() + more;
    }
  }

  // Counts a state in `sum`. Stores the text of the first state of each kind in `first`.
  void count(std::int64_t& sum, std::string& first, const State<N>& s, const std::string& more = {}) {
    if (sum++ == 0) first = s.text() + more;
  }

  Vec<N> start() {
    if (region_.places.empty()) return region_.centre + random_.template in_box<N>(region_.size_m);
    const auto k = static_cast<std::size_t>(random_.uniform(0.0, static_cast<double>(region_.places.size())));
    return region_.places[std::min(k, region_.places.size() - 1)];
  }

  void one() {
    ++report_.states;
    const double K = random_.log_uniform(1.0, 1e7);
    // q must be a place where a proxy can be. So the proxy comes to rest and then, in two thirds of the states, slides
    // a little.
    const Vec<N> x = start();
    Vec<N> q = g_(K, x, g_(K, x, x));
    const int slides = static_cast<int>(random_.uniform(0.0, 3.0));
    for (int k = 0; k < slides; ++k) q = g_(K, q + options_.deepest_m * random_.template direction<N>(), q);
    const Vec<N> p = q + random_.log_uniform(1e-9, options_.deepest_m) * random_.template direction<N>();
    const State<N> s = ask<N>(g_, K, p, q);
    if (!s.r.allFinite()) return note(finite, infinity, s);
    report_.in_contact += s.contacts.empty() ? 0 : 1;
    for (const auto& contact : s.contacts) report_.slipping += contact.slips ? 1 : 0;
    if (s.unresolved) return count(report_.unresolved, report_.unresolved_state, s);

    if (!region_.acts_without_contact) note(laws, outside_laws(s, region_), s);
    for (int k = 0; k < 3; ++k) other_stiffness(s);
    if (!region_.acts_without_contact && !region_.soft) {
      const Vec<N> stays = g_(K, s.r, s.r);
      note(rest, (stays - s.r).norm() / (1e-12 * std::max(1.0, s.r.norm())), s);
    }
    const Vec<N> again = g_(K, p, q);
    note(repeatable, (again.array() == s.r.array()).all() ? 0.0 : 2.0, s);
  }

  void other_stiffness(const State<N>& s) {
    const Vec<N> f = s.f();
    const double decades = random_.uniform(-options_.kappa_decades, options_.kappa_decades);
    const double kappa = std::max(s.K * std::pow(10.0, decades), f.norm() / options_.deepest_m);
    const State<N> other = ask<N>(g_, kappa, Vec<N>(s.r - f / kappa), s.q);
    const double sizes = (0.1 + s.r.norm() + s.q.norm()) * (1.0 + s.K / kappa);
    const double allowed = condition(s) * 64.0 * epsilon * (sizes + f.norm() / kappa) +
                           (region_.has_coulomb_medium ? 2048.0 * epsilon * sizes : 0.0);
    const double error = (other.r - s.r).norm() / allowed;
    // If both answers obey the laws, Coulomb's law itself has several solutions here, and the algorithm is right.
    const bool lawful =
        region_.bends || (region_.friction && !region_.acts_without_contact && !(outside_laws(other, region_) > 1.0));
    const std::string more = ", κ = " + std::to_string(kappa);
    if (!(error <= 1.0) && other.unresolved) {
      return count(report_.unresolved, report_.unresolved_state, s, more);
    }
    const auto reached = [](const models::Contact<N>& contact) { return contact.reached; };
    if (!(error <= 1.0) && other.r.allFinite() && lawful &&
        (std::any_of(s.contacts.begin(), s.contacts.end(), reached) ||
         std::any_of(other.contacts.begin(), other.contacts.end(), reached))) {
      return count(report_.ways, report_.ways_state, s, more);
    }
    if (!(error <= 1.0) && other.r.allFinite() && lawful) {
      return count(report_.several, report_.several_state, s, more);
    }
    note(independent, error, s, more);
  }

  models::GeometricAlgorithm<N>& g_;
  const CheckRegion<N>& region_;
  const CheckOptions& options_;
  Random random_;
  CheckReport report_;
};

// Returns the point of the proxy's space that is nearest to x.
Vec3 onto(const Space& space, const Vec3& x_W) {
  if (space.dimensions == 3) return x_W;
  const auto axes = space.axes.leftCols(space.dimensions);
  return space.origin_m + axes * (axes.transpose() * (x_W - space.origin_m));
}

// Returns points of the proxy's space just outside of an object's surface, near enough that states can push onto it.
// The points are found by Newton steps along the gradient of the distance.
std::vector<Vec3> around(const Object& object, const Space& space, Random& random, int count, double deepest_m) {
  const Vec3 middle = middle_of(object.shape);
  const double size = size_of(object.shape);
  const double off = std::min(1e-3 * size, 0.25 * deepest_m);
  std::vector<Vec3> places;
  for (int i = 0; i < count; ++i) {
    Vec3 x = onto(space, middle + random.in_box<3>(1.2 * size));
    for (int k = 0; k < 20; ++k) {
      const double d = distance_to(object, x), h = 1e-6 * size;
      Vec3 slope = Vec3::Zero();
      for (int a = 0; a < space.dimensions; ++a) {
        const Vec3 axis = space.dimensions == 3 ? Vec3(Vec3::Unit(a)) : Vec3(space.axes.col(a));
        slope += (distance_to(object, x + h * axis) - d) / h * axis;
      }
      // If the space cuts the object, the gradient within the space is shorter than one.
      x -= (d - off) / (space.dimensions == 3 ? 1.0 : std::max(slope.squaredNorm(), 0.1)) * slope;
      if (std::abs(d - off) < 0.1 * off) break;
    }
    places.push_back(x);
  }
  return places;
}

// Returns free points of a guide, half of them within 2 mm of an object. The points are found from random points by
// steps along the guide; the length of each step is the clearance.
std::vector<Vec3> on_guide(const Scene& scene, const Clearances& clearances, Random& random) {
  GuideDescription guide = guide_in_space(scene);
  if (scene.space.dimensions < 3) {
    for (Vec3& point : guide.points_m) point = scene.space.origin_m + scene.space.axes * point;
    guide.direction = scene.space.axes * guide.direction;
  }
  std::vector<Vec3> places;
  for (int i = 0; i < 400; ++i) {
    Vec3 x = guide.points_m.front(), along = guide.direction.normalized();
    if (guide.kind == GuideDescription::Kind::plane) {
      along = along.cross(random.direction<3>()).normalized();
    } else if (guide.kind == GuideDescription::Kind::polyline) {
      const std::size_t pieces = guide.points_m.size() - (guide.closed ? 0 : 1);
      const auto k = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(pieces))) % pieces;
      x = guide.points_m[k];
      along = guide.points_m[(k + 1) % guide.points_m.size()] - x;
    }
    const bool bounded = guide.kind == GuideDescription::Kind::polyline;
    double s = bounded ? random.uniform(0.0, 1.0) : random.uniform(-1.0, 1.0);
    double room = clearances.of_point(x + s * along);
    const double way = (random.uniform(0.0, 1.0) < 0.5 ? 1.0 : -1.0) / along.norm();
    for (int k = 0; k < 100 && i % 2 == 1 && room > 2e-3 && room < 1.0; ++k) {
      const double next = s + way * (room - 1e-3);
      if (bounded && !(next > 0.0 && next < 1.0)) break;
      s = next;
      room = clearances.of_point(x + s * along);
    }
    if (room >= 0.0) places.push_back(x + s * along);
  }
  return places;
}

template <int N>
CheckReport check_whole(const Scene& scene, const std::vector<Vec3>& places, const CheckOptions& options) {
  const CompiledScene compiled = compile(scene);
  models::GeometricAlgorithm<N>& g = compiled.algorithm<N>();
  g.set_time({.time_s = 0.0, .period_s = 0.0});  // a period of zero stops all motion
  CheckRegion<N> region;
  region.friction.emplace();
  for (const Object& object : scene.objects) {
    region.friction->push_back(object.friction);
    region.soft = region.soft || object.layer.has_value();
  }
  // Contacts don't report the friction region of a mesh, so the friction of a mesh with regions counts as unknown.
  const auto has_regions = [](const Object& object) { return !object.friction_regions.empty(); };
  if (std::any_of(scene.objects.begin(), scene.objects.end(), has_regions)) region.friction.reset();
  region.touches = !scene.objects.empty() && !scene.guide;
  region.has_coulomb_medium = std::any_of(scene.media.begin(), scene.media.end(),
                                          [](const MediumDescription& medium) { return medium.force_N > 0.0; });
  region.acts_without_contact = region.has_coulomb_medium || scene.coulomb_force_N || scene.guide;
  std::vector<models::Medium> media;
  for (const MediumDescription& medium : scene.media) {
    media.push_back({medium.damping_Ns_per_m, 0.0, medium.within ? region_of(*medium.within) : nullptr});
  }
  if (!media.empty()) {
    region.viscous_N_per_m = [&](const Vec<N>& q) {
      double sum = 0.0;
      for (const models::Medium& medium : media) {
        if (medium.shape != nullptr && medium.shape->distance(compiled.to_W<N>(q)) > 0.0) continue;
        sum += medium.damping_Ns_per_m / models::Media<N>::first_period_s;
      }
      return sum;
    };
  }
  region.bends = scene.guide && scene.guide->kind == GuideDescription::Kind::polyline;
  if (scene.guide) region.centre = compiled.from_W<N>(scene.guide->points_m.front());
  // With a guide, states start on the guide, because a proxy is on it before it meets objects.
  Random random(options.seed);
  const bool guided = scene.guide && !scene.objects.empty();
  const Clearances clearances(scene);
  for (const Vec3& x : guided ? on_guide(scene, clearances, random) : places) {
    // Use only places that are outside of all objects.
    if (clearances.of_point(x) >= 0.0) region.places.push_back(compiled.from_W<N>(x));
  }
  return Checker<N>(g, region, options).run();
}

CheckReport check_scene_once(const Scene& scene, const std::vector<Vec3>& places, const CheckOptions& options) {
  if (scene.space.dimensions == 1) return check_whole<1>(scene, places, options);
  if (scene.space.dimensions == 2) return check_whole<2>(scene, places, options);
  return check_whole<3>(scene, places, options);
}

}  // namespace

CheckVerdict CheckReport::verdict() const noexcept {
  const double allowed = several_allowed * static_cast<double>(states);
  const auto failed = [](const CheckFigure& figure) { return figure.failures > 0; };
  if (std::any_of(figures.begin(), figures.end(), failed) || static_cast<double>(unresolved) > allowed) {
    return CheckVerdict::wrong;
  }
  if (expects_contact && in_contact == 0) return CheckVerdict::untouched;
  return static_cast<double>(several + ways) > allowed ? CheckVerdict::several_solutions : CheckVerdict::fine;
}

std::string CheckReport::text() const {
  std::ostringstream out;
  out.precision(3);
  const double allowed = several_allowed * static_cast<double>(states);
  const auto percent = [this](std::int64_t count) {
    return 100.0 * static_cast<double>(count) / static_cast<double>(states);
  };
  const CheckVerdict is = verdict();
  const char* const word = is == CheckVerdict::wrong ? "WRONG" : is == CheckVerdict::untouched ? "NO VERDICT" : "fine";
  out << subject << ": " << word << " in " << states << " states, " << in_contact << " in contact, " << slipping
      << " slipping contacts";
  if (several > 0) out << ", " << several << " where there are several solutions";
  if (ways > 0) out << ", " << ways << " where the way over the mesh depends on K";
  if (unresolved > 0) out << ", " << unresolved << " without an answer";
  out << "\n";
  if (is == CheckVerdict::untouched) {
    out << "  nothing was touched: push deeper (--depth), or move the object to where it is free\n";
  }
  if (states < asked) {
    out << "  stopped after " << seconds << " s, of " << asked
        << " states: " << 1e3 * seconds / static_cast<double>(states)
        << " ms each, as where hundreds of faces or objects lie on one another; a session would miss its period "
           "there\n";
  }
  if (ways > 0) {
    out << "  the way over the mesh depends on K in " << percent(ways)
        << " % of the states: the proxy slides over some faces and is held by others, and where it is held depends on "
           "the way (shorter steps: less); the first at "
        << ways_state << "\n";
  }
  if (static_cast<double>(several) > allowed) {
    out << "  several solutions in " << percent(several)
        << " % of the states, where friction leaves open which one it is (more friction, sharper corners: more): a "
           "session takes one and stays with it; the first at "
        << several_state << "\n";
  }
  if (static_cast<double>(unresolved) > allowed) {
    out << "  no answer in " << percent(unresolved)
        << " % of the states: no contacts, or shares of the force among layers, were found that keep all laws; the "
           "first "
           "at "
        << unresolved_state << "\n";
  }
  for (const CheckFigure& figure : figures) {
    out << "  " << figure.what << ": worst " << figure.worst << " of what rounding explains";
    if (figure.failures > 0) out << ", " << figure.failures << " failures, worst at " << figure.state;
    out << "\n";
  }
  return out.str();
}

template <int N>
CheckReport check_algorithm(models::GeometricAlgorithm<N>& g, const CheckRegion<N>& region,
                            const CheckOptions& options) {
  CheckReport report = Checker<N>(g, region, options).run();
  report.subject = "algorithm";
  return report;
}

template CheckReport check_algorithm<1>(models::GeometricAlgorithm<1>&, const CheckRegion<1>&, const CheckOptions&);
template CheckReport check_algorithm<2>(models::GeometricAlgorithm<2>&, const CheckRegion<2>&, const CheckOptions&);
template CheckReport check_algorithm<3>(models::GeometricAlgorithm<3>&, const CheckRegion<3>&, const CheckOptions&);

namespace {

// Returns the smallest radius of the round solid objects; infinity if there are none.
double least_radius_m(const Scene& scene) {
  double least = infinity;
  for (const Object& object : scene.objects) {
    std::visit(
        [&](const auto& shape) {
          if constexpr (requires { shape.radius_m; }) {
            if (!shape.inside_out) least = std::min(least, shape.radius_m);
          }
        },
        object.shape);
  }
  return least;
}

}  // namespace

double deepest_push_m(const Scene& scene, const CheckOptions& options) {
  return std::min(options.deepest_m, 0.1 * least_radius_m(scene));
}

std::vector<CheckReport> check_scene(const Scene& scene, const CheckOptions& given) {
  CheckOptions options = given;
  options.deepest_m = deepest_push_m(scene, given);
  std::vector<CheckReport> reports;
  Random random(options.seed);
  std::vector<Vec3> all;
  for (const Object& object : scene.objects) {
    const std::vector<Vec3> places =
        around(object, scene.space, random, scene.objects.size() > 100 ? 4 : 200, options.deepest_m);
    all.insert(all.end(), places.begin(), places.end());
    if (scene.objects.size() < 2 || scene.objects.size() > 100) continue;
    Scene alone = scene;
    alone.objects = {object};
    CheckReport report = check_scene_once(alone, places, options);
    report.subject = object.name;
    reports.push_back(std::move(report));
  }
  CheckReport whole = check_scene_once(scene, all, options);
  whole.subject = scene.objects.size() > 1 ? scene.name + ", all together" : scene.name;
  reports.push_back(std::move(whole));
  return reports;
}

}  // namespace proxarm::scenes
