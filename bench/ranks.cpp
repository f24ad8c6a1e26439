// What ranks cost beside the passes over particles: a block in 3D with 8 particles a cell, shared by ranks that are threads. Times are of the
// processor that a thread has used, so more ranks than cores may run. Usage: bench_ranks [METHOD [RANKS [CELLS A SIDE]]]
#include "method/layout.hpp"
#include "method/planting.hpp"
#include "method/scheme.hpp"
#include "method/sharing.hpp"
#include "method/tables.hpp"
#include "particles/remove.hpp"
#include "setup/schemes.hpp"
#include "support/thread_ranks.hpp"

#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <functional>
#include <string>

namespace {

using namespace ordo;

/// Processor time of this thread, s.
double now()
{
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
template <class F>
double seconds(const F& f)
{
    const double begin = now();
    f();
    return now() - begin;
}
/// The mean of a time over all ranks, s.
double mean(Ranks& ranks, double time)
{
    std::int64_t all = std::llround(1e9 * time);
    ranks.add({&all, 1});
    return 1e-9 * static_cast<double>(all) / ranks.count();
}

Model<3> model_of(const MethodSpec& spec, int cells)
{
    Model<3> model{};
    model.method    = spec;
    model.h         = Vec<3>::filled(1.0);
    model.cells     = {cells + 16, cells + 16, cells + 16};
    model.materials = {{find_law("neo-hookean"), 1.0, 0.6, 0.4}};
    model.body_forces.resize(1);
    return model;
}

constexpr int kSteps = 10;

/// Of a rank in the mean; times in s.
struct Costs {
    int particles = 0, tile_width = 0;
    double sort = 0, plan = 0, pack = 0, step = 0, bytes = 0, messages = 0;
};

State<3> start(const Scheme<3>& scheme, int cells, Ranks& ranks)
{
    const Model<3>& model = scheme.model();
    const Bounds<3> block{Vec<3>::filled(5.5), Vec<3>::filled(5.5 + cells)};
    Particles<3> p          = plant_all(model, fill_box(block, SubCells<3>{{}, model.h, {2, 2, 2}}));
    const auto [begin, end] = part_of(p.count, ranks.index(), ranks.count());
    keep_particles(p, static_cast<int>(begin), static_cast<int>(end));
    return scheme.start(std::move(p), ranks);
}

/// Of a sort and of steps.
Costs costs_of(const Scheme<3>& scheme, State<3>& s, const std::function<void()>& before_steps)
{
    constexpr double dt   = 0.05;
    const Model<3>& model = scheme.model();
    Ranks& ranks          = *s.ranks;
    scheme.step(s, dt);
    const Tiles<3>& tiles = s.field.tiles;
    // Ranks that share cores measure no times worth having: all particles count alike.
    for (std::size_t k = 0; tiles.is_shared() && k < tiles.tiles().size(); ++k)
        tiles.weigh(k, 1e-7 * (tiles.tiles()[k].end - tiles.tiles()[k].begin) - tiles.seconds(k));
    sort_particles(model, s);
    for (Vec<3>& x : s.particles.x) x += Vec<3>::filled(0.26);  // half of them to the next cell; tiles are full then
    Costs r;
    r.particles  = s.particles.count;
    r.tile_width = s.field.tiles.width();
    r.sort       = mean(ranks, seconds([&] { sort_particles(model, s); }));
    scheme.step(s, dt);
    before_steps();
    r.step = mean(ranks, seconds([&] {
                             for (int k = 0; k < kSteps; ++k) scheme.step(s, dt);
                         }) / kSteps);
    return r;
}

/// The same, and what only ranks have. With tiles that are dealt out at random each sort sends most particles to another rank.
Costs costs_of(const Scheme<3>& scheme, State<3>& s, test::ThreadRanks& ranks)
{
    Costs r    = costs_of(scheme, s, [&] { ranks.traffic = {}; });
    r.bytes    = mean(ranks, 1e-9 * static_cast<double>(ranks.traffic.bytes)) * 1e9 / kSteps;
    r.messages = mean(ranks, 1e-9 * static_cast<double>(ranks.traffic.messages)) * 1e9 / kSteps;

    std::vector<std::pair<std::uint64_t, int>> owners;
    const auto tiles = gather_all(ranks, s.field.tiles.tile_numbers());
    for (std::size_t rank = 0; rank < tiles.size(); ++rank)
        for (const std::uint64_t tile : tiles[rank]) owners.emplace_back(tile, static_cast<int>(rank));
    const TileOwners of_tiles(std::move(owners));
    r.plan = mean(ranks, seconds([&] { join_rims(ranks, scheme.model().method, s.lattice, of_tiles, s.field.tiles); }));

    const NodeRecords records{s.field.nodes.data(), 1};
    std::vector<std::vector<Lanes>> packed;
    for (const RankMessage& m : ranks.messages) packed.emplace_back(m.nodes.size());
    r.pack = mean(ranks, seconds([&] {  // what goes out, and back to its places: as much comes in
                      for (std::size_t k = 0; k < packed.size(); ++k) {
                          Lanes* to = packed[k].data();
                          for (const std::ptrdiff_t node : ranks.messages[k].nodes) to = copy_node(to, {&records, 1}, node);
                          const Lanes* from = packed[k].data();
                          for (const std::ptrdiff_t node : ranks.messages[k].nodes) from = copy_node({&records, 1}, node, from);
                      }
                  }));
    return r;
}

}  // namespace

int main(int argc, char** argv)
{
    set_thread_count(1);
    const std::string method = argc > 1 ? argv[1] : "mpm";
    const int count = argc > 2 ? std::atoi(argv[2]) : 8, cells = argc > 3 ? std::atoi(argv[3]) : 48;
    const Preset* preset = find_preset(method);
    if (!preset || count < 2 || cells < 4) {
        fmt::print(stderr, "usage: bench_ranks [METHOD [RANKS [CELLS A SIDE]]]\n");
        return 2;
    }
    const std::unique_ptr<Scheme<3>> scheme = make_scheme(model_of(preset->spec, cells));
    Costs one, parts, random;
    {
        State<3> s = start(*scheme, cells, alone());
        one        = costs_of(*scheme, s, [] {});
    }
    auto on_ranks = [&](test::Division division, Costs& costs) {
        test::on_ranks(count, division, [&](test::ThreadRanks& ranks) {
            set_thread_count(1);
            State<3> s    = start(*scheme, cells, ranks);
            const Costs c = costs_of(*scheme, s, ranks);
            if (ranks.index() == 0) costs = c;
        });
    };
    on_ranks(test::Division::parts, parts);
    on_ranks(test::Division::random, random);

    const double of_rank = static_cast<double>(one.particles) / count, moved = of_rank * (count - 1) / count;
    fmt::print("{}, {} ranks, {:.0f} particles a rank in the mean, tiles of {} cells; processor time of a rank\n", method, count,
               of_rank, parts.tile_width);
    fmt::print("step {:.2f} ms, one process {:.2f} ms a {}th\n", 1e3 * parts.step, 1e3 * one.step / count, count);
    fmt::print("sent by a rank in a step: {:.0f} kB, {:.1f} messages\n", 1e-3 * parts.bytes, parts.messages);
    if (count == 8)
        fmt::print("  {:.0f} bytes a cell of the three inner faces of an octant\n", parts.bytes / (0.75 * cells * cells));
    fmt::print("records packed and put in their places: {:.3f} ms a step, {:.1f} %\n", 1e3 * parts.pack,
               100 * parts.pack / parts.step);
    fmt::print("sort {:.1f} ms, of which the plan {:.2f} ms; one process {:.1f} ms a {}th\n", 1e3 * parts.sort, 1e3 * parts.plan,
               1e3 * one.sort / count, count);
    fmt::print("particle that changes its rank: {:.0f} ns\n",
               1e9 * ((random.sort - random.plan) - (parts.sort - parts.plan)) / moved);
}
