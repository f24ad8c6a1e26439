// A scalar given by the user over space and time: a number, or a function such as a parsed expression.
// Lower layers evaluate it; only io knows how it was written.
#pragma once

#include "base/vec.hpp"

#include <array>
#include <functional>
#include <utility>

namespace ordo {

/// Where and when a field is evaluated: current position x, initial position X of the material point, time t.
struct FieldPoint {
    Vec<3> x;
    Vec<3> X;
    double t;
};

/// A number or a function of FieldPoint. The function must be callable from several threads at once.
class Field {
  public:
    Field(double value = 0.0) : value_(value) {}
    explicit Field(std::function<double(const FieldPoint&)> f) : function_(std::move(f)) {}

    bool is_constant() const { return !function_; }
    bool is_zero() const { return is_constant() && value_ == 0.0; }
    double operator()(const FieldPoint& at) const { return function_ ? function_(at) : value_; }

  private:
    double value_ = 0.0;
    std::function<double(const FieldPoint&)> function_;
};

/// One field per axis.
template <int D>
using VectorField = std::array<Field, D>;

template <int D>
Vec<D> evaluate(const VectorField<D>& f, const FieldPoint& at)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = f[static_cast<std::size_t>(a)](at);
    return r;
}

template <int D>
bool is_zero(const VectorField<D>& f)
{
    for (const Field& c : f)
        if (!c.is_zero()) return false;
    return true;
}

/// Negative inside, positive outside, smooth near where it vanishes; a body is where all of its functions are negative.
template <int D>
using LevelSet = std::function<double(const Vec<D>&)>;

}  // namespace ordo
