// What can be read of a particle by name: the table of fields with units and how to compute each. Used by the schema, which lists
// them, and by what writes or shows particles.
#pragma once

#include "method/diagnostics.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace ordo {

/// What input and documents say of a field.
struct OutputFieldText {
    std::string name, what, unit;
};

/// All fields that a case may write: those of the table, then the history columns of all laws.
const std::vector<OutputFieldText>& output_fields();

/// Whether a field of this name is computed, not carried by a law.
bool is_computed_field(std::string_view name);

/// Reads a field of particles. Model and particles must outlive it, and materials and sizes must not change.
template <int D>
class FieldReader {
  public:
    /// `name` is "position" or one of output_fields(); throws std::logic_error if the particles do not have it.
    FieldReader(std::string_view name, const Model<D>& model, const Particles<D>& p);

    /// Numbers per particle: 1, 3 for vectors or 9 for tensors, row by row. Vectors and tensors are three-dimensional: components
    /// that the problem does not have are zero, F has ones on the diagonal.
    int components() const { return components_; }
    /// Writes the numbers of particle i. May be called in parallel.
    void operator()(int i, double* out) const { get_(*this, i, out); }

    const Model<D>& model() const { return *model_; }
    const Particles<D>& particles() const { return *p_; }
    const StoredEnergy<D>& stored_energy() const { return energy_; }
    const double* history() const { return history_; }

  private:
    const Model<D>* model_;
    const Particles<D>* p_;
    StoredEnergy<D> energy_;
    const double* history_ = nullptr;  ///< the column, if the field is one
    int components_        = 1;
    void (*get_)(const FieldReader&, int, double*);
};

}  // namespace ordo
