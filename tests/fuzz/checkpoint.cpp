// A checkpoint of a small run with edits: as it is then, cut short, or sealed again, so that what is behind the checksum is reached.
#include "io/checkpoint.hpp"
#include "fuzz.hpp"
#include "io/file.hpp"
#include "sim/simulation.hpp"

#include <fuzzer/FuzzedDataProvider.h>
#include <hdf5.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

namespace ordo::fuzz {
namespace {

constexpr std::size_t kHead = 512;  // bytes before HDF5 begins, docs/output.md

/// Where the numbers of all arrays of a file are.
std::vector<std::pair<std::size_t, std::size_t>> places_of_numbers(const std::string& path)
{
    std::vector<std::pair<std::size_t, std::size_t>> r;
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    auto add         = [](hid_t group, const char* name, const H5L_info_t*, void* to) -> herr_t {
        const hid_t set      = H5Dopen2(group, name, H5P_DEFAULT);
        const haddr_t offset = H5Dget_offset(set);
        if (offset != HADDR_UNDEF) static_cast<decltype(r)*>(to)->emplace_back(kHead + offset, H5Dget_storage_size(set));
        H5Dclose(set);
        return 0;
    };
    H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &r);
    H5Fclose(file);
    return r;
}

/// A run of a few steps and its checkpoint.
class Run {
  public:
    Run()
        : input_(read()),
          simulation_(io::build<2>(input_, 1000)),
          directory_(input_.output, io::Earlier::go_on),
          checkpoints_(input_, simulation_.model(), directory_)
    {
        State<2>& s = simulation_.state();
        for (int n = 0; n < 3; ++n) simulation_.step();
        io::Written written;
        written.step = s.n;
        checkpoints_.write(s, written);
        const std::string path = std::filesystem::path(input_.output.directory) / io::checkpoint_file(s.n);
        std::ifstream file(path, std::ios::binary);
        whole_.assign(std::istreambuf_iterator<char>(file), {});
        numbers_ = places_of_numbers(path);
        std::filesystem::remove_all(input_.output.directory);
        if (whole_.size() < kHead || numbers_.size() < 10) fail("no checkpoint to begin with");
    }

    void restart_from_edited(FuzzedDataProvider& edits)
    {
        std::string bytes    = whole_;
        const bool is_sealed = edits.ConsumeBool();
        if (!is_sealed && edits.ConsumeBool()) bytes.resize(edits.ConsumeIntegralInRange<std::size_t>(0, bytes.size()));
        while (edits.remaining_bytes() > 0) {
            std::pair<std::size_t, std::size_t> where{0, bytes.size()};
            if (is_sealed) where = numbers_[edits.ConsumeIntegralInRange<std::size_t>(0, numbers_.size() - 1)];
            const std::string part = edits.ConsumeBytesAsString(edits.ConsumeIntegralInRange<std::size_t>(1, 8));
            if (where.second < part.size()) continue;
            bytes.replace(where.first + edits.ConsumeIntegralInRange<std::size_t>(0, where.second - part.size()), part.size(),
                          part);
        }
        if (is_sealed) seal(bytes);
        file_.write(bytes);
        Simulation<2> restarted(io::build<2>(input_, 1000));
        if (!accepts([&] { checkpoints_.read(file_.path(), restarted); })) return;
        if (!is_sealed && bytes != whole_) fail("a damaged checkpoint is taken");
        try {
            restarted.step();
        } catch (const NumericalError&) {}
    }

  private:
    static io::CaseInput read()
    {
        std::string directory = std::filesystem::temp_directory_path() / "fuzz_checkpoint_XXXXXX";
        if (mkdtemp(directory.data()) == nullptr) fail("no directory");
        const MemoryFile file(fmt::format(
            "[grid]\ndim = 2\nsize = 1\nspacing = 0.125\n[method]\npreset = 'cpdi2'\n[time]\nend = 1\ndt = 1e-3\n"
            "[[material]]\nname = 'm'\ndensity = 1\nyoung = 1\npoisson = 0.3\n"
            "[[body]]\nname = 'b'\nmaterial = 'm'\nshape = 'box'\nlower = 0.25\nupper = 0.75\nvelocity = ['y', '-x']\n"
            "[output]\ndirectory = '{}'\n[checkpoint]\nsteps = 1\n",
            directory));
        return io::read_case(file.path(), {});
    }
    /// Gives the file the checksum of what is in it.
    static void seal(std::string& bytes)
    {
        const std::size_t end  = bytes.find("checksum ");
        const std::string text = bytes.substr(0, end);
        const auto sum         = io::checksum(text, io::checksum(std::string_view(bytes).substr(kHead)));
        bytes.replace(end, 25, fmt::format("checksum {:016x}", sum));
    }

    io::CaseInput input_;
    Simulation<2> simulation_;
    io::RunDirectory directory_;
    io::Checkpoints<2> checkpoints_;
    std::string whole_;
    std::vector<std::pair<std::size_t, std::size_t>> numbers_;  // where each array begins in `whole_`, and its bytes
    MemoryFile file_;
};

}  // namespace
}  // namespace ordo::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static ordo::fuzz::Run run;
    FuzzedDataProvider edits(data, size);
    run.restart_from_edited(edits);
    return 0;
}
