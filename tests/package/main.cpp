// A program of its own on the installed library: a block falls freely for a tenth of a second.
#include <method/explicit.hpp>
#include <method/tables.hpp>
#include <particles/seeding.hpp>

#include <cmath>
#include <cstdio>

int main()
{
    using namespace ordo;
    Model<2> model{};
    model.method    = find_preset("polypic")->spec;
    model.h         = {0.1, 0.1};
    model.cells     = {10, 10};
    model.gravity   = {0.0, -10.0};
    model.materials = {{find_law("neo-hookean"), 1000.0, 5e4, 5e4}};
    model.body_forces.resize(1);

    const auto seeds = fill_box(Bounds<2>{{0.4, 0.4}, {0.6, 0.6}}, SubCells<2>{model.origin, model.h, {2, 2}});
    Particles<2> particles(static_cast<int>(seeds.size()), field_groups(model));
    for (int i = 0; i < particles.count; ++i) plant(particles, i, seeds[i], 1000.0);
    const Explicit<2> method(model);
    State<2> state = method.start(std::move(particles));
    for (int k = 0; k < 100; ++k) method.step(state, 0.001);
    const double fall = state.particles.X[0][1] - state.particles.x[0][1];
    std::printf("fell %.6f m in %.3f s\n", fall, state.t);
    return std::fabs(fall - 0.05) < 1e-9 ? 0 : 1;
}
