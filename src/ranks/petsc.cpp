// Ranks as processes of MPI; records of nodes travel by PetscSF. The only file that knows either. A library of its own, which the program
// loads when a launcher has started several processes: see app/ranks.hpp.
#include "base/ranks.hpp"

#include <petscsf.h>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <string>

namespace ordo {

namespace {

/// MPI and PETSc end the program themselves where they fail, unless they say so.
void require(int error, const char* what)
{
    if (error != 0) throw std::runtime_error(std::string(what) + " failed");
}

/// The type of a record of `size` Lanes.
class RecordTypes {
  public:
    RecordTypes() = default;
    ~RecordTypes()
    {
        for (auto& [size, type] : types_) MPI_Type_free(&type);
    }
    RecordTypes(const RecordTypes&) = delete;

    MPI_Datatype of(int size)
    {
        const auto [at, is_new] = types_.try_emplace(size);
        if (is_new) {
            require(MPI_Type_contiguous(8 * size, MPI_DOUBLE, &at->second), "MPI_Type_contiguous");
            require(MPI_Type_commit(&at->second), "MPI_Type_commit");
        }
        return at->second;
    }

  private:
    std::map<int, MPI_Datatype> types_;
};

/// One star forest a round. Its roots are the records that this rank sends, one list after the other; its leaves are those that it receives.
class PetscRelay final : public Relay {
  public:
    /// @param first [round][rank]: where the list for this rank begins among the roots of that rank
    PetscRelay(MPI_Comm comm, RecordTypes& types, const std::vector<RankRound>& rounds,
               const std::vector<std::map<int, int>>& first)
        : types_(types)
    {
        for (std::size_t k = 0; k < rounds.size(); ++k) {
            Round& round = rounds_.emplace_back();
            for (const RankMessage& m : rounds[k].out) round.out.insert(round.out.end(), m.nodes.begin(), m.nodes.end());
            std::vector<PetscSFNode> remote;
            for (const RankMessage& m : rounds[k].in) {
                round.in.insert(round.in.end(), m.nodes.begin(), m.nodes.end());
                for (std::size_t i = 0; i < m.nodes.size(); ++i)
                    remote.push_back({m.rank, static_cast<PetscInt>(first[k].at(m.rank)) + static_cast<PetscInt>(i)});
            }
            require(PetscSFCreate(comm, &round.forest), "PetscSFCreate");
            require(PetscSFSetGraph(round.forest, static_cast<PetscInt>(round.out.size()), static_cast<PetscInt>(remote.size()),
                                    nullptr, PETSC_COPY_VALUES, remote.data(), PETSC_COPY_VALUES),
                    "PetscSFSetGraph");
            require(PetscSFSetUp(round.forest), "PetscSFSetUp");
        }
    }
    ~PetscRelay() override
    {
        for (Round& round : rounds_) PetscSFDestroy(&round.forest);
    }
    PetscRelay(const PetscRelay&) = delete;

    void send(int k, std::span<const NodeRecords> records) override
    {
        Round& round   = rounds_.at(static_cast<std::size_t>(k));
        const int size = size_of(records);
        round.sent.resize(round.out.size() * static_cast<std::size_t>(size));
        round.received.resize(round.in.size() * static_cast<std::size_t>(size));
        Lanes* to = round.sent.data();
        for (const std::ptrdiff_t node : round.out) to = copy_node(to, records, node);
        require(PetscSFBcastBegin(round.forest, types_.of(size), round.sent.data(), round.received.data(), MPI_REPLACE),
                "PetscSFBcastBegin");
    }
    void receive(int k, std::span<const NodeRecords> records) override
    {
        Round& round = rounds_.at(static_cast<std::size_t>(k));
        require(PetscSFBcastEnd(round.forest, types_.of(size_of(records)), round.sent.data(), round.received.data(), MPI_REPLACE),
                "PetscSFBcastEnd");
        const Lanes* from = round.received.data();
        for (const std::ptrdiff_t node : round.in) from = copy_node(records, node, from);
    }

  private:
    struct Round {
        PetscSF forest = nullptr;
        std::vector<std::ptrdiff_t> out, in;
        std::vector<Lanes> sent, received;
    };
    RecordTypes& types_;
    std::vector<Round> rounds_;
};

class MpiRanks final : public Ranks {
  public:
    MpiRanks()
    {
        int provided = 0;
        require(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided), "MPI_Init_thread");
        // ordo handles signals itself, and takes no options from files of PETSc's users.
        require(PetscOptionsSetValue(nullptr, "-no_signal_handler", "true"), "PetscOptionsSetValue");
        require(PetscOptionsSetValue(nullptr, "-skip_petscrc", "true"), "PetscOptionsSetValue");
        require(PetscInitializeNoArguments(), "PetscInitialize");
        require(MPI_Comm_dup(MPI_COMM_WORLD, &comm_), "MPI_Comm_dup");
        MPI_Comm_size(comm_, &count_);
        MPI_Comm_rank(comm_, &index_);
        types_ = std::make_unique<RecordTypes>();
    }
    ~MpiRanks() override
    {
        types_.reset();
        MPI_Comm_free(&comm_);
        PetscFinalize();
        MPI_Finalize();
    }
    MpiRanks(const MpiRanks&) = delete;

    int count() const override { return count_; }
    int index() const override { return index_; }
    void largest(std::span<double> values) override
    {
        require(MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_MAX, comm_),
                "MPI_Allreduce");
    }
    void add(std::span<std::int64_t> values) override
    {
        require(MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_INT64_T, MPI_SUM, comm_),
                "MPI_Allreduce");
    }
    void share(Bytes& bytes, int from) override
    {
        auto size = static_cast<std::int64_t>(bytes.size());
        require(MPI_Bcast(&size, 1, MPI_INT64_T, from, comm_), "MPI_Bcast");
        bytes.resize(static_cast<std::size_t>(size));
        for_each_piece(bytes,
                       [&](unsigned char* data, int n) { require(MPI_Bcast(data, n, MPI_BYTE, from, comm_), "MPI_Bcast"); });
    }
    std::vector<Bytes> exchange(std::vector<Bytes> out) override
    {
        const auto all = static_cast<std::size_t>(count_);
        std::vector<std::int64_t> sizes(all), sizes_in(all);
        for (std::size_t r = 0; r < all; ++r) sizes[r] = static_cast<std::int64_t>(out.at(r).size());
        require(MPI_Alltoall(sizes.data(), 1, MPI_INT64_T, sizes_in.data(), 1, MPI_INT64_T, comm_), "MPI_Alltoall");
        std::vector<Bytes> in(all);
        std::vector<MPI_Request> requests;
        for (std::size_t r = 0; r < all; ++r) {
            if (static_cast<int>(r) == index_) {
                in[r] = std::move(out[r]);
                continue;
            }
            in[r].resize(static_cast<std::size_t>(sizes_in[r]));
            for_each_piece(in[r], [&](unsigned char* data, int n) {
                require(MPI_Irecv(data, n, MPI_BYTE, static_cast<int>(r), 0, comm_, &requests.emplace_back()), "MPI_Irecv");
            });
        }
        for (std::size_t r = 0; r < all; ++r) {
            if (static_cast<int>(r) == index_) continue;
            for_each_piece(out[r], [&](unsigned char* data, int n) {
                require(MPI_Isend(data, n, MPI_BYTE, static_cast<int>(r), 0, comm_, &requests.emplace_back()), "MPI_Isend");
            });
        }
        require(MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE), "MPI_Waitall");
        return in;
    }
    std::unique_ptr<Relay> relay(std::vector<RankRound> rounds) override
    {
        // Where each list begins among the records that a rank sends: told to who receives them.
        std::vector<Bytes> out(static_cast<std::size_t>(count_));
        for (std::size_t k = 0; k < rounds.size(); ++k) {
            std::size_t begin = 0;
            for (const RankMessage& m : rounds[k].out) {
                put(out[static_cast<std::size_t>(m.rank)], std::array{static_cast<int>(k), static_cast<int>(begin)});
                begin += m.nodes.size();
            }
        }
        std::vector<std::map<int, int>> first(rounds.size());
        const std::vector<Bytes> in = exchange(std::move(out));
        for (std::size_t r = 0; r < in.size(); ++r)
            for (const auto& [round, begin] : values_of<std::array<int, 2>>(in[r]))
                first[static_cast<std::size_t>(round)][static_cast<int>(r)] = begin;
        return std::make_unique<PetscRelay>(comm_, *types_, rounds, first);
    }
    void abort() override { MPI_Abort(comm_, 1); }

  private:
    /// f(data, count) for pieces of what one message can hold.
    template <class F>
    static void for_each_piece(Bytes& bytes, const F& f)
    {
        constexpr std::size_t most = std::size_t{1} << 30;
        for (std::size_t at = 0; at < bytes.size(); at += most)
            f(bytes.data() + at, static_cast<int>(std::min(most, bytes.size() - at)));
    }

    MPI_Comm comm_ = MPI_COMM_NULL;
    int count_ = 1, index_ = 0;
    std::unique_ptr<RecordTypes> types_;
};

}  // namespace

}  // namespace ordo

/// Starts MPI and PETSc. Deleting the ranks ends both.
extern "C" ordo::Ranks* ordo_start_ranks() { return new ordo::MpiRanks; }
