#include "controller/studies/stress.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "controller/rendering/admittance_proxy.hpp"
#include "controller/studies/common/chart.hpp"
#include "controller/studies/random_scene.hpp"
#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_obstacle.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/surfaces/contact_judge.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::studies {
namespace {

using controller::AdmittanceProxy;
using models::Contact;
using models::lift;
using models::Vec;
using models::Vec3;
using nlohmann::json;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

enum Invariant { finite, inside, law, stiffness, work, invariant_count };
constexpr std::array<const char*, invariant_count> invariant_names{"finite", "inside", "law", "stiffness", "work"};

// One call of 𝒢, as the proxy made it.
template <int N>
struct Call {
  double K = 0.0;
  Vec<N> p = Vec<N>::Zero(), q = Vec<N>::Zero(), r = Vec<N>::Zero();
  models::StepTime time;
  std::vector<Vec3> carried;  // q, by objects' motion: where 𝒢 begins, of meshes at order 2
  std::vector<Contact<N>> contacts;
  bool unresolved = false;

  [[nodiscard]] Vec<N> f() const { return K * (r - p); }
  [[nodiscard]] double size() const { return 0.1 + r.norm() + p.norm() + q.norm() + (r - p).norm(); }
};

// Passes everything on, and remembers the last call.
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
  [[nodiscard]] bool squeezed() const noexcept override { return g_.squeezed(); }
  [[nodiscard]] std::span<const Contact<N>> contacts() const noexcept override { return call_.contacts; }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return g_.unresolved_steps(); }

  [[nodiscard]] const Call<N>& call() const noexcept { return call_; }
  // The same again with another stiffness and another p.
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
  std::vector<std::unique_ptr<models::MovingObstacle>> movers_;  // meshes, by object
  Call<N> call_;
};

template <int N>
double condition(const Call<N>& call) {
  return models::rounding_amplification<N>(call.contacts);
}

// What a world's forces are known to be.
class Laws {
 public:
  explicit Laws(const scenes::Scene& scene) : scene_(scene) {
    for (const scenes::Object& object : scene.objects) {
      moving_ = moving_ || object.motion.has_value();
      scripts_.push_back(object.motion ? scenes::script_of(*object.motion) : models::ScriptedMotion{});
      const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape);
      meshes_ = meshes_ || mesh != nullptr;
      convex_.push_back(mesh != nullptr && is_convex(*mesh->mesh));
    }
  }

  [[nodiscard]] bool judged() const noexcept { return !scene_.guide; }
  [[nodiscard]] bool moving() const noexcept { return moving_; }
  [[nodiscard]] bool meshes() const noexcept { return meshes_; }
  [[nodiscard]] bool soft() const noexcept {
    return std::any_of(scene_.objects.begin(), scene_.objects.end(),
                       [](const scenes::Object& object) { return object.layer.has_value(); });
  }
  [[nodiscard]] bool bends() const noexcept {
    return scene_.guide && scene_.guide->kind == scenes::GuideDescription::Kind::polyline;
  }

  // f of the objects alone: what media take is known, but for a Coulomb medium's force, whose size is returned.
  template <int N>
  [[nodiscard]] Vec3 without_media(const Call<N>& call, double& coulomb_N, double& K) const {
    coulomb_N = scene_.coulomb_force_N.value_or(0.0);
    double b = 0.0;
    for (const scenes::MediumDescription& medium : scene_.media) {
      if (medium.within) {
        const auto& ball = std::get<scenes::SphereShape>(*medium.within);
        if ((lift<N>(call.q) - ball.centre_m).norm() > ball.radius_m) continue;
      }
      b += medium.damping_Ns_per_m;
      coulomb_N += medium.force_N;
    }
    K = call.K + b / call.time.period_s;
    return lift<N>(call.f() + b / call.time.period_s * (call.r - call.q));
  }

  // (17): how far f is from what the contacts can bear, as yes or no.
  template <int N>
  [[nodiscard]] bool obeyed(const Call<N>& call) const {
    if (!judged()) return true;
    double coulomb = 0.0, K = 0.0;
    const Vec3 f = without_media<N>(call, coulomb, K);
    double tolerance = coulomb * (1.0 + 1e-9) + condition(call) * 64.0 * epsilon * K * call.size();
    // On curvature, a tool that is deep against the radius (0.01 m is the smallest here) amplifies rounding again.
    tolerance += f.norm() * 64.0 * epsilon * (call.p - call.r).norm() / 0.01;
    // A Coulomb medium's force is found by how far the proxy moves in it, which a short move's rounding leaves unsure.
    const double moved = (call.r - call.q).norm();
    if (moved > 0.0) tolerance += coulomb * std::min(16.0 * epsilon * call.size() / moved, 1e-3);
    double unsure = 8.0 * epsilon;  // of a cone's axis
    const auto friction = [&](const Contact<N>& contact) -> std::optional<double> {
      const auto object = static_cast<std::size_t>(contact.object);
      return N == 1 || object >= scene_.objects.size() ? 0.0 : scene_.objects[object].friction;
    };
    const auto motion = [&](const Contact<N>& contact) -> Vec3 {
      const auto object = static_cast<std::size_t>(contact.object);
      const bool moving_mesh = object < scene_.objects.size() && scene_.objects[object].motion &&
                               std::holds_alternative<scenes::MeshShape>(scene_.objects[object].shape);
      const Vec3 begin = moving_mesh ? call.carried[object] : carried(object, call.time, lift<N>(call.q));
      return lift<N>(call.r) - begin;
    };
    const std::vector<models::ForceCone> cones = models::cones_of_contacts<N>(
        call.contacts, call.size() + carriage(call.time.time_s), friction, motion, [&](double mu, double angle) {
          tolerance += mu * f.norm() * angle * condition(call);
          unsure += mu * angle;
        });
    return models::in_sum_of_cones(f, cones, tolerance + unsure * squeeze(f, cones));
  }

  // Contacts that slip may press nearly against each other, with forces that are far above f; their axes' rounding then
  // counts by these. The sum of the forces, N, where each contact bears one along a line, else none.
  [[nodiscard]] static double squeeze(const Vec3& f, const std::vector<models::ForceCone>& cones) {
    if (cones.size() < 2 || cones.size() > 3) return 0.0;
    Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < cones.size(); ++i) {
      if (cones[i].mu > 0.0) return 0.0;
      axes.col(static_cast<Eigen::Index>(i)) = cones[i].axis;
    }
    const Vec3 forces = axes.completeOrthogonalDecomposition().solve(f);
    return forces.minCoeff() >= 0.0 ? forces.sum() : 0.0;
  }

  // How far the objects have been carried, metres: their places are rounded by that.
  [[nodiscard]] double carriage(double time_s) const {
    double farthest = 0.0;
    for (std::size_t i = 0; i < scripts_.size(); ++i) {
      if (scene_.objects[i].motion) farthest = std::max(farthest, scripts_[i].at(time_s).translation().norm());
    }
    return farthest;
  }

  // Where the object's motion takes q.
  [[nodiscard]] Vec3 carried(std::size_t object, const models::StepTime& time, const Vec3& q) const {
    if (object >= scene_.objects.size() || !scene_.objects[object].motion) return q;
    const models::ScriptedMotion& script = scripts_[object];
    return script.at(time.time_s) * (script.at(time.time_s - time.period_s).inverse(Eigen::Isometry) * q);
  }

  // How deep r is inside of anything, metres.
  [[nodiscard]] double depth(const Vec3& r, double time_s) const {
    double deepest = -infinity;
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      const scenes::Object& object = scene_.objects[i];
      const Vec3 x = object.motion ? Vec3(scripts_[i].at(time_s).inverse(Eigen::Isometry) * r) : r;
      deepest = std::max(deepest, -(convex_[i] ? convex_distance(object, x) : scenes::distance_to(object, x)));
    }
    return deepest;
  }

  // What a surface's curvature lets f do on the proxy.
  enum class Curvature { flat_or_concave, convex, edged };
  [[nodiscard]] Curvature curvature(std::size_t object, double& radius_m) const {
    if (object >= scene_.objects.size()) return Curvature::flat_or_concave;
    const scenes::Shape& shape = scene_.objects[object].shape;
    if (const auto* sphere = std::get_if<scenes::SphereShape>(&shape)) {
      radius_m = sphere->radius_m;
      return sphere->inside_out ? Curvature::flat_or_concave : Curvature::convex;
    }
    if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&shape)) {
      radius_m = capsule->radius_m;
      return capsule->inside_out ? Curvature::flat_or_concave : Curvature::convex;
    }
    if (const auto* box = std::get_if<scenes::BoxShape>(&shape)) {
      return box->inside_out ? Curvature::flat_or_concave : Curvature::edged;
    }
    if (const auto* cylinder = std::get_if<scenes::CylinderShape>(&shape)) {
      return cylinder->inside_out ? Curvature::flat_or_concave : Curvature::edged;
    }
    return std::holds_alternative<scenes::PlaneShape>(shape) ? Curvature::flat_or_concave : Curvature::edged;
  }

 private:
  static bool is_convex(const models::TriangleMesh& mesh) {
    for (std::uint32_t face = 0; face < mesh.size(); ++face) {
      for (std::uint32_t other = 0; other < mesh.size(); ++other) {
        for (std::size_t k = 0; k < 3; ++k) {
          if (models::TriangleMesh::height(mesh.face(face), mesh.corner(other, k)) > 1e-12) return false;
        }
      }
    }
    return true;
  }

  // Of a convex mesh: the height over the face that sees most of x.
  static double convex_distance(const scenes::Object& object, const Vec3& x) {
    const models::TriangleMesh& mesh = *std::get<scenes::MeshShape>(object.shape).mesh;
    double highest = -infinity;
    for (std::uint32_t face = 0; face < mesh.size(); ++face) {
      highest = std::max(highest, models::TriangleMesh::height(mesh.face(face), x));
    }
    return highest;
  }

  const scenes::Scene& scene_;
  bool moving_ = false, meshes_ = false;
  std::vector<models::ScriptedMotion> scripts_;
  std::vector<bool> convex_;  // meshes
};

// A force that a hand, a machine or a broken sensor might make.
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
      case 3:  // a random walk of its direction
        direction_ = (direction_ + 0.1 * random_.in_box(1.0)).normalized();
        break;
      default:  // towards an object
        f = size_N_ * (towards_ - q) / (1e-3 + (towards_ - q).norm());
        break;
    }
    if (noise_N_ > 0.0) f += noise_N_ * random_.in_box(1.0);
    // What keeps it near: a spring and a damper, of a frequency that the timestep carries.
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

struct Tally {
  std::string kind;
  int dimensions = 3, order = 1;
  std::size_t objects = 0;
  double mass_kg = 0.0, period_s = 0.0, force_N = 0.0;
  std::int64_t steps = 0, contact = 0, slipping = 0, several = 0, unresolved = 0, edge = 0, not_judged = 0;
  double deepest_m = 0.0;
  std::array<std::int64_t, invariant_count> violations{};
  std::string first = "none";
  std::int64_t first_step = -1;
};

// Judges one step.
template <int N>
class Judge {
 public:
  Judge(const Laws& laws, Witness<N>& g, Random& random, Tally& tally, std::string* report)
      : laws_(laws), g_(g), random_(random), tally_(tally), report_(report) {}

  void step(std::int64_t k, bool fault) {
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
    judge_work(call);
    const Call<N> judged = call;
    judge_stiffness(judged);
  }

 private:
  void note(Invariant which, const Call<N>& call, double value) {
    ++tally_.violations[which];
    if (tally_.first_step < 0) {
      tally_.first = invariant_names[which];
      tally_.first_step = step_;
    }
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
    // Rounding of r, of distances, and of an object's own motion, each some units of ‖r‖ ε.
    if (depth > 1e-12 * (1.0 + call.r.norm()) * condition(call) + 16.0 * epsilon * call.p.norm())
      note(inside, call, depth);
  }

  void judge_work(const Call<N>& call) {
    if (!laws_.judged() || call.contacts.empty()) return;
    if (laws_.moving() || laws_.soft() || tally_.order == 2) {
      ++tally_.not_judged;
      return;
    }
    double coulomb = 0.0, convex_radius = 0.0, K = 0.0;
    const Vec3 f = laws_.template without_media<N>(call, coulomb, K), motion = lift<N>(call.r - call.q);
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
    // Two answers that both keep the laws of the same state are Coulomb's, not the algorithm's.
    if (other.unresolved) {
      ++tally_.unresolved;
    } else if (other.r.allFinite() && (laws_.bends() || (laws_.judged() && laws_.template obeyed<N>(other)))) {
      ++tally_.several;
    } else {
      note(stiffness, other, error);
    }
  }

  // Whether a proxy slips in a Coulomb medium, and how little, is seen from a few hundredths to thousandths of its way
  // (coulomb_step.hpp): the rounding of r counts by their inverse. Half a picometre per metre.
  [[nodiscard]] double slip_rounding(const Call<N>& call) const {
    double coulomb = 0.0, K = 0.0;
    (void)laws_.template without_media<N>(call, coulomb, K);
    return coulomb > 0.0 ? 2048.0 * epsilon * (call.r.norm() + call.q.norm()) : 0.0;
  }

  const Laws& laws_;
  Witness<N>& g_;
  Random& random_;
  Tally& tally_;
  std::string* report_;
  std::int64_t step_ = 0;
};

// A place that is free now and a period before; false where chance found none.
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
            Random& random, Tally& tally, std::string* report) {
  Vec<N> q0;
  if (!find_start<N>(random, laws, q0)) q0.setZero();
  Witness<N> g(compiled.algorithm<N>(), scene);
  controller::AdmittanceConfig config;
  config.mass_kg = tally.mass_kg = random.log_uniform(1e-3, 1e3);
  config.period_s = tally.period_s = random.log_uniform(1e-5, 50e-3);
  config.order = tally.order = random.chance(0.7) ? 1 : 2;
  config.matched_labels = random.chance(0.5);
  if (random.chance(0.3)) config.damping_Ns_per_m = random.log_uniform(0.1, 1e3);
  AdmittanceProxy<N> proxy(config, g);
  const double speed = random.chance(0.5) ? random.log_uniform(1e-4, 10.0) : 0.0;
  proxy.start({.q = q0, .v = speed * random.direction().head<N>()});
  Push push(random, towards);
  tally.force_N = push.size_N();
  Judge<N> judge(laws, g, random, tally, report);
  if (laws.depth(lift<N>(q0), 0.0) >= 0.0) return;  // no free place: counted with no steps
  // Order 2 may begin a period before; a mesh that is over the proxy then holds it from inside.
  if (laws.meshes() && laws.depth(lift<N>(q0), -config.period_s) >= 0.0) return;
  for (int k = 0; k < Stress::steps_per_run; ++k) {
    const Vec<N> h =
        push(k, lift<N>(proxy.q()), lift<N>(proxy.velocity()), config.mass_kg, config.period_s).template head<N>();
    const bool fault = proxy.step(h) != controller::ProxyFault::none;
    judge.step(k, fault);
    // A session ends there; what a mesh was pushed through stays beyond it.
    if (fault || (laws.meshes() && g.squeezed())) return;
  }
}

Tally run_seed(std::uint64_t seed, Stress::Worlds worlds, std::string* report) {
  Random random(seed);
  const RandomScene made = worlds == Stress::Worlds::meshes   ? random_mesh_scene(random)
                           : worlds == Stress::Worlds::layers ? random_layer_scene(random)
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
      run_in<1>(made.scene, compiled, laws, towards, random, tally, report);
      break;
    case 2:
      run_in<2>(made.scene, compiled, laws, towards, random, tally, report);
      break;
    default:
      run_in<3>(made.scene, compiled, laws, towards, random, tally, report);
      break;
  }
  return tally;
}

double number(std::int64_t value) { return static_cast<double>(value); }

}  // namespace

std::vector<Column> Stress::columns() const {
  std::vector<Column> columns{{"run_seed"},   {"kind", true},    {"dimensions"},     {"objects"},
                              {"order"},      {"mass_kg"},       {"period_s"},       {"force_N"},
                              {"steps"},      {"contact_steps"}, {"slipping_steps"}, {"several"},
                              {"unresolved"}, {"edge"},          {"not_judged"},     {"deepest"}};
  for (const char* name : invariant_names) columns.push_back({name});
  columns.push_back({"first", true});
  columns.push_back({"first_step"});
  return columns;
}

std::size_t Stress::jobs(const Options& options) const {
  return static_cast<std::size_t>(options.runs.value_or(options.quick ? 1000.0 : 1e6));
}

std::vector<Row> Stress::run(std::size_t job, const Options& options) const {
  const std::uint64_t seed = job_seed(options.seed, job);
  const Tally t = run_seed(seed, worlds_, nullptr);
  Row row{static_cast<double>(seed),
          t.kind,
          static_cast<double>(t.dimensions),
          number(static_cast<std::int64_t>(t.objects)),
          static_cast<double>(t.order),
          t.mass_kg,
          t.period_s,
          t.force_N,
          number(t.steps),
          number(t.contact),
          number(t.slipping),
          number(t.several),
          number(t.unresolved),
          number(t.edge),
          number(t.not_judged),
          t.deepest_m};
  for (const std::int64_t count : t.violations) row.emplace_back(number(count));
  row.emplace_back(t.first);
  row.emplace_back(number(t.first_step));
  return {row};
}

json Stress::headline(const Table& table, const Options& options) const {
  const auto sum = [&](const char* name, const std::string& kind = {}) {
    const std::size_t column = table.column(name), kinds = table.column("kind");
    double total = 0.0;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (kind.empty() || table.text(row, kinds) == kind) total += table.number(row, column);
    }
    return static_cast<std::int64_t>(total);
  };
  std::set<std::string> kinds;
  std::int64_t violations = 0;
  json by_invariant, by_kind, failing = json::array();
  for (const char* name : invariant_names) {
    by_invariant[name] = sum(name);
    violations += sum(name);
  }
  double deepest = 0.0;
  const std::size_t first_step = table.column("first_step"), run_seed = table.column("run_seed");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    kinds.insert(table.text(row, table.column("kind")));
    deepest = std::max(deepest, table.number(row, table.column("deepest")));
    if (table.number(row, first_step) >= 0.0 && failing.size() < 50) {
      failing.push_back({{"run_seed", static_cast<std::uint64_t>(table.number(row, run_seed))},
                         {"kind", table.text(row, table.column("kind"))},
                         {"first", table.text(row, table.column("first"))},
                         {"step", table.number(row, first_step)}});
    }
  }
  for (const std::string& kind : kinds) {
    json& one = by_kind[kind];
    for (const char* name :
         {"steps", "contact_steps", "slipping_steps", "several", "unresolved", "edge", "not_judged"}) {
      one[name] = sum(name, kind);
    }
    std::int64_t count = 0;
    for (const char* name : invariant_names) count += sum(name, kind);
    one["violations"] = count;
  }
  return {
      {"runs", table.rows()},
      {"steps", sum("steps")},
      {"contact_steps", sum("contact_steps")},
      {"violations", violations},
      {"violations_by_invariant", by_invariant},
      {"several", sum("several")},
      {"unresolved", sum("unresolved")},
      {"edge", sum("edge")},
      {"not_judged", sum("not_judged")},
      {"deepest_m", deepest},
      {"by_kind", by_kind},
      {"failing", failing},
      {"seed", options.seed},
      {"keys",
       {{"runs", "worlds, each with a proxy of its own; a run that found no free place has no steps"},
        {"steps", "steps of all runs, each judged"},
        {"violations", "steps in which an invariant didn't hold; by invariant below"},
        {"several", "steps where another stiffness gave another point that obeys (17) as well"},
        {"unresolved", "steps in which the algorithm itself reported that it found no complete set of contacts"},
        {"edge", "steps in which an edge of a box, cylinder or mesh did work on the proxy"},
        {"not_judged",
         "steps in contact whose work isn't judged: moving objects, layers (they give back what they took), order 2 "
         "(its q is no place of the proxy), several contacts with a convex one"},
        {"deepest_m", "the deepest that any proxy was inside of anything in a resolved step, per metre of coordinates"},
        {"failing", "up to 50 runs with a violation: proxarm study " + name() + " --replay RUN_SEED shows one"},
        {"seed", "of the study; run seeds follow from it"}}}};
}

std::vector<std::string> Stress::plot(const Table& table, const Options& /*options*/,
                                      const std::filesystem::path& out) const {
  // Shares of steps over the push per step, T²F/M: how far the tool is ahead of the proxy.
  constexpr int bins = 24;
  constexpr double low = -16.0, high = 8.0;
  std::array<std::array<double, 5>, bins> sums{};
  const std::array<const char*, 5> names{"steps", "contact_steps", "slipping_steps", "several", "unresolved"};
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double T = table.number(row, table.column("period_s"));
    const double push = T * T * table.number(row, table.column("force_N")) / table.number(row, table.column("mass_kg"));
    const int bin = std::clamp(static_cast<int>((std::log10(push) - low) / (high - low) * bins), 0, bins - 1);
    for (std::size_t i = 0; i < names.size(); ++i) {
      sums[static_cast<std::size_t>(bin)][i] += table.number(row, table.column(names[i]));
    }
  }
  Chart chart{.title = "Stress: what the steps met, by how far a step pushes", .panels = {}};
  Panel panel{.title = "",
              .x_label = "T²F/M (m)",
              .y_label = "share of steps",
              .log_x = true,
              .log_y = true,
              .curves = {},
              .y_low = 1e-7,
              .y_high = 1.5};
  const std::array<const char*, 5> labels{"", "in contact", "slipping", "several solutions", "unresolved"};
  for (std::size_t i = 1; i < names.size(); ++i) {
    Curve curve{.name = labels[i], .x = {}, .y = {}, .style = static_cast<int>(i - 1), .marks = true};
    for (int bin = 0; bin < bins; ++bin) {
      const auto& sum = sums[static_cast<std::size_t>(bin)];
      if (!(sum[i] > 0.0)) continue;
      curve.x.push_back(std::pow(10.0, low + (high - low) * (bin + 0.5) / bins));
      curve.y.push_back(sum[i] / sum[0]);
    }
    panel.curves.push_back(curve);
  }
  chart.panels.push_back(panel);
  const std::string warning = draw(chart, out / (name() + ".svg"));
  return warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning};
}

std::string Stress::text(const json& headline) const {
  std::ostringstream text;
  text << headline.at("runs") << " runs, " << headline.at("steps") << " steps, " << headline.at("contact_steps")
       << " in contact, seed " << headline.at("seed") << ": " << headline.at("violations") << " violations\n"
       << "counted apart: unresolved " << headline.at("unresolved") << ", several solutions " << headline.at("several")
       << ", edges " << headline.at("edge") << ", work not judged " << headline.at("not_judged") << "\n";
  for (const json& run : headline.at("failing")) {
    text << "run seed " << run.at("run_seed") << ": " << run.at("first").get<std::string>() << " at step "
         << run.at("step") << " (" << run.at("kind").get<std::string>() << "); proxarm study " << name() << " --replay "
         << run.at("run_seed") << "\n";
  }
  return text.str();
}

bool Stress::failed(const json& headline) const { return headline.at("violations").get<std::int64_t>() > 0; }

bool Stress::replay(std::uint64_t seed, std::string& text, Worlds worlds) {
  std::string report;
  const Tally t = run_seed(seed, worlds, &report);
  std::ostringstream out;
  out << "run seed " << seed << ": " << t.kind << ", " << t.dimensions << " dimensions, " << t.objects << " objects, "
      << t.mass_kg << " kg, T = " << 1e3 * t.period_s << " ms, order " << t.order << ", " << t.force_N << " N; "
      << t.steps << " steps, " << t.contact << " in contact, " << t.unresolved << " unresolved, " << t.several
      << " with several solutions\n"
      << (report.empty() ? "no violation\n" : report);
  text = out.str();
  return !report.empty();
}

}  // namespace proxarm::studies
