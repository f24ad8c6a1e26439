// Studies as JSON and as text.
#pragma once

#include "verification/study.hpp"

#include <optional>
#include <string>
#include <vector>

namespace ordo::verification {

/// A study that was run.
struct Result {
    Resolved study;
    std::vector<Row> rows;
    std::vector<Verdict> verdicts;

    /// Whether all judged bars are met; nothing if there are none.
    std::optional<bool> pass() const;
};

/// Whether the JSON has wall and CPU times or null; without them it is the same in each run.
enum class Times { yes, no };

/// The array that `ordo verify --json` writes. Missing and infinite numbers are null.
std::string to_json(const std::vector<Result>& results, Times times = Times::yes);

/// A table as CSV.
std::string to_csv(const Table& table);

/// The parts of a study's table: title, header, one row (with orders relative to the previous one), bars.
std::string table_title(const Resolved& study);
std::string table_header(const Row& row);
std::string table_row(const Row& row, const Row* before);
std::string table_bars(const Result& result);

}  // namespace ordo::verification
