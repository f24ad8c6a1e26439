// Particles and grid for ParaView: VTU and VTI with appended raw data, and the PVD that lists them over time.
#pragma once

#include "method/state.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

/// Writes the particles in the order of their ids. Domains are drawn as cells with cell data (lines, quads, hexahedra);
/// points as vertices with point data. `fields` are names of output_fields(); id, body and material are always written.
template <int D>
void write_particles(const std::filesystem::path& file, const Model<D>& model, State<D>& s,
                     const std::vector<std::string>& fields);

/// Writes mass and velocity of the grid of the last step at the corners of its cells; for splines the sums of N_i m_i and
/// N_i v_i there. Zero where there is no material.
template <int D>
void write_grid(const std::filesystem::path& file, const State<D>& s);

/// One file of a time series.
struct Frame {
    double t;
    std::string file;  ///< relative to the PVD
};

/// Writes the list of frames; replaced as a whole each time, so that it is always valid.
void write_pvd(const std::filesystem::path& file, const std::vector<Frame>& frames);

}  // namespace ordo::io
