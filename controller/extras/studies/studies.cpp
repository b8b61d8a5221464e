#include "controller/extras/studies/studies.hpp"

#include "controller/extras/studies/error/error.hpp"
#include "controller/extras/studies/error/tool_error.hpp"
#include "controller/extras/studies/figure5.hpp"
#include "controller/extras/studies/stability_map.hpp"
#include "controller/extras/studies/stress/stress.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::studies {

StudyList all_studies(const ArmRun& arm, const CycleRun& cycles) {
  StudyList list;
  list.push_back(std::make_unique<Figure5>());
  list.push_back(std::make_unique<Stress>());
  list.push_back(std::make_unique<Stress>(Stress::Worlds::meshes));
  list.push_back(std::make_unique<Stress>(Stress::Worlds::layers));
  list.push_back(std::make_unique<Stress>(Stress::Worlds::order_2));
  list.push_back(std::make_unique<Stress>(Stress::Worlds::tools));
  list.push_back(std::make_unique<Stress>(Stress::Worlds::moving_tools));
  list.push_back(std::make_unique<ErrorStudy>());
  list.push_back(std::make_unique<ToolErrorStudy>());
  list.push_back(std::make_unique<StabilityMap>());
  list.push_back(std::make_unique<Fidelity>(arm));
  list.push_back(std::make_unique<Skip>(cycles));
  return list;
}

const Study& study_named(const StudyList& list, const std::string& name) {
  std::vector<std::string> known;
  for (const auto& study : list) {
    if (study->name() == name) return *study;
    known.push_back(study->name());
  }
  const std::string near = description::nearest(name, known);
  known.emplace_back("merge");
  throw description::SetupError({.key = "study",
                                 .found = description::in_quotes(name),
                                 .expected = description::one_of(known),
                                 .advice = near.empty() ? "" : "did you mean " + near + "?"});
}

}  // namespace proxarm::studies
