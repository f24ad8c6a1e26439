// Laws from outside the table of laws.hpp, such as those that users write in Python: one function for all particles of a material at
// once, as the last pass of a step.
#pragma once

#include "material/material.hpp"

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace ordo {

/// The particles of a material in a step. Tensors are 3 x 3, row by row; F and dF have ones where the problem has no axis.
class OutsideParticles {
  public:
    virtual ~OutsideParticles() = default;

    virtual std::size_t count() const = 0;
    virtual double dt() const         = 0;  ///< s
    /// The deformation gradient after the step, and that of the step, F = dF F_old: [count][9].
    virtual void read_F(double* out) const  = 0;
    virtual void read_dF(double* out) const = 0;
    /// A column of the law's own history: [count].
    virtual void read_history(std::size_t column, double* out) const = 0;
    /// Sets the Cauchy stresses, [count][9], Pa, and all columns. Throws NumericalError, and sets nothing, where a stress is not symmetric or
    /// has a component that the problem does not have, and where a number is not finite.
    virtual void set(const double* cauchy, const std::vector<const double*>& history) = 0;
};

class OutsideLaw {
  public:
    /// `history`: the names of the columns that the law changes and their initial values.
    OutsideLaw(std::string name, std::string what, std::vector<std::pair<std::string, double>> history);
    virtual ~OutsideLaw()                    = default;
    OutsideLaw(const OutsideLaw&)            = delete;  // its row refers to its names
    OutsideLaw& operator=(const OutsideLaw&) = delete;

    /// The speed of P-waves at rest, m/s, from which time steps follow.
    virtual double wave_speed(const NamedNumbers& parameters) const = 0;
    /// Sets stresses and history. Called by one thread.
    virtual void update(const NamedNumbers& parameters, OutsideParticles& particles) const = 0;

    const LawRow& row() const { return row_; }
    const std::vector<std::pair<std::string, double>>& history() const { return history_; }

    /// The first column of each such law: the work of the stresses per initial volume, J/m^D, heat included.
    static constexpr HistoryColumn kWork{"stress_work", "work of the stresses per initial volume, J/m^3"};

  private:
    std::string name_, what_;
    std::vector<std::pair<std::string, double>> history_;
    std::vector<HistoryColumn> columns_;
    LawRow row_;
};

/// Adds a law, for good: simulations may refer to it as long as the program runs. A later law of the same name takes its place in new
/// cases. Throws InputError if a law of the table has this name.
void add_law(std::unique_ptr<const OutsideLaw> law);

/// The laws of the table, then those that were added, without those that others replaced.
std::vector<const LawRow*> all_laws();

/// A number that changes when a law is added, for tables made from the list.
std::size_t version_of_laws();

/// What make() makes from the list of laws, made again after a law was added; former ones stay, because others may look at them. One for
/// each type of `make`.
template <class Make>
const auto& kept_with_laws(const Make& make)
{
    using Made = decltype(make());
    static std::mutex mutex;
    static auto* const versions = new std::map<std::size_t, Made>;
    const std::lock_guard lock(mutex);
    const std::size_t version = version_of_laws();
    const auto found          = versions->find(version);
    return found != versions->end() ? found->second : versions->emplace(version, make()).first->second;
}

/// The same numbers, kept for good: equal ones have equal addresses.
const NamedNumbers* keep_numbers(NamedNumbers numbers);

}  // namespace ordo
