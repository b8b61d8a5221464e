#include "controller/extras/studies/stress/stress_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>

#include "controller/extras/studies/stress/random_scene.hpp"
#include "controller/extras/studies/stress/stress_laws.hpp"
#include "controller/extras/studies/stress/tool_run.hpp"
#include "controller/proxies/admittance_proxy.hpp"
#include "models/mesh/mesh_obstacle.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::studies {
namespace {

using controller::AdmittanceProxy;
using models::Contact;
using models::lift;
using models::Vec;
using models::Vec3;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr int steps_per_run = 1000;

// Passes all calls on to 𝒢, and remembers the last call.
template <int N>
class Witness final : public models::GeometricAlgorithm<N> {
 public:
  Witness(models::GeometricAlgorithm<N>& g, const scenes::Scene& scene) : g_(g) {
    for (const scenes::Object& object : scene.objects) {
      const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape);
      auto& mover = movers_.emplace_back();
      if (mesh == nullptr || !object.motion) continue;
      mover = std::make_unique<models::MovingObstacle>(
          std::make_unique<models::MeshObstacle>(mesh->mesh, object.friction), scenes::script_of(*object.motion));
    }
    call_.carried.resize(movers_.size(), Vec3::Zero());
  }

  Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept override {
    const std::uint64_t before = g_.unresolved_steps();
    call_.K = K;
    call_.p = p;
    call_.q = q;
    call_.r = g_(K, p, q);
    call_.unresolved = g_.unresolved_steps() != before;
    call_.contacts.assign(g_.contacts().begin(), g_.contacts().end());
    for (std::size_t i = 0; i < movers_.size(); ++i) {
      if (movers_[i]) call_.carried[i] = movers_[i]->carry(lift<N>(q));
    }
    return call_.r;
  }
  void set_time(const models::StepTime& time) noexcept override {
    call_.time = time;
    g_.set_time(time);
    for (const auto& mover : movers_) {
      if (mover) mover->set_time(time.time_s, time.period_s);
    }
  }
  [[nodiscard]] std::uint32_t media_at(const Vec<N>& q) const noexcept override { return g_.media_at(q); }
  [[nodiscard]] bool has_media() const noexcept override { return g_.has_media(); }
  [[nodiscard]] bool squeezed() const noexcept override { return g_.squeezed(); }
  [[nodiscard]] std::span<const Contact<N>> contacts() const noexcept override { return call_.contacts; }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return g_.unresolved_steps(); }

  [[nodiscard]] const Call<N>& call() const noexcept { return call_; }
  // Repeats the last call with another stiffness and another p.
  Call<N> ask(double K, const Vec<N>& p) {
    Call<N> other = call_;
    const std::uint64_t before = g_.unresolved_steps();
    other.K = K;
    other.p = p;
    other.r = g_(K, p, call_.q);
    other.unresolved = g_.unresolved_steps() != before;
    other.contacts.assign(g_.contacts().begin(), g_.contacts().end());
    return other;
  }

 private:
  models::GeometricAlgorithm<N>& g_;
  // One per object; null unless the object is a moving mesh.
  std::vector<std::unique_ptr<models::MovingObstacle>> movers_;
  Call<N> call_;
};

// Makes forces as a hand, a machine or a broken sensor might make them.
class Push {
 public:
  explicit Push(Random& random, const Vec3& towards)
      : random_(random),
        size_N_(random.log_uniform(1e-3, 1e6)),
        kind_(random.below(5)),
        direction_(random.direction()),
        noise_N_(random.chance(0.5) ? size_N_ * random.log_uniform(1e-6, 1.0) : 0.0),
        turn_(random.log_uniform(1e-3, 1.0)),
        centring_(random.chance(0.7) ? random.log_uniform(1e-3, 0.3) : 0.0),
        towards_(towards) {}

  [[nodiscard]] double size_N() const noexcept { return size_N_; }

  Vec3 operator()(int step, const Vec3& q, const Vec3& v, double mass_kg, double period_s) {
    Vec3 f = size_N_ * direction_;
    switch (kind_) {
      case 0:
        break;  // steady
      case 1:   // jumps
        if (random_.chance(0.03)) direction_ = random_.direction();
        break;
      case 2:  // a sine
        f *= std::sin(turn_ * step);
        break;
      case 3:  // a random walk of the direction
        direction_ = (direction_ + 0.1 * random_.in_box(1.0)).normalized();
        break;
      default:  // towards an object
        f = size_N_ * (towards_ - q) / (1e-3 + (towards_ - q).norm());
        break;
    }
    if (noise_N_ > 0.0) f += noise_N_ * random_.in_box(1.0);
    // A spring and a damper keep the proxy near the origin. Their frequency is so low that they are stable at this
    // timestep.
    const double omega = centring_ / period_s;
    Vec3 back = -mass_kg * omega * (omega * q + v);
    const double limit = 1e6;
    if (back.norm() > limit) back *= limit / back.norm();
    f += back;
    return f.norm() > limit ? Vec3(f * (limit / f.norm())) : f;
  }

 private:
  Random& random_;
  double size_N_;
  int kind_;
  Vec3 direction_;
  double noise_N_, turn_, centring_;
  Vec3 towards_;
};

template <int N>
class Judge {
 public:
  Judge(const Laws& laws, Witness<N>& g, Random& random, Tally& tally, std::string* report)
      : laws_(laws), g_(g), random_(random), tally_(tally), report_(report) {}

  // Judges the step k that the proxy has just made. `fault`: the proxy reported a fault. `before`: the proxy before the
  // step.
  void step(std::int64_t k, bool fault, const Vec<N>& before) {
    const Call<N>& call = g_.call();
    step_ = k;
    ++tally_.steps;
    if (fault || !call.r.allFinite() || !call.f().allFinite()) return note(finite, call, 0.0);
    tally_.contact += call.contacts.empty() ? 0 : 1;
    tally_.slipping += std::any_of(call.contacts.begin(), call.contacts.end(), [](const auto& c) { return c.slips; });
    judge_depth(call);
    if (call.unresolved) {
      ++tally_.unresolved;
      return;
    }
    if (!laws_.template obeyed<N>(call)) note(law, call, call.f().norm());
    judge_work(call, before);
    const Call<N> judged = call;
    judge_stiffness(judged);
  }

 private:
  void note(Invariant which, const Call<N>& call, double value) {
    tally_.violated(which, step_);
    if (report_ == nullptr || report_->size() > 20'000) return;
    std::ostringstream out;
    out.precision(17);
    out << "step " << step_ << ": " << invariant_names[which] << " (" << value << "); K = " << call.K << ", p = ["
        << call.p.transpose() << "], q = [" << call.q.transpose() << "], r = [" << call.r.transpose() << "], time "
        << call.time.time_s << ", period " << call.time.period_s << (call.unresolved ? ", unresolved" : "")
        << ", contacts:";
    for (const Contact<N>& contact : call.contacts) {
      out << " object " << contact.object << "." << contact.feature << (contact.slips ? " slips" : " sticks")
          << " n = [" << contact.normal.transpose() << "]";
    }
    *report_ += out.str() + "\n";
  }

  void judge_depth(const Call<N>& call) {
    const double depth = laws_.depth(lift<N>(call.r), call.time.time_s);
    if (call.unresolved) return;
    tally_.deepest_m = std::max(tally_.deepest_m, depth / (1.0 + call.r.norm() + call.p.norm()));
    // Allows for the rounding of r, of distances, and of an object's motion, each of which is some units of ‖r‖ ε.
    if (depth > 1e-12 * (1.0 + call.r.norm()) * condition(call) + 16.0 * epsilon * call.p.norm())
      note(inside, call, depth);
  }

  void judge_work(const Call<N>& call, const Vec<N>& before) {
    if (!laws_.judged() || call.contacts.empty()) return;
    if (laws_.moving() || laws_.soft() || call.q != before) {
      ++tally_.not_judged;
      return;
    }
    double convex_radius = 0.0;
    const auto [f, coulomb, K] = laws_.template without_media<N>(call);
    const Vec3 motion = lift<N>(call.r - call.q);
    const double done = f.dot(motion), length2 = motion.squaredNorm();
    const double rounding =
        condition(call) * 64.0 * epsilon * K * call.size() * (motion.norm() + call.size() * epsilon) +
        f.norm() * 64.0 * epsilon * call.size() + coulomb * motion.norm();
    if (done <= rounding) return;
    bool edged = false, convex = false;
    for (const Contact<N>& contact : call.contacts) {
      double radius = 0.0;
      const auto kind = laws_.curvature(static_cast<std::size_t>(contact.object), radius);
      edged = edged || kind == Laws::Curvature::edged;
      convex = convex || kind == Laws::Curvature::convex;
      convex_radius = radius;
    }
    if (edged) {
      ++tally_.edge;
    } else if (convex && call.contacts.size() > 1) {
      ++tally_.not_judged;
    } else if (!convex || done > f.norm() * length2 / (2.0 * convex_radius) * (1.0 + 1e-9) + rounding) {
      note(work, call, done);
    }
  }

  void judge_stiffness(const Call<N>& call) {
    const Vec<N> f = call.f();
    const double kappa = call.K * random_.log_uniform(1e-3, 1e3);
    const Call<N> other = g_.ask(kappa, Vec<N>(call.r - f / kappa));
    const double allowed = condition(call) * 64.0 * epsilon *
                               ((0.1 + call.r.norm() + call.q.norm()) * (1.0 + call.K / kappa) + f.norm() / kappa) +
                           8.0 * epsilon * laws_.carriage(call.time.time_s) + slip_rounding(call);
    const double error = (other.r - call.r).norm();
    if (error <= allowed) return;
    // If both answers obey the laws in this state, Coulomb's law has several solutions, and 𝒢 isn't at fault.
    if (other.unresolved) {
      ++tally_.unresolved;
    } else if (other.r.allFinite() && (laws_.bends() || (laws_.judged() && laws_.template obeyed<N>(other)))) {
      ++tally_.several;
    } else {
      note(stiffness, other, error);
    }
  }

  // Returns the rounding of the slip in a Coulomb medium; 0 without such a medium. Whether and how little the proxy
  // slips is found from a hundredth to a thousandth of the proxy's motion (coulomb_step.hpp), so the rounding of r is
  // multiplied by up to about 1000. That is half a picometre per metre.
  [[nodiscard]] double slip_rounding(const Call<N>& call) const {
    return laws_.template without_media<N>(call).coulomb_N > 0.0 ? 2048.0 * epsilon * (call.r.norm() + call.q.norm())
                                                                 : 0.0;
  }

  const Laws& laws_;
  Witness<N>& g_;
  Random& random_;
  Tally& tally_;
  std::string* report_;
  std::int64_t step_ = 0;
};

// Finds a random place at least a millimetre outside all objects. Returns false if no try found one.
template <int N>
bool find_start(Random& random, const Laws& laws, Vec<N>& q) {
  for (int k = 0; k < 300; ++k) {
    q = random.in_box(1.0).head<N>();
    if (laws.depth(lift<N>(q), 0.0) < -1e-3) return true;
  }
  return false;
}

template <int N>
void run_in(const scenes::Scene& scene, const scenes::CompiledScene& compiled, const Laws& laws, const Vec3& towards,
            StressWorlds worlds, Random& random, Tally& tally, std::string* report) {
  Vec<N> q0;
  if (!find_start<N>(random, laws, q0)) q0.setZero();
  Witness<N> g(compiled.algorithm<N>(), scene);
  controller::AdmittanceConfig config;
  config.mass_kg = tally.mass_kg = random.log_uniform(1e-3, 1e3);
  config.period_s = tally.period_s = random.log_uniform(1e-5, 50e-3);
  const bool first_order = random.chance(0.7);  // drawn for all kinds, so that a seed gives the same worlds
  config.order = tally.order = first_order && worlds != StressWorlds::order_2 ? 1 : 2;
  if (random.chance(0.3)) config.damping_Ns_per_m = random.log_uniform(0.1, 1e3);
  AdmittanceProxy<N> proxy(config, g);
  const double speed = random.chance(0.5) ? random.log_uniform(1e-4, 10.0) : 0.0;
  proxy.start({.q = q0, .v = speed * random.direction().head<N>()});
  Push push(random, towards);
  tally.force_N = push.size_N();
  Judge<N> judge(laws, g, random, tally, report);
  if (laws.depth(lift<N>(q0), 0.0) >= 0.0) return;  // no place was found; the run counts, with no steps
  // A moving mesh that covered the proxy a period before the start would hold the proxy inside.
  if (laws.meshes() && laws.depth(lift<N>(q0), -config.period_s) >= 0.0) return;
  for (int k = 0; k < steps_per_run; ++k) {
    const Vec<N> before = proxy.q();
    const Vec<N> h =
        push(k, lift<N>(proxy.q()), lift<N>(proxy.velocity()), config.mass_kg, config.period_s).template head<N>();
    const bool fault = proxy.step(h) != controller::ProxyFault::none;
    judge.step(k, fault, before);
    // A session would end here, because a proxy that was pushed through a mesh stays on its other side.
    if (fault || (laws.meshes() && g.squeezed())) return;
  }
}

}  // namespace

Tally run_seed(std::uint64_t seed, StressWorlds worlds, std::string* report) {
  if (worlds == StressWorlds::tools) return run_tool_seed(seed, false, report);
  if (worlds == StressWorlds::moving_tools) return run_tool_seed(seed, true, report);
  Random random(seed);
  const RandomScene made = worlds == StressWorlds::meshes   ? random_mesh_scene(random)
                           : worlds == StressWorlds::layers ? random_layer_scene(random)
                                                            : random_scene(random);
  Tally tally;
  tally.kind = made.kind;
  tally.dimensions = made.scene.space.dimensions;
  tally.objects = made.scene.objects.size();
  const scenes::CompiledScene compiled = scenes::compile(made.scene);
  const Laws laws(made.scene);
  const Vec3 towards =
      made.scene.objects.empty()
          ? random.in_box(0.3)
          : scenes::middle_of(
                made.scene.objects[static_cast<std::size_t>(random.below(static_cast<int>(tally.objects)))].shape);
  switch (tally.dimensions) {
    case 1:
      run_in<1>(made.scene, compiled, laws, towards, worlds, random, tally, report);
      break;
    case 2:
      run_in<2>(made.scene, compiled, laws, towards, worlds, random, tally, report);
      break;
    default:
      run_in<3>(made.scene, compiled, laws, towards, worlds, random, tally, report);
      break;
  }
  return tally;
}

}  // namespace proxarm::studies
