// The Python module proxarm._proxarm: a scene's 𝒢, simulated sessions with parts written in Python, tables of numbers.
// What else the package has (studies, live sessions) is Python, in proxarm/__init__.py.
//
// Python is in the cycle of simulated sessions alone: a real one never waits for an interpreter.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "controller/extras/python/csv_table.hpp"
#include "controller/library/session.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/signals/contact_columns.hpp"
#include "controller/signals/derived_signals.hpp"
#include "controller/signals/signal_columns.hpp"
#include "models/packed/packed.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"

namespace py = pybind11;

namespace proxarm::python {
namespace {

using models::Vec;

// ---- Errors

PyObject* setup_error = nullptr;  // proxarm.SetupError; lives as long as the interpreter

void throw_as_python(const SetupError& error) {
  const description::SetupProblem& problem = error.problem();
  py::object made = py::reinterpret_borrow<py::object>(setup_error)(error.what());
  made.attr("file") = problem.file;
  made.attr("line") = problem.line;
  made.attr("key") = problem.key;
  made.attr("found") = problem.found;
  made.attr("expected") = problem.expected;
  made.attr("advice") = problem.advice;
  PyErr_SetObject(setup_error, made.ptr());
}

// ---- Vectors: what a step of 𝒢 costs beyond a bare call is their conversion

// N numbers out of an array, a tuple, a list or any other sequence of them.
template <int N>
Vec<N> vector_of(py::handle given, const char* name) {
  Vec<N> out;
  const py::detail::npy_api& numpy = py::detail::npy_api::get();
  if (numpy.PyArray_Check_(given.ptr())) {
    const auto* array = py::detail::array_proxy(given.ptr());
    const bool plain = array->nd == 1 && array->dimensions[0] == N && array->strides[0] == sizeof(double) &&
                       py::detail::array_descriptor_proxy(array->descr)->type_num == py::detail::npy_api::NPY_DOUBLE_;
    if (plain) {
      out = Eigen::Map<const Vec<N>>(reinterpret_cast<const double*>(array->data));
      return out;
    }
  }
  const auto wrong = [&] {
    return py::value_error(std::string(name) + ": expected " + std::to_string(N) + " numbers");
  };
  const py::object fast = py::reinterpret_steal<py::object>(PySequence_Fast(given.ptr(), ""));
  if (!fast) {
    PyErr_Clear();
    throw wrong();
  }
  if (PySequence_Fast_GET_SIZE(fast.ptr()) != N) throw wrong();
  for (int i = 0; i < N; ++i) {
    out[i] = PyFloat_AsDouble(PySequence_Fast_GET_ITEM(fast.ptr(), i));
    if (out[i] == -1.0 && PyErr_Occurred() != nullptr) {
      PyErr_Clear();
      throw wrong();
    }
  }
  return out;
}

template <int N>
py::array_t<double> array_of(const Vec<N>& vector) {
  return py::array_t<double>(N, vector.data());
}

// ---- A scene's 𝒢

class World {
 public:
  explicit World(const std::string& file)
      : compiled_(scenes::compile(scenes::load_scene(controller::user_file(file)))) {}

  py::array_t<double> step(double kappa, py::handle p, py::handle q) {
    if (!(kappa > 0.0 && std::isfinite(kappa))) throw py::value_error("kappa: expected a stiffness above zero, in N/m");
    switch (compiled_.dimensions()) {
      case 1:
        return step_in<1>(kappa, p, q);
      case 2:
        return step_in<2>(kappa, p, q);
      default:
        return step_in<3>(kappa, p, q);
    }
  }

  void set_time(double time_s, double period_s) {
    if (!std::isfinite(time_s) || !(period_s > 0.0 && std::isfinite(period_s))) {
      throw py::value_error("time and period: expected seconds, the period above zero");
    }
    std::visit([&](const auto& g) { g->set_time({time_s, period_s}); }, compiled_.any_algorithm);
  }

  // Of the last step: (object, feature, slips, normal).
  [[nodiscard]] py::list contacts() const {
    py::list out;
    std::visit(
        [&](const auto& g) {
          for (const auto& contact : g->contacts()) {
            out.append(py::make_tuple(contact.object, contact.feature, contact.slips,
                                      py::array_t<double>(contact.normal.size(), contact.normal.data())));
          }
        },
        compiled_.any_algorithm);
    return out;
  }

  [[nodiscard]] const std::string& name() const noexcept { return compiled_.name; }
  [[nodiscard]] int dimensions() const noexcept { return compiled_.dimensions(); }
  [[nodiscard]] std::vector<std::string> objects() const {
    std::vector<std::string> names;
    for (const scenes::Object& object : compiled_.source->objects) names.push_back(object.name);
    return names;
  }
  // To the nearest object where it is described; below 0 inside of one.
  [[nodiscard]] double clearance_m(py::handle x_W) const {
    return scenes::Clearances(*compiled_.source).of_point(vector_of<3>(x_W, "x"));
  }

 private:
  template <int N>
  py::array_t<double> step_in(double kappa, py::handle p, py::handle q) {
    const Vec<N> to = vector_of<N>(p, "p"), from = vector_of<N>(q, "q");
    if (!to.allFinite() || !from.allFinite()) throw py::value_error("p and q: expected finite numbers");
    return array_of<N>(compiled_.algorithm<N>()(kappa, to, from));
  }

  scenes::CompiledScene compiled_;
};

// ---- Simulated sessions

// A 𝒢 that is a Python function of kappa, p and q. It returns where the proxy goes, or that and its contacts
// (proxarm.Contact). What it raises ends the session.
class PythonWorld final : public OwnWorld {
 public:
  PythonWorld(py::function function, Session& session) : function_(std::move(function)), session_(session) {}

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override {
    contacts_.clear();
    points_W_.clear();
    if (raised_) return q;
    try {
      const py::gil_scoped_acquire held;
      return answer(function_(K, array_of<3>(p), array_of<3>(q)));
    } catch (...) {
      raised_ = std::current_exception();
      session_.stop();
      return q;
    }
  }
  [[nodiscard]] std::span<const models::Contact<3>> contacts() const noexcept override { return contacts_; }
  [[nodiscard]] std::span<const Vec3> contact_points_W() const noexcept override { return points_W_; }
  // In the order in which they were first touched.
  [[nodiscard]] std::vector<std::string> objects() const override { return objects_; }
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  [[nodiscard]] const std::exception_ptr& raised() const noexcept { return raised_; }

 private:
  Vec3 answer(const py::object& given) {
    const bool has_contacts = py::isinstance<py::tuple>(given) && py::len(given) == 2;
    const py::object place = has_contacts ? py::object(given[py::int_(0)]) : given;
    const Vec3 to = vector_of<3>(place, "the world's answer");
    if (!to.allFinite()) throw py::value_error("the world's answer: expected finite numbers");
    if (has_contacts) {
      for (const py::handle contact : given[py::int_(1)]) add(contact, to);
    }
    return to;
  }
  void add(py::handle contact, const Vec3& proxy_W) {
    models::Contact<3> added;
    added.normal = vector_of<3>(contact.attr("normal"), "a contact's normal").stableNormalized();
    if (!(added.normal.norm() > 0.5)) throw py::value_error("a contact's normal: expected a direction");
    added.slips = py::cast<bool>(contact.attr("slips"));
    added.object = number_of(py::cast<std::string>(contact.attr("object")));
    const py::object point = contact.attr("point");
    const Vec3 point_W = point.is_none() ? proxy_W : vector_of<3>(point, "a contact's point");
    if (!point_W.allFinite()) throw py::value_error("a contact's point: expected finite numbers");
    contacts_.push_back(added);
    points_W_.push_back(point_W);
  }
  std::int32_t number_of(const std::string& object) {
    const auto found = std::find(objects_.begin(), objects_.end(), object);
    const auto number = static_cast<std::int32_t>(found - objects_.begin());
    if (found == objects_.end()) objects_.push_back(object);
    return number;
  }

  py::function function_;
  Session& session_;
  std::vector<std::string> objects_;
  std::vector<models::Contact<3>> contacts_;
  std::vector<Vec3> points_W_;
  std::exception_ptr raised_;
};

// Options as Python has them: numbers, text, True or False, or a list of texts; None is as if it weren't there.
SessionOptions options_of(const py::dict& given) {
  SessionOptions options;
  for (const auto& item : given) {
    const py::handle value = item.second;
    const auto add = [&](OptionValue taken) { options.add({py::cast<std::string>(item.first), std::move(taken)}); };
    if (value.is_none()) continue;
    if (py::isinstance<py::bool_>(value)) {
      add(py::cast<bool>(value));
    } else if (py::isinstance<py::str>(value)) {
      add(py::cast<std::string>(value));
    } else if (py::isinstance<py::list>(value)) {
      add(py::cast<std::vector<std::string>>(value));
    } else {
      add(py::cast<double>(value));
    }
  }
  return options;
}

std::vector<std::string> text_columns(const std::vector<controller::SignalColumn>& columns) {
  std::vector<std::string> names;
  for (const controller::SignalColumn& column : columns) {
    if (column.unit.empty()) names.push_back(column.name);
  }
  return names;
}

// (name, numbers) or (name, codes, words); the arrays own what the columns had.
py::list columns_of(std::vector<TableColumn> columns) {
  const auto given_away = [](auto vector) {
    auto* const owned = new decltype(vector)(std::move(vector));
    const py::capsule owner(owned, [](void* memory) { delete static_cast<decltype(owned)>(memory); });
    return py::array(static_cast<py::ssize_t>(owned->size()), owned->data(), owner);
  };
  py::list out;
  for (TableColumn& column : columns) {
    if (column.is_text) {
      out.append(py::make_tuple(column.name, given_away(std::move(column.codes)), column.words));
    } else {
      out.append(py::make_tuple(column.name, given_away(std::move(column.numbers))));
    }
  }
  return out;
}

// The session's rows as signals.csv has them: one way from a record to its columns.
class Rows {
 public:
  explicit Rows(const Session& session)
      : axes_(axis_names(session)),
        deriver_(session.prepared().cell),
        text_(controller::signals_header(axes_, true) + "\n"),
        contacts_(controller::header_of(controller::contact_columns()) + "\n") {}

  void add(const CycleRecord& record) {
    controller::append_signals(text_, record, axes_.size(), true, deriver_.derive(record));
    text_ += '\n';
    for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
      controller::append_contact(contacts_, record, i);
      contacts_ += '\n';
    }
  }
  [[nodiscard]] std::vector<TableColumn> table() const {
    return read_table(text_, {}, text_columns(controller::signal_columns(axes_, true)), "signals");
  }
  [[nodiscard]] std::vector<TableColumn> contacts() const {
    return read_table(contacts_, {}, text_columns(controller::contact_columns()), "contacts");
  }

 private:
  std::vector<std::string> axes_;
  controller::SignalDeriver deriver_;
  std::string text_, contacts_;
};

constexpr std::uint64_t cycles_between_looks = 256;  // whether somebody has pressed Ctrl-C

// Returns the summary as JSON, the signals, the contacts and the names of the objects.
py::tuple run_session(Session& session, const std::optional<py::function>& world,
                      const std::optional<py::function>& hand) {
  std::optional<PythonWorld> python_world;
  if (world) session.set_world(python_world.emplace(*world, session));
  if (hand) {
    session.set_hand([&hand](double time_s, const Vec3& position_W, const Vec3& velocity_W) -> Vec3 {
      const py::gil_scoped_acquire held;
      const Vec3 force_W =
          vector_of<3>((*hand)(time_s, array_of<3>(position_W), array_of<3>(velocity_W)), "the hand's force");
      if (!force_W.allFinite()) throw py::value_error("the hand's force: expected finite numbers");
      return force_W;
    });
  }
  std::string summary;
  std::vector<TableColumn> columns, contacts;
  {
    const py::gil_scoped_release released;
    Rows rows(session);
    summary = summary_json(session.run([&](const CycleRecord& record) {
      rows.add(record);
      if (record.cycle % cycles_between_looks != 0) return;
      const py::gil_scoped_acquire held;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }));
    columns = rows.table();
    contacts = rows.contacts();
  }
  if (python_world && python_world->raised()) std::rethrow_exception(python_world->raised());
  return py::make_tuple(summary, columns_of(std::move(columns)), columns_of(std::move(contacts)), session.objects());
}

}  // namespace

PYBIND11_MODULE(_proxarm, module) {
  setup_error = PyErr_NewExceptionWithDoc(
      "proxarm.SetupError", "What is wrong with a file, an option or a session, in the words of the command line.",
      PyExc_ValueError, nullptr);
  module.attr("SetupError") = py::reinterpret_borrow<py::object>(setup_error);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const SetupError& error) {
      throw_as_python(error);
    }
  });

  py::class_<World>(module, "World", "The geometric algorithm of a scene: q = world(kappa, p, q_before), eq. (1a).")
      .def(py::init<std::string>(), py::arg("scene"))
      .def("__call__", &World::step, py::arg("kappa"), py::arg("p"), py::arg("q"),
           "Where a proxy at q goes that wants to p, coupled with kappa N/m; numpy arrays or sequences, in metres.")
      .def("set_time", &World::set_time, py::arg("time_s"), py::arg("period_s"),
           "Before a step of a world that moves: the time that the step leads to, and how long it is.")
      .def("clearance_m", &World::clearance_m, py::arg("x"), "To the nearest object; below 0 inside of one.")
      .def_property_readonly("contacts", &World::contacts, "Of the last step: (object, feature, slips, normal).")
      .def_property_readonly("name", &World::name, "Of the scene.")
      .def_property_readonly("objects", &World::objects, "Their names; contacts have their indices.")
      .def_property_readonly("dimensions", &World::dimensions, "Of the space in which it is touched: 1, 2 or 3.");
  module.def("_unpacked", [](const py::bytes& frame, std::size_t bytes) -> std::optional<py::bytes> {
    const auto found = models::unpacked(std::string_view(frame), bytes);
    return found ? std::optional<py::bytes>(*found) : std::nullopt;
  });
  module.def(
      "_bare", [](double, py::handle, py::handle) {}, "What a call costs that does nothing.");

  py::class_<Session>(module, "_Session")
      .def(py::init([](const py::dict& options) { return std::make_unique<Session>(options_of(options)); }))
      .def("surprises", &Session::surprises)
      .def("ask", &Session::ask, py::call_guard<py::gil_scoped_release>())
      .def("stop", &Session::stop)
      .def("run", &run_session);
  module.def("_read_table",
             [](const std::string& file, const std::vector<std::string>& wanted, const std::vector<std::string>& text) {
               std::vector<TableColumn> columns;
               {
                 const py::gil_scoped_release released;
                 columns = read_table_file(file, wanted, text);
               }
               return columns_of(std::move(columns));
             });
}

}  // namespace proxarm::python
