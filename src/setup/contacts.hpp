// Contact between bodies: which pairs there are, their surfaces, and what they ask of method and bodies. Used by setup/build.cpp.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// Sets the velocity fields of the bodies and the pairs of the model, without surfaces. Throws SetupError.
template <int D>
void set_up_contacts(const CaseSpec<D>& spec, Model<D>& model);

/// Why a method cannot have contact between bodies, or with obstacles, and the remedy; null if it can.
const char* refusal_of_contact(const MethodSpec& method, int dim, bool with_obstacles);

/// Whether the particles of a method have corners, so that bodies have faces.
bool has_faces(const MethodSpec& method);

/// Throws SetupError at entry k of a part if body b is a list of particles, without outer faces.
template <int D>
void require_faces(const CaseSpec<D>& spec, int b, Part part, std::size_t k);

/// Throws SetupError at entry k of a part if the bodies are not there or named twice, or the law has wrong numbers.
void require_law(const ContactSpec& contact, Part part, std::size_t k, std::size_t bodies);

/// The bodies of a contact, ascending.
std::vector<int> bodies_of(const ContactSpec& contact, std::size_t count);

/// A contact by its law, without surfaces, of `body` with another one or, where that is negative, with an obstacle.
template <int D>
ContactPair<D> pair_of(const CaseSpec<D>& spec, const ContactSpec& contact, int body, int other);

/// Whether a body is in a contact, so that its outer faces are needed.
template <int D>
bool is_in_contact(const Model<D>& model, int body);

/// Gives the model the surfaces of the bodies, from their meshes; body k has the particles from first[k] on. Finds the points
/// that are tied. Throws SetupError for bodies thinner than a cell.
template <int D>
void find_surfaces(const std::vector<CellMesh<D>>& meshes, const std::vector<int>& first, const Particles<D>& p, Model<D>& model);

}  // namespace ordo::setup
