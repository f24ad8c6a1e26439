// A law with history and a parameter, for the test of how a law is added: the elastic law with the Jaumann rate that counts its
// steps. The row for it is ORDO_OWN_LAW in CMakeLists.txt.
#pragma once

#include "material/jaumann_elastic.hpp"

namespace ordo {

struct OwnLaw {
    static constexpr std::string_view name = "step-counter", what = "jaumann-elastic that counts its steps";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr std::array parameters{LawParameter{"weight", "", "what a step counts", 0, 100}};
    static constexpr std::array history{HistoryColumn{"steps_seen", "weighted number of steps", 1000.0},
                                        HistoryColumn{"time_seen", "sum of the steps, s"}};

    JaumannElastic elastic;
    double weight;

    ORDO_FLAT static OwnLaw of(const Material& m) { return {JaumannElastic::of(m), m.parameters[0]}; }

    template <int D, class T>
    ORDO_FLAT Stress<D, T> update(const Step<D, T>& step, const Stress<D, T>& sigma, T* seen) const
    {
        seen[0] += T(weight);
        seen[1] += T(step.dt);
        return elastic.update(step, sigma, seen);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Stress<D, T>& sigma, const T* seen) const
    {
        return elastic.energy(sigma, seen);
    }
};
static_assert(Incremental<OwnLaw>);

}  // namespace ordo
