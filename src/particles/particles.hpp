// The one list of particle fields, their owner and the view that kernels get.
// Particles are arrays of small tensors; to add a field, add a line to the list.
#pragma once

#include "base/array.hpp"
#include "base/index.hpp"
#include "base/parallel.hpp"
#include "base/stress.hpp"
#include "base/vec.hpp"
#include "particles/cells.hpp"

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ordo {

/// Whole periods that a particle has travelled along each axis.
template <int D>
using Turns = Vec<D, int>;

/// The polynomial of a particle's velocity: coefficients, m/s, of products of orthogonal polynomials of degree 0 to 2 along
/// each axis.
template <int D>
struct Modes {
    Vec<D> c[power_of(3, D)];
};

// FIELD(type, name, group): `group` says which methods need it, see FieldGroups.
#define ORDO_PARTICLE_FIELDS(FIELD)                                                               \
    FIELD(Vec<D>, x, always)                     /* position at t_n, m */                         \
    FIELD(Vec<D>, X, always)                     /* initial position, m */                        \
    FIELD(Vec<D>, v, always)                     /* velocity at t_n - dt/2, m/s */                \
    FIELD(Mat<D>, F, always)                     /* deformation gradient */                       \
    FIELD(Stress<D>, sigma, always)              /* Cauchy stress, Pa */                          \
    FIELD(double, m, always)                     /* mass, kg */                                   \
    FIELD(double, V0, always)                    /* initial volume, m^D */                        \
    FIELD(double, V, always)                     /* volume J V0, m^D */                           \
    FIELD(double, J, averaged)                   /* V/V0, where det F is that of averages */      \
    FIELD(std::int32_t, id, always)              /* number in the order of seeding */             \
    FIELD(std::int32_t, body, always)            /* index of the body */                          \
    FIELD(std::int32_t, material, always)        /* index of the material */                      \
    FIELD(Vec<D>, half0, box)                    /* initial half-lengths, m */                    \
    FIELD(Vec<D>, half, box)                     /* half-lengths, m */                            \
    FIELD(Mat<D>, edges0, corners)               /* initial half-edge vectors, columns, m */      \
    FIELD(Mat<D>, edges, corners)                /* half-edge vectors F edges0, m */              \
    FIELD(CornerIds<D>, cell, cells)             /* the corners of the particle's cell */         \
    FIELD(std::int32_t, load, traction)          /* first of its loads in the model, or -1 */     \
    FIELD(Vec<D>, traction, traction)            /* force on its faces, N */                      \
    FIELD(Mat<D>, traction_moment, traction)     /* sum of force (x) arm from x, N m */           \
    FIELD(Vec<D>, b, body_force)                 /* body force per mass, m/s^2 */                 \
    FIELD(double, q, shock)                      /* artificial pressure, Pa */                    \
    FIELD(double, q_work, shock)                 /* lost by it per initial volume, J/m^D */       \
    FIELD(Mat<D>, L, gradient)                   /* velocities around it: v + L (x - x_p), 1/s */ \
    FIELD(Modes<D>, modes, modes)                /* the same of higher degree, see Modes */       \
    FIELD(std::int32_t, samples, corner_samples) /* bit c: corner c counts for this cell */       \
    FIELD(Turns<D>, turns, periodic)             /* periods travelled along each axis */

/// Groups of fields beyond those that every method needs.
struct FieldGroups {
    static constexpr bool always     = true;
    bool box                         = false;
    bool corners                     = false;
    bool cells                       = false;
    bool traction                    = false;
    bool body_force                  = false;
    bool averaged                    = false;
    bool shock                       = false;
    bool gradient                    = false;
    bool modes                       = false;
    bool corner_samples              = false;
    bool corner_velocity             = false;  ///< a field of corners, not of particles
    bool periodic                    = false;
    std::vector<std::string> history = {};  ///< names of the columns that laws carry, see Material
};

/// Raw pointers to the fields of `count` particles; absent fields are null.
template <int D>
struct ParticleView {
#define ORDO_FIELD(type, name, group) type* name;
    ORDO_PARTICLE_FIELDS(ORDO_FIELD)
#undef ORDO_FIELD
    int count;
    Array<double>* history;       ///< the columns that laws carry, in the order of Particles::history_names
    Vec<D>* corner;               ///< positions of the shared corners of cells, m
    Vec<D>* corner_velocity;      ///< their velocities, m/s; null if they have none of their own
    std::ptrdiff_t* corner_node;  ///< nodes of enriched corners, -1 for other corners; null if the method has none
    std::ptrdiff_t enriched_count;
};

/// The owner of the particle fields.
template <int D>
struct Particles {
#define ORDO_FIELD(type, name, group) Array<type> name;
    ORDO_PARTICLE_FIELDS(ORDO_FIELD)
#undef ORDO_FIELD
    int count = 0;
    std::vector<std::string> history_names;
    std::vector<Array<double>> history;  ///< one column per name
    // Fields of the shared corners of cells, never sorted.
    Array<Vec<D>> corner;                ///< positions, m
    Array<Vec<D>> corner_velocity;       ///< velocities, m/s, where corners are samples or keep them
    Array<std::int32_t> enriched;        ///< the corners that are degrees of freedom of their own, see method/enrichment.hpp
    Array<std::uint64_t> corner_planes;  ///< bit k of an enriched corner: condition k held it at the start
    Array<std::ptrdiff_t> corner_node;   ///< see ParticleView
    Array<std::int32_t> corner_part;     ///< the part of each corner (cells connect corners to parts); if any is enriched
    int part_count           = 0;
    bool has_corner_velocity = false;

    Particles() = default;
    Particles(int n, const FieldGroups& groups) : count(n), has_corner_velocity(groups.corner_velocity)
    {
#define ORDO_FIELD(type, name, group) \
    if (groups.group) name = Array<type>(n);
        ORDO_PARTICLE_FIELDS(ORDO_FIELD)
#undef ORDO_FIELD
        history_names = groups.history;
        for (std::size_t k = 0; k < history_names.size(); ++k) history.emplace_back(n);
        // First touch decides which processor a page belongs to: all threads touch here, else only the one that plants would. F and sigma,
        // half of the memory, are touched at the start of a run, when the seeds have gone.
        for_each_field([&](auto& field) {
            const void* const data = field.data();
            if (data == F.data() || data == sigma.data()) return;
            parallel_pieces(n, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                std::memset(static_cast<void*>(field.data() + begin), 0, sizeof(field[0]) * (end - begin));
            });
        });
    }

    /// visit(name, field) for each field that is present, and each column of history.
    template <class Visit>
    void for_each_named_field(Visit&& visit)
    {
#define ORDO_FIELD(type, name, group) \
    if (!name.empty()) visit(#name, name);
        ORDO_PARTICLE_FIELDS(ORDO_FIELD)
#undef ORDO_FIELD
        for (std::size_t k = 0; k < history.size(); ++k) visit(("history." + history_names[k]).c_str(), history[k]);
    }
    /// visit(field) for each field that is present.
    template <class Visit>
    void for_each_field(Visit&& visit)
    {
        for_each_named_field([&](const char*, auto& field) { visit(field); });
    }

    /// visit(name, field) for each field that these groups have, also where there are no particles.
    template <class Visit>
    void for_each_named_field_of(const FieldGroups& groups, Visit&& visit)
    {
#define ORDO_FIELD(type, name, group) \
    if (groups.group) visit(#name, name);
        ORDO_PARTICLE_FIELDS(ORDO_FIELD)
#undef ORDO_FIELD
        for (std::size_t k = 0; k < history.size(); ++k) visit(("history." + history_names[k]).c_str(), history[k]);
    }
    /// visit(field) for the same.
    template <class Visit>
    void for_each_field_of(const FieldGroups& groups, Visit&& visit)
    {
        for_each_named_field_of(groups, [&](const char*, auto& field) { visit(field); });
    }

    /// The number of the history column of this name; -1 if there is none.
    int history_column(std::string_view name) const
    {
        for (std::size_t k = 0; k < history_names.size(); ++k)
            if (history_names[k] == name) return static_cast<int>(k);
        return -1;
    }

    ParticleView<D> view()
    {
        return {
#define ORDO_FIELD(type, name, group) name.data(),
            ORDO_PARTICLE_FIELDS(ORDO_FIELD)
#undef ORDO_FIELD
                count,
            history.data(),
            corner.data(),
            corner_velocity.data(),
            corner_node.data(),
            static_cast<std::ptrdiff_t>(enriched.size())};
    }

    /// Bytes per particle in these arrays.
    std::size_t bytes_per_particle()
    {
        std::size_t n = 0;
        for_each_field([&](const auto& field) { n += sizeof(field[0]); });
        return n;
    }
};

}  // namespace ordo
