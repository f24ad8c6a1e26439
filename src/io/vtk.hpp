// Particles and grid for ParaView: VTU and VTI with appended raw data, and the PVD that lists them over time.
#pragma once

#include "method/state.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

/// What a file of particles holds of them.
struct FrameStyle {
    std::vector<std::string> fields;  ///< names of output_fields(); id, body and material are always written
    bool is_single     = false;       ///< reals of 32 bits instead of 64
    bool is_compressed = false;       ///< by zlib, in blocks
    bool as_points     = false;       ///< one cell of all points, no domains
    int every          = 1;           ///< particles whose number it divides
};

/// Writes the particles in the order of their ids. Domains are drawn as cells with cell data (lines, quads, hexahedra);
/// points as vertices with point data. All ranks call this, the first writes.
template <int D>
void write_particles(const std::filesystem::path& file, const Model<D>& model, const State<D>& s, const FrameStyle& style);

/// The size of the file that write_particles would write without compression, bytes.
template <int D>
std::uint64_t size_of_frame(const Model<D>& model, const State<D>& s, FrameStyle style);

/// Writes mass and velocity of the grid of the last step at the corners of its cells; for splines the sums of N_i m_i and
/// N_i v_i there. Zero where there is no material.
template <int D>
void write_grid(const std::filesystem::path& file, const State<D>& s);

/// Writes the points at which bodies press on each other after the last step: pressure, Pa, traction on their own body, Pa, gap, m,
/// slip, m/s, and the numbers of the contact and of the body.
template <int D>
void write_contacts(const std::filesystem::path& file, const Model<D>& model, const State<D>& s);

/// One file of a time series.
struct Frame {
    double t;
    std::string file;  ///< relative to the PVD
};

/// Writes the list of frames; replaced as a whole each time, so that it is always valid.
void write_pvd(const std::filesystem::path& file, const std::vector<Frame>& frames);

}  // namespace ordo::io
