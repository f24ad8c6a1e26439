// Which studies a user wants, by names, and their runs.
#pragma once

#include "verification/study.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ordo::verification {

struct StudyChoice {
    std::string name;  ///< of the case; empty with `all`
    bool all = false;
    std::vector<std::string> methods;
    std::vector<int> cells;
    std::optional<int> ppc;
    std::vector<std::pair<std::string, std::string>> settings;  ///< parameters of the case, axes and numbers of the method
};

/// The studies to run: those of the case, or of all cases. If cells, ppc, settings or methods are given for a case: one study per method
/// with these and the defaults of the case. Throws InputError.
std::vector<Resolved> choose_studies(const StudyChoice& choice);

/// One mesh of a study. A run out of memory is a failed row.
Row run_row(const Resolved& study, int cells, bool is_recorded);

}  // namespace ordo::verification
