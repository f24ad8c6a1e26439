// Checks that bodies lie in the grid or in adjacent periods, and on the inner side of planes. Used by set-up.
#pragma once

#include "setup/seeding.hpp"

namespace ordo::setup {

/// How far the domain of a seed reaches from its centre along each axis, m.
template <int D>
Vec<D> reach_of_domain(const Seed<D>& s);

/// The box around the domains of each body's seeds; a seed of a mesh has that of a box.
template <int D>
std::vector<Bounds<D>> bounds_of(const std::vector<SeedWalk<D>>& bodies);

/// Whether a domain of this reach meets the box around a body other than its own.
template <int D>
bool is_near_another(const Vec<D>& x, const Vec<D>& reach, int body, const std::vector<Bounds<D>>& bounds);

/// Before a built-in shape is filled: it must meet the grid or an adjacent period. Throws SetupError.
template <int D>
void require_near(const BodySpec<D>& body, int k, const Bounds<D>& bounds, const Model<D>& model);

/// Every particle, the corners of its domain and those of a mesh must lie in the grid; particles also on the inner side of every
/// plane. Along periodic axes a body must be no longer than the period, and lie in it or in adjacent ones. Throws SetupError.
template <int D>
void require_inside(const BodySpec<D>& body, int k, const Filling<D>& filling, const Model<D>& model);

}  // namespace ordo::setup
