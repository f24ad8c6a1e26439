// What particles do to nodes in a trial step of an implicit scheme: nominal stresses and loads from the displacement gradients of the step, and
// how both change with them. With averages of volume changes too, whose forces are the derivatives of the averaged energy.
#pragma once

#include "kernels/nominal_stress.hpp"
#include "method/state.hpp"

#include <vector>

namespace ordo {

/// Trial steps of size dt from a state. Forces are those at the end of the step, or with `is_middle` those that act in its middle.
template <int D>
class ParticleForces {
  public:
    /// The laws have derivatives: those of the table.
    ParticleForces(const Model<D>& model, State<D>& s, double dt, bool is_middle);

    /// Sets stresses and loads for displacements u and deformation gradients f of the step, and their derivatives if they are wanted. Body forces
    /// are those of the particles. Returns what went wrong.
    TileReport find(const Vec<D>* u, const Mat<D>* f, bool with_derivatives);
    /// Sets them to those at the start of the step, by the stresses that particles have.
    void find_at_start();

    /// What particle i leaves at a node: force times phi_ip and moment times grad phi_ip. `load` without stresses.
    const Array<Vec<D>>& force() const { return force_; }
    const Array<Mat<D>>& moment() const { return moment_; }
    const Array<Mat<D>>& load_moment() const { return load_moment_; }

    /// The change of force and moment with f in the direction df, at the last trial with derivatives.
    void differentiate(const Mat<D>* df, Vec<D>* force, Mat<D>* moment);

    // For matrices, at the last trial with derivatives.
    /// d Pi : d f, with averages of the scaled step.
    const Tangent<D>& tangent(int i) const { return tangent_[i]; }
    bool has_symmetric_tangents() const;
    const Mat<D>& step(int i) const { return f_[i]; }
    /// With averages: the scale of the step, and the weight of the particle's dilation f^-T : df in the average.
    double scale(int i) const { return scale_[i]; }
    double weight(int i) const { return s_.averages.weights[i] * ratio_[i]; }

  private:
    struct OfMaterial {
        NominalPass<D> pass;
        int material;
        std::vector<int> columns;
    };
    bool has_averages() const { return model_.method.averaging != Averaging::none; }
    Vec<D> traction_on(const Load<D>& load, const FaceShape<D>& face, int i, const Vec<D>& u, const Mat<D>& f, double t) const;
    Mat<D> part_of(const Mat<D>& f) const { return is_middle_ ? 0.5 * (f + Mat<D>::identity()) : f; }
    void find_loads(const Vec<D>* u, const Mat<D>* f, double t);
    void find_moments(const Mat<D>* f);
    void average_steps(const Mat<D>* f);
    void spread_averages(const Mat<D>* f);

    const Model<D>& model_;
    State<D>& s_;
    double dt_;
    bool is_middle_;
    std::vector<OfMaterial> materials_;
    std::vector<FaceShape<D>> faces_;  ///< of the loads, at the start of the step
    Array<Mat<D>> f_, stress_, moment_, load_moment_;
    Array<Vec<D>> force_, u_;
    Array<Tangent<D>> tangent_;
    // With averages: the scale of f, the averaged volume ratios and their weights in Pi, see find.
    Array<Mat<D>> averaged_;
    Array<double> scale_, ratio_, mean_, part_, mean_part_, d_mean_, d_part_, d_mean_part_;
    Array<Mat<D>> d_stress_;
};

}  // namespace ordo
