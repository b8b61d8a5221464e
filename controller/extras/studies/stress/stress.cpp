#include "controller/extras/studies/stress/stress.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "controller/extras/studies/common/chart.hpp"
#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/extras/studies/stress/stress_run.hpp"

namespace proxarm::studies {
namespace {

using nlohmann::json;

double number(std::int64_t value) { return static_cast<double>(value); }

// Returns the sum of a column over all runs, or, if `kind` isn't empty, over the runs in worlds of that kind.
std::int64_t sum(const Table& table, const char* name, const std::string& kind = {}) {
  const std::size_t column = table.column(name), kinds = table.column("kind");
  double total = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (kind.empty() || table.text(row, kinds) == kind) total += table.number(row, column);
  }
  return static_cast<std::int64_t>(total);
}

json by_kind(const Table& table) {
  std::set<std::string> kinds;
  for (std::size_t row = 0; row < table.rows(); ++row) kinds.insert(table.text(row, table.column("kind")));
  json all;
  for (const std::string& kind : kinds) {
    json& one = all[kind];
    for (const char* name :
         {"steps", "contact_steps", "slipping_steps", "several", "unresolved", "edge", "not_judged", "squeezed"}) {
      one[name] = sum(table, name, kind);
    }
    std::int64_t count = 0;
    for (const char* name : invariant_names) count += sum(table, name, kind);
    one["violations"] = count;
  }
  return all;
}

// Returns up to 50 runs with a violation.
json failing(const Table& table) {
  json runs = json::array();
  const std::size_t first_step = table.column("first_step"), run_seed = table.column("run_seed");
  for (std::size_t row = 0; row < table.rows() && runs.size() < 50; ++row) {
    if (!(table.number(row, first_step) >= 0.0)) continue;
    runs.push_back({{"run_seed", static_cast<std::uint64_t>(table.number(row, run_seed))},
                    {"kind", table.text(row, table.column("kind"))},
                    {"first", table.text(row, table.column("first"))},
                    {"step", table.number(row, first_step)}});
  }
  return runs;
}

json keys(const std::string& study) {
  return {
      {"runs", "worlds, each with a proxy of its own; a run that found no free place has no steps"},
      {"steps", "steps of all runs, each judged"},
      {"violations", "steps in which an invariant didn't hold; by invariant below"},
      {"several", "steps where another stiffness gave another point that obeys (17) as well"},
      {"unresolved", "steps in which the algorithm itself reported that it found no complete set of contacts"},
      {"edge", "steps in which an edge of a box, cylinder or mesh did work on the proxy"},
      {"not_judged",
       "steps in contact whose work isn't judged: moving objects, layers (they give back what they took), order 2 "
       "from another point than the proxy's, several contacts with a convex one"},
      {"squeezed", "runs that ended where objects that move left the tool no room; that step isn't judged"},
      {"deepest_m", "the deepest that any proxy was inside of anything in a resolved step, per metre of coordinates"},
      {"failing", "up to 50 runs with a violation: proxarm study " + study + " --replay RUN_SEED shows one"},
      {"seed", "of the study; run seeds follow from it"}};
}

}  // namespace

std::vector<Column> Stress::columns() const {
  std::vector<Column> columns{{"run_seed"},       {"kind", true}, {"dimensions"}, {"objects"}, {"order"},
                              {"mass_kg"},        {"period_s"},   {"force_N"},    {"steps"},   {"contact_steps"},
                              {"slipping_steps"}, {"several"},    {"unresolved"}, {"edge"},    {"not_judged"},
                              {"squeezed"},       {"deepest"}};
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
          number(t.squeezed),
          t.deepest_m};
  for (const std::int64_t count : t.violations) row.emplace_back(number(count));
  row.emplace_back(t.first);
  row.emplace_back(number(t.first_step));
  return {row};
}

json Stress::headline(const Table& table, const Options& options) const {
  std::int64_t violations = 0;
  json by_invariant;
  for (const char* name : invariant_names) {
    by_invariant[name] = sum(table, name);
    violations += sum(table, name);
  }
  double deepest = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    deepest = std::max(deepest, table.number(row, table.column("deepest")));
  }
  return {{"runs", table.rows()},
          {"steps", sum(table, "steps")},
          {"contact_steps", sum(table, "contact_steps")},
          {"violations", violations},
          {"violations_by_invariant", by_invariant},
          {"several", sum(table, "several")},
          {"unresolved", sum(table, "unresolved")},
          {"edge", sum(table, "edge")},
          {"not_judged", sum(table, "not_judged")},
          {"squeezed", sum(table, "squeezed")},
          {"deepest_m", deepest},
          {"by_kind", by_kind(table)},
          {"failing", failing(table)},
          {"seed", options.seed},
          {"keys", keys(name())}};
}

namespace {

std::int64_t violations_in(const Table& table) {
  std::int64_t violations = 0;
  for (const char* name : invariant_names) violations += sum(table, name);
  return violations;
}

// The runs in one decade of T²F/M, which is the distance by which a run's force would move the free proxy in one step.
struct Bin {
  double push_m = 0.0, steps = 0.0, violations = 0.0;
  std::array<double, 2> met{};
};
constexpr std::array met_names{"several", "unresolved"};

std::vector<Bin> bins_of(const Table& table) {
  constexpr int count = 24;
  constexpr double low = -16.0, high = 8.0;
  std::vector<Bin> bins(count);
  for (int i = 0; i < count; ++i) {
    bins[static_cast<std::size_t>(i)].push_m = std::pow(10.0, low + (high - low) * (i + 0.5) / count);
  }
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
    const double T = value("period_s"), push_m = T * T * value("force_N") / value("mass_kg");
    const int place = std::clamp(static_cast<int>((std::log10(push_m) - low) / (high - low) * count), 0, count - 1);
    Bin& bin = bins[static_cast<std::size_t>(place)];
    bin.steps += value("steps");
    for (std::size_t i = 0; i < met_names.size(); ++i) bin.met[i] += value(met_names[i]);
    for (const char* name : invariant_names) bin.violations += value(name);
  }
  std::erase_if(bins, [](const Bin& bin) { return !(bin.steps > 0.0); });
  return bins;
}

// Returns a panel with the number of steps that broke each law, and of the steps that are counted separately. A number
// of 0 is drawn at the bottom.
Panel counts_panel(const Table& table) {
  constexpr double none = 0.5;
  constexpr std::array names{"numbers finite", "nothing inside",    "law of contact", "any stiffness",
                             "no energy made", "several solutions", "unresolved"};
  constexpr std::array<const char*, 7> counted{invariant_names[finite],
                                               invariant_names[inside],
                                               invariant_names[law],
                                               invariant_names[stiffness],
                                               invariant_names[work],
                                               "several",
                                               "unresolved"};
  const auto steps = static_cast<double>(sum(table, "steps"));
  Panel panel{.title = "Steps that broke a law (the first five), and that are counted apart",
              .y_label = "steps",
              .log_y = true,
              .y_low = 0.2,
              .y_high = 10.0 * steps,
              .levels = {{steps, "all steps"}}};
  std::array<Curve, 3> curves;  // one for the laws, and two as in the panel below
  constexpr std::array styles{0, 5, 3};
  for (std::size_t i = 0; i < curves.size(); ++i) {
    curves[i] = {.style = styles[i], .marks = true, .line = false, .mark_size = 1.5};
  }
  for (std::size_t i = 0; i < counted.size(); ++i) {
    const auto count = static_cast<double>(sum(table, counted[i]));
    Curve& curve = curves[i < invariant_names.size() ? 0 : i - invariant_names.size() + 1];
    curve.x.push_back(static_cast<double>(i));
    curve.y.push_back(std::max(count, none));
    panel.x_names.emplace_back(names[i]);
    panel.notes.push_back({curve.x.back(), curve.y.back(), count_text(count), Note::Side::above, false});
  }
  panel.curves.assign(curves.begin(), curves.end());
  return panel;
}

// Returns a panel with shares of steps by T²F/M. If none of n steps broke a law, the panel shows 3/n: with 95 %
// confidence, the true share of such steps is below 3/n.
Panel stress_panel(const Table& table) {
  Panel panel{.title = "The last two, by how far the force would carry the proxy",
              .x_label = "T²F/M (m)",
              .y_label = "share of steps",
              .log_x = true,
              .log_y = true};
  constexpr std::array titles{"several lawful solutions: one is chosen",
                              "unresolved: the step says itself that no forces fit"};
  Curve bound{.name = "a law broken: none found, so that the true share is below this line (95 % sure)", .style = 7};
  Curve broke{.name = "broke a law", .style = 2, .marks = true, .line = false, .mark_size = 1.4};
  std::vector<Curve> met;
  constexpr std::array styles{5, 3};
  for (std::size_t i = 0; i < titles.size(); ++i) {
    met.push_back({.name = titles[i], .style = styles[i], .marks = true});
  }
  double least = 1.0;
  for (const Bin& bin : bins_of(table)) {
    const auto add = [&](Curve& curve, double steps) {
      if (!(steps > 0.0)) return;
      curve.x.push_back(bin.push_m);
      curve.y.push_back(std::min(1.0, steps / bin.steps));
      least = std::min(least, steps / bin.steps);
    };
    for (std::size_t i = 0; i < met.size(); ++i) add(met[i], bin.met[i]);
    add(bin.violations > 0.0 ? broke : bound, bin.violations > 0.0 ? bin.violations : 3.0);
  }
  panel.y_low = std::pow(10.0, std::floor(std::log10(least)) - 1.0);
  panel.y_high = 2.0;
  panel.curves.push_back(bound);
  panel.curves.insert(panel.curves.end(), met.begin(), met.end());
  panel.curves.push_back(broke);
  return panel;
}

}  // namespace

std::string stress_answer(const Table& table) {
  const std::int64_t violations = violations_in(table), unresolved = sum(table, "unresolved");
  const auto steps = static_cast<double>(sum(table, "steps"));
  const std::string of = steps < 1e6 ? count_text(steps) : number_text(1e-6 * steps, 3) + " million";
  return (violations == 0 ? "None" : count_text(static_cast<double>(violations))) + " of " + of +
         " random steps broke a law" +
         (unresolved == 0 ? ""
                          : "; " + number_text(100.0 * static_cast<double>(unresolved) / steps, 2) +
                                " % of them stayed unresolved and weren't judged");
}

std::vector<std::string> Stress::plot(const Table& table, const Options& /*options*/,
                                      const std::filesystem::path& out) const {
  const Chart chart{
      .title = stress_answer(table),
      .subtitle =
          "The laws: numbers are finite; nothing is inside an object; contacts never pull, friction is "
          "at most μ times the pressure and against the slip; the same at any stiffness; contacts give no energy",
      .panel_height = 250,
      .panels = {counts_panel(table), stress_panel(table)},
      .key = true};
  const std::string warning = draw(chart, out / (name() + ".svg"));
  return warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning};
}

std::string Stress::text(const json& headline) const {
  std::ostringstream text;
  text << headline.at("runs") << " runs, " << headline.at("steps") << " steps, " << headline.at("contact_steps")
       << " in contact, seed " << headline.at("seed") << ": " << headline.at("violations") << " violations\n"
       << "counted apart: unresolved " << headline.at("unresolved") << ", several solutions " << headline.at("several")
       << ", edges " << headline.at("edge") << ", work not judged " << headline.at("not_judged")
       << ", runs that ended squeezed " << headline.at("squeezed") << "\n";
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
