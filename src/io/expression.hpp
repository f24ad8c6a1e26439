// Expressions of x, y, z, t (and the initial position X, Y, Z) as fields, through muParser.
#pragma once

#include "base/field.hpp"
#include "io/schema.hpp"

namespace ordo::io {

/// The field of a number or an expression. Throws InputError with the place if the expression does not parse.
/// The field may be called from all threads: each has its own parser.
Field make_field(const Expression& expression);

/// Whether a number or an expression that parses is a function of t alone.
bool depends_on_time_alone(const Expression& expression);

template <int D>
VectorField<D> make_vector_field(const std::vector<Expression>& expressions)
{
    VectorField<D> r;
    for (std::size_t a = 0; a < expressions.size() && a < D; ++a) r[a] = make_field(expressions[a]);
    return r;
}

}  // namespace ordo::io
