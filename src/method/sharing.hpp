// The part of a state that one rank has: the particles of its tiles, and the blocks of nodes that these write to.
#pragma once

#include "base/joined_rows.hpp"
#include "grid/rim_plan.hpp"
#include "method/state.hpp"
#include "particles/travel.hpp"

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace ordo {

/// Why ranks cannot share a model, and what to do instead; empty if they can.
template <int D>
std::string alone_because(const Model<D>& model);

/// Throws InputError with that.
template <int D>
void require_shareable(const Model<D>& model);

/// Of particles sorted by `tiles`, each rank has those from place `first` on: divides the tiles among the ranks, and sends particles to the
/// ranks of their tiles. `tiles` then are those of this rank.
template <int D>
void distribute(const Model<D>& model, const Lattice<D>& lattice, std::int64_t first, Tiles<D>& tiles, State<D>& s);

/// Whose the tiles of a sort are, and what the particles in each of this rank have taken before it, s: one window between sorts says little,
/// so older ones count too, each for less than the next. Without times of all tiles there are none.
struct Division {
    TileOwners owners;
    std::map<std::uint64_t, double> seconds;
    Merged particles;  ///< of this rank, in the order of the sort before, or of their numbers if there was none
};

/// Divides the tiles of the coming sort among the ranks, and sends particles to the ranks of their tiles. tile_of(i) is the number of the
/// tile of particle i. The fields of `s` stay as they are.
template <int D>
Division migrate(const Model<D>& model, State<D>& s, const Tiles<D>& tiles, const std::function<std::uint64_t(int)>& tile_of);

/// Tells others the blocks that the particles of this rank touch, and sets up the relay of `tiles`.
template <int D>
void join_rims(Ranks& ranks, const MethodSpec& method, const Lattice<D>& lattice, const TileOwners& owners, Tiles<D>& tiles);

/// The particles of all ranks in the order of one process, and the corners of their cells.
template <int D>
JoinedRows joined_particles(const State<D>& s);
template <int D>
JoinedRows joined_corners(const State<D>& s);

/// While it lives, rank 0 has the tiles of all ranks in its state and the nodes of blocks, where nothing else reads them. For files.
template <int D>
class Gathered {
  public:
    /// @param is_wanted says whether a block with these nodes is wanted; null: none is
    explicit Gathered(State<D>& s, const std::function<bool(const IndexBox<D>&)>& is_wanted = {});
    ~Gathered();
    Gathered(const Gathered&)            = delete;
    Gathered& operator=(const Gathered&) = delete;

  private:
    State<D>& s_;
    bool is_swapped_ = false;
    Tiles<D> tiles_;  ///< the others: of this rank once they are swapped
};

}  // namespace ordo
