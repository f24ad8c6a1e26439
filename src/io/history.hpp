// The columns of history.csv: sums over all particles, energies, forces of boundaries, tractions and contacts.
#pragma once

#include "io/input.hpp"
#include "method/state.hpp"

#include <string>
#include <vector>

namespace ordo::io {

/// Input and model must outlive it.
template <int D>
class History {
  public:
    History(const CaseInput& input, const Model<D>& model);

    const std::vector<std::string>& columns() const { return columns_; }
    /// The numbers of a state, one per column. All ranks call this.
    std::vector<double> row(const State<D>& s) const;

  private:
    const Model<D>& model_;
    std::vector<Exchanging> exchanging_;
    bool has_stages_;
    std::vector<std::string> columns_;
};

}  // namespace ordo::io
