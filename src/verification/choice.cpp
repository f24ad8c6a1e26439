#include "verification/choice.hpp"

#include "base/error.hpp"
#include "io/method_names.hpp"
#include "io/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>

namespace ordo::verification {

namespace {

const Case& find_case(const std::string& name)
{
    std::vector<std::string> names;
    for (const Case& c : cases()) {
        if (c.name == name) return c;
        names.push_back(c.name);
    }
    throw InputError(fmt::format("{}: there is no such verification case. {}", name, io::suggestion(name, names)));
}

}  // namespace

std::vector<Resolved> choose_studies(const StudyChoice& choice)
{
    for (const std::string& m : choice.methods) io::preset_called(m);
    for (std::size_t k = 1; k < choice.cells.size(); ++k)
        if (choice.cells[k] <= choice.cells[k - 1])
            throw InputError(
                fmt::format("--cells: {} after {}; list meshes from coarse to fine", choice.cells[k], choice.cells[k - 1]));
    const bool is_custom = !choice.cells.empty() || choice.ppc || !choice.settings.empty() || !choice.methods.empty();
    std::vector<Resolved> studies;
    if (choice.all) {
        if (!choice.cells.empty() || choice.ppc || !choice.settings.empty())
            throw InputError("--all runs the studies of all cases as they are; --cells, --ppc and --set need a case");
        for (const Case& c : cases())
            for (const Study& s : c.studies)
                if (choice.methods.empty() ||
                    std::find(choice.methods.begin(), choice.methods.end(), s.method) != choice.methods.end())
                    studies.push_back(resolve(c, s));
        return studies;
    }
    const Case& c = find_case(choice.name);
    if (!is_custom) {
        for (const Study& s : c.studies) studies.push_back(resolve(c, s));
        return studies;
    }
    std::vector<std::string> methods = choice.methods;
    for (const Study& s : c.studies)
        if (choice.methods.empty() && std::find(methods.begin(), methods.end(), s.method) == methods.end())
            methods.push_back(s.method);
    for (const std::string& m : methods) {
        Study study{.method = m, .ppc = choice.ppc.value_or(0), .set = {}, .cells = choice.cells, .bars = {}};
        for (const auto& [key, value] : choice.settings) study.set.emplace_back(key, value);
        studies.push_back(resolve(c, study));
    }
    return studies;
}

Row run_row(const Resolved& study, int cells, bool is_recorded)
{
    Request request     = study.request;
    request.cells       = cells;
    request.is_recorded = is_recorded;
    try {
        return study.of->run(request);
    } catch (const std::bad_alloc&) {
        Row row{};
        row.cells  = cells;
        row.h      = 1.0 / cells;
        row.failed = "out of memory";
        return row;
    }
}

}  // namespace ordo::verification
