#include "controller/studies/skip.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "controller/studies/common/chart.hpp"
#include "controller/studies/stress/globe_mesh.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::studies {
namespace {

using models::Vec3;
using nlohmann::json;
using scenes::Scene;
using Clock = std::chrono::steady_clock;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double K = 1e6;  // 1 kg at 1 ms

double elapsed_ns(Clock::time_point begun) {
  return std::chrono::duration<double, std::nano>(Clock::now() - begun).count();
}

// The time of a step, along a small circle around `at`, each pushed by `push`: the best of forty rounds, so short that
// on a busy machine most are undisturbed. NaN where a push meets nothing.
double step_ns(models::GeometricAlgorithm<3>& g, const Vec3& at, const Vec3& push, int steps) {
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 40; ++round) {
    Vec3 q = g(K, at, at);
    const auto begun = Clock::now();
    for (int k = 0; k < steps; ++k) {
      const double angle = 0.01 * k;
      const Vec3 ahead(2e-6 * std::cos(angle), 2e-6 * std::sin(angle), 0.0);
      g.set_time({1e-3 * k, 1e-3});
      q = g(K, q + ahead + push, q);
    }
    best = std::min(best, elapsed_ns(begun) / steps);
    // Free space: the push alone leads 5 µm further down in each step.
    const bool fell = push.z() < 0.0 && at.z() - q.z() > 0.5 * steps * std::abs(push.z());
    if (!q.allFinite() || fell) return nan_value;
  }
  return best;
}

// `count` spheres of radius 0.4 of their distance, on a grid of 1 m around the origin; the first one at the origin.
Scene spheres(std::size_t count) {
  Scene scene;
  const auto side = static_cast<int>(std::ceil(std::cbrt(static_cast<double>(count))));
  const double distance = 1.0 / side;
  for (int i = 0; i < side * side * side && scene.objects.size() < count; ++i) {
    scenes::Object object;
    object.name = "sphere " + std::to_string(i);
    object.friction = 0.3;
    const int column = i % side, row = i / side % side, layer = i / (side * side);
    object.shape = scenes::SphereShape{distance * Vec3(column, row, layer), 0.4 * distance, false};
    scene.objects.push_back(object);
  }
  return scene;
}

// A sphere of 0.2 m as a mesh of about `count` triangles; its poles, vertices of many, lie along x.
Scene globe(std::size_t count) {
  const auto rings = static_cast<std::uint32_t>(std::max(2.0, std::sqrt(static_cast<double>(count) / 4.0)));
  Scene scene;
  scenes::Object object;
  object.name = "globe";
  object.friction = 0.3;
  object.shape =
      globe_mesh(rings, 2 * rings, [](const Vec3& x) { return Vec3(0.2 * x.z(), 0.2 * x.x(), 0.2 * x.y()); });
  scene.objects.push_back(object);
  return scene;
}

// Asks every object for its distance, which is the least that a step costs where no object is skipped.
double all_ns(const Scene& scene, const Vec3& at) {
  double best = std::numeric_limits<double>::infinity();
  if (const auto* mesh = std::get_if<scenes::MeshShape>(&scene.objects.front().shape)) {
    for (int round = 0; round < 5; ++round) {
      const auto begun = Clock::now();
      double least = 1e300;
      for (std::uint32_t face = 0; face < mesh->mesh->size(); ++face) {
        least = std::min(least, std::abs(models::TriangleMesh::height(mesh->mesh->face(face), at)));
      }
      if (least >= 0.0) best = std::min(best, elapsed_ns(begun));
    }
    return best;
  }
  const scenes::Clearances clearances(scene);
  for (int round = 0; round < 5; ++round) {
    const auto begun = Clock::now();
    if (clearances.of_point(at) > -1e300) best = std::min(best, elapsed_ns(begun));
  }
  return best;
}

struct OptionScene {
  const char* name;
  Scene scene;
};

// A wall, and the same wall with one more option each.
std::vector<OptionScene> option_scenes() {
  const auto wall = [](double friction) {
    Scene scene;
    scenes::Object object;
    object.name = "wall";
    object.shape = scenes::PlaneShape{Vec3::Zero(), Vec3::UnitZ()};
    object.friction = friction;
    scene.objects.push_back(object);
    return scene;
  };
  std::vector<OptionScene> list;
  list.push_back({"nothing", {}});
  list.push_back({"wall", wall(0.0)});
  list.push_back({"friction", wall(0.3)});
  list.push_back({"layer", wall(0.3)});
  list.back().scene.objects[0].layer = scenes::ElasticLayer{1e-3, 1e4};
  list.push_back({"motion", wall(0.3)});
  list.back().scene.objects[0].motion = scenes::Motion{.amplitude_m = Vec3(0.0, 0.0, 1e-6), .frequency_Hz = 1.0};
  list.push_back({"viscous medium", wall(0.3)});
  list.back().scene.media.push_back({.damping_Ns_per_m = 5.0, .within = {}});
  list.push_back({"Coulomb field", wall(0.3)});
  list.back().scene.coulomb_force_N = 0.5;
  list.push_back({"two walls", wall(0.3)});
  list.back().scene.objects.push_back(list.back().scene.objects[0]);
  list.back().scene.objects[1].name = "other";
  list.back().scene.objects[1].shape = scenes::PlaneShape{Vec3(-1.0, 0.0, 0.0), Vec3::UnitX()};
  return list;
}

constexpr std::array cycle_setups{
    CycleSetup{.name = "default session"},
    CycleSetup{.name = "default session with lookahead", .looks_ahead = true},
    CycleSetup{.name = "room with a hand that explores", .scene = "scenes/room.yaml", .hand = "sim/hands/explore.yaml"},
    CycleSetup{.name = "seven axes", .cell = "models/cells/seven.yaml"},
};

std::vector<std::size_t> counts(bool quick) {
  if (quick) return {1, 10, 100, 1000};
  return {1, 3, 10, 30, 100, 300, 1000, 3000, 10000};
}
std::vector<std::size_t> triangle_counts(bool quick) {
  if (quick) return {100, 1000, 10'000};
  return {100, 1000, 10'000, 100'000};
}

}  // namespace

std::vector<Column> Skip::columns() const {
  return {{"kind", true}, {"name", true},  {"count"},    {"far_ns"},  {"near_ns"},     {"contact_ns"},
          {"all_ns"},     {"start_up_us"}, {"programs"}, {"limited"}, {"joint_steps"}, {"guarded"}};
}

std::size_t Skip::jobs(const Options& options) const {
  return counts(options.quick).size() + triangle_counts(options.quick).size() + option_scenes().size() +
         cycle_setups.size();
}

std::vector<Row> Skip::run(std::size_t job, const Options& options) const {
  const std::vector<std::size_t> objects = counts(options.quick), triangles = triangle_counts(options.quick);
  if (const std::size_t first = jobs(options) - cycle_setups.size(); job >= first) {
    const CycleSetup& setup = cycle_setups[job - first];
    const CycleCounts c = cycles_(setup);
    const auto number = [](std::uint64_t n) { return static_cast<double>(n); };
    return {{"cycle", setup.name, number(c.steps), nan_value, nan_value, nan_value, nan_value, nan_value,
             number(c.programs), number(c.limited), number(c.joint_steps), number(c.guarded)}};
  }
  const int steps = options.quick ? 500 : 2'000;
  std::string kind = "option", name;
  Scene scene;
  double count = 0.0;
  Vec3 surface = Vec3::Zero();  // a point on something, seen from above
  if (job < objects.size()) {
    kind = name = "objects";
    scene = spheres(objects[job]);
    count = static_cast<double>(objects[job]);
    surface.z() = std::get<scenes::SphereShape>(scene.objects[0].shape).radius_m;
  } else if (job - objects.size() < triangles.size()) {
    kind = name = "triangles";
    scene = globe(triangles[job - objects.size()]);
    count = static_cast<double>(std::get<scenes::MeshShape>(scene.objects[0].shape).mesh->size());
    surface = {0.0, 0.0, 0.2};
  } else {
    OptionScene option = option_scenes()[job - objects.size() - triangles.size()];
    name = option.name;
    scene = std::move(option.scene);
    count = static_cast<double>(scene.objects.size());
  }
  const auto begun = Clock::now();
  const scenes::CompiledScene compiled = scenes::compile(scene);
  const double start_up_us = 1e-3 * elapsed_ns(begun);
  models::GeometricAlgorithm<3>& g = compiled.algorithm<3>();
  const Vec3 none = Vec3::Zero(), into(0.0, 0.0, -5.0 / K);
  const bool empty = scene.objects.empty();
  const double gap = count > 1.0 && kind == "objects" ? 0.05 * surface.z() : 1e-3;
  const double far = step_ns(g, Vec3(0.3, 0.2, 20.0), none, steps);
  const double near = step_ns(g, surface + Vec3(0.0, 0.0, gap), none, steps);
  // Found from above, since a coarse mesh lies below its sphere.
  const double depth = std::max(0.5 * surface.z(), 1e-3);
  const Vec3 down = empty ? surface : g(K, surface - depth * Vec3::UnitZ(), surface + 1e-3 * Vec3::UnitZ());
  const double contact = empty ? nan_value : step_ns(g, down, into, steps);
  const double all = kind == "option" ? nan_value : all_ns(scene, surface);
  return {{kind, name, count, far, near, contact, all, start_up_us, nan_value, nan_value, nan_value, nan_value}};
}

json Skip::headline(const Table& table, const Options& /*options*/) const {
  json free, near, contact, all, start_up, triangles, option, cycles;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
    const std::string kind = table.text(row, table.column("kind"));
    const std::string count = std::to_string(static_cast<long>(value("count")));
    if (kind == "option") {
      json& one = option[table.text(row, table.column("name"))];
      one["free_ns"] = value("far_ns");
      if (std::isfinite(value("contact_ns"))) one["contact_ns"] = value("contact_ns");
    } else if (kind == "cycle") {
      json& one = cycles[table.text(row, table.column("name"))];
      one["steps"] = value("count");
      for (const char* name : {"programs", "limited", "joint_steps", "guarded"}) {
        one[name] = value(name);
      }
    } else if (kind == "objects") {
      free[count] = value("far_ns");
      near[count] = value("near_ns");
      contact[count] = value("contact_ns");
      all[count] = value("all_ns");
      start_up[count] = value("start_up_us");
    } else {
      triangles[count] = {{"free_ns", value("far_ns")},
                          {"near_ns", value("near_ns")},
                          {"contact_ns", value("contact_ns")},
                          {"all_ns", value("all_ns")},
                          {"start_up_us", value("start_up_us")}};
    }
  }
  return {{"free_ns", free},
          {"near_ns", near},
          {"contact_ns", contact},
          {"all_ns", all},
          {"start_up_us", start_up},
          {"triangles", triangles},
          {"options", option},
          {"cycles", cycles},
          {"keys",
           {{"free_ns", "by number of spheres: a step far from all of them"},
            {"near_ns", "a step that touches nothing, a twentieth of a radius above one of them"},
            {"contact_ns", "a step that slides on one of them, with friction"},
            {"all_ns", "asking every object (every face) for its distance, once"},
            {"start_up_us", "compiling the scene"},
            {"triangles", "the same by number of triangles of a mesh"},
            {"cycles",
             "by session: steps of rendering; those that made the joints' limits, and that computed the bound anew by "
             "which others don't; those in which a limit acted; steps of inverse kinematics; setpoints that the last "
             "guard judged exactly"},
            {"options",
             "a wall, and what one option more costs; a scene without it has another algorithm and pays nothing"}}}};
}

namespace {

// The longest steps of any world, and the largest one.
std::string skip_answer(const Table& table) {
  double far_ns = 0.0, contact_ns = 0.0, objects = 0.0, triangles = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string& kind = table.text(row, table.column("kind"));
    if (kind != "objects" && kind != "triangles") continue;
    double& most = kind == "objects" ? objects : triangles;
    most = std::max(most, table.number(row, table.column("count")));
    far_ns = std::max(far_ns, table.number(row, table.column("far_ns")));
    contact_ns = std::max(contact_ns, table.number(row, table.column("contact_ns")));
  }
  char title[160];
  std::snprintf(title, sizeof title,
                "A step far from up to %.0f objects or %.0f triangles takes at most %.0f ns, in contact %.0f ns",
                objects, triangles, far_ns, contact_ns);
  return title;
}

}  // namespace

std::vector<std::string> Skip::plot(const Table& table, const Options& /*options*/,
                                    const std::filesystem::path& out) const {
  Chart chart{.title = skip_answer(table), .columns = 2, .panel_width = 700, .panel_height = 430, .common_key = true};
  for (const char* kind : {"objects", "triangles"}) {
    Panel panel{.title = std::string(kind) == "objects" ? "spheres" : "a mesh",
                .x_label = std::string("number of ") + kind,
                .y_label = "time of a step (ns)",
                .log_x = true,
                .log_y = true,
                .y_low = 1.0,
                .y_high = 1e6};
    const std::array<const char*, 4> columns{"far_ns", "near_ns", "contact_ns", "all_ns"};
    const std::array<const char*, 4> names{"far", "near", "in contact, sliding", "evaluating everything"};
    for (std::size_t i = 0; i < columns.size(); ++i) {
      Curve curve{.name = names[i], .style = static_cast<int>(i), .marks = true};
      for (std::size_t row = 0; row < table.rows(); ++row) {
        if (table.text(row, table.column("kind")) != kind) continue;
        curve.x.push_back(table.number(row, table.column("count")));
        curve.y.push_back(table.number(row, table.column(columns[i])));
      }
      panel.curves.push_back(curve);
    }
    chart.panels.push_back(panel);
  }
  const std::string warning = draw(chart, out / "skip.svg");
  return warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning};
}

std::string Skip::text(const json& headline) const {
  std::ostringstream text;
  char line[300];
  for (const auto& item : headline.at("options").items()) {
    const json& contact = item.value().value("contact_ns", json());
    std::snprintf(line, sizeof line, "%-16s free %6.1f ns", item.key().c_str(),
                  item.value().at("free_ns").get<double>());
    text << line;
    if (contact.is_number()) {
      std::snprintf(line, sizeof line, ", in contact %6.1f ns", contact.get<double>());
      text << line;
    }
    text << '\n';
  }
  for (const auto& item : headline.at("contact_ns").items()) {
    std::snprintf(line, sizeof line, "%6s spheres: far %.1f, near %.1f, in contact %.1f ns; all of them %.0f ns\n",
                  item.key().c_str(), headline.at("free_ns").at(item.key()).get<double>(),
                  headline.at("near_ns").at(item.key()).get<double>(), item.value().get<double>(),
                  headline.at("all_ns").at(item.key()).get<double>());
    text << line;
  }
  for (const auto& item : headline.at("triangles").items()) {
    const auto ns = [&](const char* key) {
      return item.value().at(key).is_number() ? item.value().at(key).get<double>() : nan_value;
    };
    std::snprintf(line, sizeof line, "%6s triangles: far %.1f, near %.1f, in contact %.1f ns; all of them %.0f ns\n",
                  item.key().c_str(), ns("free_ns"), ns("near_ns"), ns("contact_ns"), ns("all_ns"));
    text << line;
  }
  for (const auto& item : headline.at("cycles").items()) {
    const auto n = [&](const char* key) { return item.value().at(key).get<double>(); };
    std::snprintf(line, sizeof line,
                  "%s: of %.0f steps %.0f asked a quadratic program for the joints' step, in %.0f a limit acted, %.0f "
                  "setpoints were judged exactly; %.2f steps of inverse kinematics each\n",
                  item.key().c_str(), n("steps"), n("programs"), n("limited"), n("guarded"),
                  n("joint_steps") / std::max(1.0, n("steps")));
    text << line;
  }
  return text.str();
}

}  // namespace proxarm::studies
