// Ranks as processes of MPI. The only file that knows it. A library of its own, which the program loads when a launcher has started several
// processes: see app/ranks.hpp.
#include "base/ranks.hpp"

#include <mpi.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace ordo {

namespace {

/// MPI ends the program itself where it fails, unless it says so.
void require(int error, const char* what)
{
    if (error != MPI_SUCCESS) throw std::runtime_error(std::string(what) + " failed");
}

/// One message between two ranks for each list of records. MPI keeps the order of those with one tag, so a rank may begin the next scatter
/// while another is still in this one.
class MpiRelay final : public Relay {
  public:
    MpiRelay(MPI_Comm comm, std::vector<RankMessage> out, std::vector<RankMessage> in)
        : comm_(comm),
          out_(std::move(out)),
          in_(std::move(in)),
          sent_(out_.size()),
          received_(in_.size()),
          sending_(out_.size(), MPI_REQUEST_NULL),
          receiving_(in_.size(), MPI_REQUEST_NULL),
          come_(in_.size())
    {}

    void begin(std::span<const NodeRecords> records) override
    {
        for (std::size_t k = 0; k < in_.size(); ++k) {
            received_[k].resize(in_[k].nodes.size() * static_cast<std::size_t>(size_of(records)));
            require(
                MPI_Irecv(received_[k].data(), doubles(received_[k]), MPI_DOUBLE, in_[k].rank, in_[k].tag, comm_, &receiving_[k]),
                "MPI_Irecv");
        }
    }
    void send(std::size_t k, std::span<const NodeRecords> records) override
    {
        sent_[k].resize(out_[k].nodes.size() * static_cast<std::size_t>(size_of(records)));
        Lanes* to = sent_[k].data();
        for (const std::ptrdiff_t node : out_[k].nodes) to = copy_node(to, records, node);
        require(MPI_Isend(sent_[k].data(), doubles(sent_[k]), MPI_DOUBLE, out_[k].rank, out_[k].tag, comm_, &sending_[k]),
                "MPI_Isend");
    }
    std::vector<std::size_t> receive(bool is_idle, std::span<const NodeRecords> records) override
    {
        int count = 0, all_sent = 0;
        if (!is_idle)  // MPI moves long messages only while it is called
            require(MPI_Testall(static_cast<int>(sending_.size()), sending_.data(), &all_sent, MPI_STATUSES_IGNORE),
                    "MPI_Testall");
        const auto which = is_idle ? MPI_Waitsome : MPI_Testsome;
        require(which(static_cast<int>(receiving_.size()), receiving_.data(), &count, come_.data(), MPI_STATUSES_IGNORE),
                is_idle ? "MPI_Waitsome" : "MPI_Testsome");
        std::vector<std::size_t> r;
        for (int n = 0; n < count; ++n) {
            const auto k      = r.emplace_back(static_cast<std::size_t>(come_[static_cast<std::size_t>(n)]));
            const Lanes* from = received_[k].data();
            for (const std::ptrdiff_t node : in_[k].nodes) from = copy_node(records, node, from);
        }
        return r;
    }
    void end() override
    {
        require(MPI_Waitall(static_cast<int>(sending_.size()), sending_.data(), MPI_STATUSES_IGNORE), "MPI_Waitall");
    }

  private:
    static int doubles(const std::vector<Lanes>& records)
    {
        const std::size_t count = records.size() * (sizeof(Lanes) / sizeof(double));
        if (count > static_cast<std::size_t>(std::numeric_limits<int>::max()))
            throw std::runtime_error("two ranks share too many nodes for a message of MPI; take more ranks");
        return static_cast<int>(count);
    }

    MPI_Comm comm_;
    std::vector<RankMessage> out_, in_;
    std::vector<std::vector<Lanes>> sent_, received_;
    std::vector<MPI_Request> sending_, receiving_;
    std::vector<int> come_;
};

class MpiRanks final : public Ranks {
  public:
    MpiRanks()
    {
        int provided = 0;
        require(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided), "MPI_Init_thread");
        if (provided < MPI_THREAD_FUNNELED) throw std::runtime_error("this MPI cannot run beside threads");
        require(MPI_Comm_dup(MPI_COMM_WORLD, &comm_), "MPI_Comm_dup");
        MPI_Comm_size(comm_, &count_);
        MPI_Comm_rank(comm_, &index_);
    }
    ~MpiRanks() override
    {
        MPI_Barrier(comm_);  // the first has said why the run failed
        MPI_Comm_free(&comm_);
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
    std::unique_ptr<Relay> relay(std::vector<RankMessage> out, std::vector<RankMessage> in) override
    {
        return std::make_unique<MpiRelay>(comm_, std::move(out), std::move(in));
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
};

}  // namespace

}  // namespace ordo

/// Starts MPI. Deleting the ranks ends it.
extern "C" ordo::Ranks* ordo_start_ranks() { return new ordo::MpiRanks; }
