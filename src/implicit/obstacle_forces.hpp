// Rigid obstacles in an implicit step: forces on the points of contact that grow with their overlap and slip, and how they change.
#pragma once

#include "grid/node_rows.hpp"
#include "method/state.hpp"

#include <span>
#include <vector>

namespace ordo {

/// Pressure k (-gap) where a point overlaps, shear -k slip up to Coulomb's limit, with k = stiffness M_P/h, M_P the largest P-wave modulus of the
/// body. Normals are those at the start of the step. Obstacles move by the velocities of its middle: a tied point as theirs, of others the way along
/// the surface is that of the point, and across it that of its velocity, for round surfaces stay where they are when they turn.
template <int D>
class ObstacleForces {
  public:
    /// Finds the points near obstacles. Sets the velocities of obstacles.
    ObstacleForces(const Model<D>& model, State<D>& s, const NodeRows<D>& rows, double dt, double stiffness);

    /// Finds the forces for displacements u of unknown D k + a, component a of row k + 1, and adds them to r, N.
    void add_forces(std::span<const double> u, std::span<double> r);
    /// y += factor df/du x at the last of these.
    void add_product(double factor, std::span<const double> x, std::span<double> y) const;
    /// add(row, row, block) for the entries of -df/du.
    template <class Add>
    void for_each_entry(const Add& add) const
    {
        for (std::size_t q = 0; q < points_.size(); ++q)
            for (int i = first_[q]; i < first_[q + 1]; ++i)
                for (int j = first_[q]; j < first_[q + 1]; ++j)
                    add(weights_[i].row, weights_[j].row, weights_[i].value * weights_[j].value * stiffness_[q]);
    }
    /// f(row, stiffness) for the nodes of points that have stiffness at the last forces, some several times.
    template <class F>
    void for_each_row(const F& f) const
    {
        for (std::size_t q = 0; q < points_.size(); ++q)
            for (int i = first_[q]; i < first_[q + 1] && !(stiffness_[q] == Mat<D>{}); ++i) f(weights_[i].row, stiffness_[q]);
    }
    bool is_empty() const { return points_.empty(); }
    /// The obstacle of a point that was not near and would be in it after displacements u; -1 if there is none.
    int misses(std::span<const double> u) const;

    /// Leaves points, forces and work in the state, and moves the obstacles.
    void finish();

  private:
    /// Finds the points within `reach`, m.
    ObstacleForces(const Model<D>& model, State<D>& s, const NodeRows<D>& rows, double dt, double stiffness, double reach);

    struct Weight {
        int row;
        double value;
    };
    /// Traction of a point, Pa, and -d traction : d motion, Pa/m.
    struct Response {
        Vec<D> traction;
        Mat<D> stiffness;
    };
    Response response_to(std::size_t q, const Vec<D>& motion) const;
    void add(std::size_t q, const Vec<D>& force, std::span<double> r) const;
    Vec<D> motion_of(std::size_t q, std::span<const double> u) const;
    Vec<D> motion_of_obstacle(const ContactPoint<D>& point) const;
    const ContactPair<D>& pair_of(const ContactPoint<D>& point) const { return model_.contacts[point.key.pair]; }

    const Model<D>& model_;
    State<D>& s_;
    const NodeRows<D>& rows_;
    double dt_, reach_, touching_ = 0.0;  ///< s; m; the gap, m, that is none
    std::vector<ContactPoint<D>> points_;
    std::vector<int> first_;  ///< of each point, and the end of the last: where its weights begin
    std::vector<Weight> weights_;
    std::vector<double> k_;                       ///< of each point, Pa/m
    std::vector<Vec<D>> moved_, obstacle_moves_;  ///< relative to the obstacle in the step, and of the obstacle there, m
    std::vector<Vec<D>> traction_;                ///< Pa
    std::vector<Mat<D>> stiffness_;               ///< -d force : d motion, N/m
};

}  // namespace ordo
