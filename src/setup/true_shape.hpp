// What the sub-cells of a round body miss: its volume, and the areas of its faces, which are stairs of sub-cells.
#pragma once

#include "setup/spec.hpp"

#include <functional>
#include <optional>
#include <vector>

namespace ordo::setup {

/// The volume of a ball or of a tube in sub-cells of the grid, m^D. Nothing for shapes that their particles fill exactly, and for
/// polar cells.
template <int D>
std::optional<double> true_volume(const BodyShape<D>& shape);

/// Whether a face of a round body cuts a particle's domain, given by its centre and corners.
template <int D>
bool is_cut(const BodyShape<D>& shape, const Vec<D>& center, const std::vector<Vec<D>>& corners);

/// How much area of the true surface the outer faces of a body's sub-cells stand for. The area of stairs does not converge: it is
/// 4/pi times that of a circle and 3/2 times that of a sphere. Of each stair the part along the true normal counts, times one factor
/// for each smooth face that makes the sum its true area.
template <int D>
class TrueAreas {
  public:
    TrueAreas(const BodyShape<D>& shape, const CellMesh<D>& mesh);

    /// The true area over that of an outer face with this unit normal and centre; 1 for bodies without round faces.
    double share(const Vec<D>& normal, const Vec<D>& center) const;

  private:
    struct Smooth {
        double area;
        std::function<double(const Vec<D>&)> distance;
        std::function<Vec<D>(const Vec<D>&)> normal;  ///< outwards
        double stairs = 0.0;                          ///< sum of their parts along the normal
    };
    static std::vector<Smooth> faces_of(const BodyShape<D>& shape);
    /// The smooth face that a stair belongs to: the nearest that looks to the same side.
    std::size_t find(const Vec<D>& normal, const Vec<D>& center) const;

    std::vector<Smooth> faces_;
};

}  // namespace ordo::setup
