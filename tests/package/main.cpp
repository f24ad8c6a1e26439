// A program of its own on the installed library: a block falls freely for a tenth of a second. It is set up by structs and by a
// file, watched by an observer, and refused where `ordo run` would refuse it.
#include <io/load.hpp>
#include <method/tables.hpp>
#include <setup/build.hpp>
#include <sim/simulation.hpp>

#include <cmath>
#include <cstdio>
#include <functional>
#include <string_view>
#include <utility>

namespace {

using namespace ordo;

setup::CaseSpec<2> falling_block()
{
    setup::CaseSpec<2> spec{};
    spec.method    = find_preset("polypic")->spec;
    spec.size      = {1.0, 1.0};
    spec.spacing   = {0.1, 0.1};
    spec.gravity   = {0.0, -10.0};
    spec.materials = {{find_law("neo-hookean"), 1000.0, 5e4, 5e4}};
    spec.bodies    = {{.shape = Bounds<2>{{0.4, 0.4}, {0.6, 0.6}}}};
    spec.time      = {.end = 0.1, .dt = 0.001};
    return spec;
}

struct CountSteps : Observer<2> {
    int steps = 0;
    void after_step(Simulation<2>&, const StepSize&) override { ++steps; }
};

/// Whether the block falls g t^2/2 in 100 steps, with a stop half way.
bool falls(setup::Built<2> built)
{
    Simulation<2> simulation(std::move(built));
    CountSteps count;
    simulation.add(count);
    simulation.advance(0.05);
    simulation.run();
    const Particles<2>& p = simulation.state().particles;
    const double fall     = p.X[0][1] - p.x[0][1];
    std::printf("fell %.6f m in %.3f s, %d steps\n", fall, simulation.state().t, count.steps);
    return std::fabs(fall - 0.05) < 1e-9 && count.steps == 100;
}

/// Whether the block with a change is refused, by a message that names the key.
bool is_refused(std::string_view key, const std::function<void(setup::CaseSpec<2>&)>& change)
{
    setup::CaseSpec<2> spec = falling_block();
    change(spec);
    try {
        setup::build(spec);
    } catch (const InputError& e) {
        std::printf("%s\n", e.what());
        return std::string_view(e.what()).starts_with(key);
    }
    return false;
}

}  // namespace

int main(int, char** arguments)
{
    bool is_good = falls(setup::build(falling_block())) && falls(io::load<2>(arguments[1]));
    is_good &= is_refused("time.dt: ", [](auto& spec) { spec.time.dt = 0.1; });
    is_good &= is_refused("body[0].shape: ", [](auto& spec) { spec.bodies[0].shape = Ball<2>{{0.9, 0.5}, 0.2}; });
    is_good &= is_refused("body[1].shape: ", [](auto& spec) { spec.bodies.push_back(spec.bodies[0]); });
    is_good &= is_refused("grid.spacing: ", [](auto& spec) { spec.spacing[0] = 0.3; });
    return is_good ? 0 : 1;
}
