// Finds the outer faces of bodies on which tractions act. Used by setup/build.cpp.
#pragma once

#include "setup/spec.hpp"

#include <vector>

namespace ordo::setup {

/// Throws SetupError for tractions on bodies whose outer faces are not known, or on inner or outer faces without a center.
template <int D>
void require_faces(const std::vector<TractionSpec<D>>& tractions, const std::vector<BodySpec<D>>& bodies);

/// Puts the tractions of body k on its faces; its particles are those of `mesh`, numbered from `first` on. Throws SetupError if a
/// traction finds no face, or is not finite at the start.
template <int D>
void load_faces(const std::vector<TractionSpec<D>>& tractions, const BodySpec<D>& body, int k, const CellMesh<D>& mesh, int first,
                Model<D>& model, Particles<D>& p);

}  // namespace ordo::setup
