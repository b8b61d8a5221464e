// Lists all studies and finds one by its name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/extras/studies/common/study.hpp"
#include "controller/extras/studies/fidelity.hpp"
#include "controller/extras/studies/skip.hpp"

namespace proxarm::studies {

using StudyList = std::vector<std::unique_ptr<Study>>;

// Returns all studies. `arm` and `cycles` are the functions that run the simulated arm for the studies that need it.
StudyList all_studies(const ArmRun& arm, const CycleRun& cycles);

// Returns the study of this name. If there is none, throws a description::SetupError that lists the studies.
const Study& study_named(const StudyList& list, const std::string& name);

}  // namespace proxarm::studies
