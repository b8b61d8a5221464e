#include "controller/extras/studies/skip.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "controller/extras/studies/common/chart.hpp"
#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/extras/studies/stress/globe_mesh.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::studies {
namespace {

using models::Vec3;
using nlohmann::json;
using scenes::Scene;
using Clock = std::chrono::steady_clock;

constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();
constexpr double coupling_N_per_m = 1e6;  // K = M/T² for 1 kg and 1 ms

double elapsed_ns(Clock::time_point begun) {
  return std::chrono::duration<double, std::nano>(Clock::now() - begun).count();
}

// Returns the time of a step while the proxy moves along a small circle around `at`, with `push` in each step; NaN if
// the push meets no object. The best of forty rounds counts. The rounds are so short that most of them run undisturbed
// even on a busy machine.
double step_ns(models::GeometricAlgorithm<3>& g, const Vec3& at, const Vec3& push, int steps) {
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 40; ++round) {
    Vec3 q = g(coupling_N_per_m, at, at);
    const auto begun = Clock::now();
    for (int k = 0; k < steps; ++k) {
      const double angle = 0.01 * k;
      const Vec3 ahead(2e-6 * std::cos(angle), 2e-6 * std::sin(angle), 0.0);
      g.set_time({1e-3 * k, 1e-3});
      q = g(coupling_N_per_m, q + ahead + push, q);
    }
    best = std::min(best, elapsed_ns(begun) / steps);
    // If the push meets no object, the proxy falls by push.z in each step.
    const bool fell = push.z() < 0.0 && at.z() - q.z() > 0.5 * steps * std::abs(push.z());
    if (!q.allFinite() || fell) return not_measured;
  }
  return best;
}

// Returns a world of `count` spheres on a grid of 1 m around the origin. Their radius is 0.4 of the distance between
// neighbours, and the first sphere is at the origin.
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

// Returns a world with a sphere of 0.2 m as a mesh of about `count` triangles. The sphere's poles, which are vertices
// of many triangles, lie on the x axis.
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

// Returns the time to compute the distance from every object, which is the least time of a step that skips no object.
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

// Returns a scene with a wall, and for each option a scene with the wall and that option.
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
    return {{"cycle", setup.name, number(c.steps), not_measured, not_measured, not_measured, not_measured, not_measured,
             number(c.programs), number(c.limited), number(c.joint_steps), number(c.guarded)}};
  }
  const int steps = options.quick ? 500 : 2'000;
  std::string kind = "option", name;
  Scene scene;
  double count = 0.0;
  Vec3 surface = Vec3::Zero();  // the top of an object
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
  const Vec3 none = Vec3::Zero(), into(0.0, 0.0, -5.0 / coupling_N_per_m);
  const bool empty = scene.objects.empty();
  const double gap = count > 1.0 && kind == "objects" ? 0.05 * surface.z() : 1e-3;
  const double far = step_ns(g, Vec3(0.3, 0.2, 20.0), none, steps);
  const double near = step_ns(g, surface + Vec3(0.0, 0.0, gap), none, steps);
  // The surface is found from above, because a coarse mesh lies inside the sphere that it approximates.
  const double depth = std::max(0.5 * surface.z(), 1e-3);
  const Vec3 down =
      empty ? surface : g(coupling_N_per_m, surface - depth * Vec3::UnitZ(), surface + 1e-3 * Vec3::UnitZ());
  const double contact = empty ? not_measured : step_ns(g, down, into, steps);
  const double all = kind == "option" ? not_measured : all_ns(scene, surface);
  return {{kind, name, count, far, near, contact, all, start_up_us, not_measured, not_measured, not_measured,
           not_measured}};
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

// Times of a step in one world of a kind. A map has them by number of objects or triangles.
struct Cost {
  double free_ns = 0.0, contact_ns = 0.0, all_ns = 0.0;
};
using CostByCount = std::map<double, Cost>;

CostByCount costs_of(const Table& table, const char* kind) {
  CostByCount costs;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (table.text(row, table.column("kind")) != kind) continue;
    const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
    costs[value("count")] = {std::max(value("far_ns"), value("near_ns")), value("contact_ns"), value("all_ns")};
  }
  return costs;
}

std::string ns_text(double ns) { return count_text(ns) + " ns"; }

Panel cost_panel(const CostByCount& costs, const char* title, const char* what) {
  Panel panel{.title = title,
              .x_label = std::string("number of ") + what,
              .y_label = "time (ns)",
              .log_x = true,
              .log_y = true,
              .y_low = 5.0,
              .y_high = 1e6,
              .y_ticks = {1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8}};
  Curve free{.name = "step in free space, far or near", .style = 0, .marks = true};
  Curve contact{.name = "step in contact, sliding", .style = 2, .marks = true};
  Curve all{.name = "for comparison: distance to the nearest", .style = 7, .marks = true};
  for (const auto& [count, cost] : costs) {
    for (Curve* curve : {&free, &contact, &all}) curve->x.push_back(count);
    free.y.push_back(cost.free_ns);
    contact.y.push_back(cost.contact_ns);
    all.y.push_back(cost.all_ns);
    panel.y_low = std::min(panel.y_low, 0.5 * cost.free_ns);
    panel.y_high = std::max({panel.y_high, 2.0 * cost.contact_ns, 2.0 * cost.all_ns});
  }
  panel.curves = {free, contact, all};
  if (costs.empty()) return panel;
  const auto& [largest, last] = *costs.rbegin();
  panel.x_low = 0.15 * costs.begin()->first;
  panel.x_high = 4.0 * largest;
  panel.notes = {{largest, last.free_ns, ns_text(last.free_ns), Note::Side::above},
                 {largest, last.contact_ns, ns_text(last.contact_ns), Note::Side::above}};
  const auto longest = std::ranges::max_element(costs, {}, [](const auto& cost) { return cost.second.contact_ns; });
  if (longest->second.contact_ns > 1.1 * last.contact_ns) {
    panel.notes.push_back({longest->first, longest->second.contact_ns, "most: " + ns_text(longest->second.contact_ns),
                           Note::Side::above});
  }
  return panel;
}

// Returns whether a step in the largest world takes less than twice as long as a step in the smallest world.
bool hardly_grows(const CostByCount& costs) {
  if (costs.empty()) return true;
  const Cost &small = costs.begin()->second, &large = costs.rbegin()->second;
  return large.free_ns < 2.0 * small.free_ns && large.contact_ns < 2.0 * small.contact_ns;
}

}  // namespace

std::string skip_answer(const Table& table) {
  const CostByCount objects = costs_of(table, "objects"), triangles = costs_of(table, "triangles");
  if (objects.empty() || triangles.empty()) return "What a step costs";
  const auto& [spheres, among] = *objects.rbegin();
  const auto& [faces, on] = *triangles.rbegin();
  const bool flat = hardly_grows(objects) && hardly_grows(triangles);
  return std::string(flat ? "How large the world is hardly matters: a" : "A") + " step takes " +
         ns_text(among.free_ns) + " free and " + ns_text(among.contact_ns) + " in contact among " +
         count_text(spheres) + " spheres, " + count_text(on.free_ns) + " and " + ns_text(on.contact_ns) + " among " +
         count_text(faces) + " triangles";
}

std::vector<std::string> Skip::plot(const Table& table, const Options& /*options*/,
                                    const std::filesystem::path& out) const {
  Chart chart{.title = skip_answer(table),
              .subtitle = "Distance to the nearest: without contact; of spheres by a tree, of triangles one by one",
              .columns = 2,
              .panel_height = 300,
              .key = true};
  chart.panels = {cost_panel(costs_of(table, "objects"), "A world of spheres", "spheres"),
                  cost_panel(costs_of(table, "triangles"), "A world of one mesh", "triangles")};
  chart.panels[1].y_label.clear();
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
      return item.value().at(key).is_number() ? item.value().at(key).get<double>() : not_measured;
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
