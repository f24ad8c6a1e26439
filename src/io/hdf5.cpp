#include "io/hdf5.hpp"

#include "base/error.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#if defined(ORDO_HDF5)
#include <hdf5.h>
#include <hdf5_hl.h>
#endif

namespace ordo::io {

#if defined(ORDO_HDF5)

namespace {

template <class T>
hid_t type_of();
template <>
hid_t type_of<double>()
{
    return H5T_NATIVE_DOUBLE;
}
template <>
hid_t type_of<std::int32_t>()
{
    return H5T_NATIVE_INT32;
}
template <>
hid_t type_of<std::int64_t>()
{
    return H5T_NATIVE_INT64;
}
template <>
hid_t type_of<std::uint64_t>()
{
    return H5T_NATIVE_UINT64;
}

/// Keeps the library from printing errors, and from failing at the end of the program on a file that it could not close (1.10.8):
/// we close files one by one. No locks: some file systems refuse them, and we choose the names of part files.
hid_t start_library()
{
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_file_locking(access, false, true);
    return access;
}

/// Shape and type of a data set.
struct Found {
    std::array<hsize_t, 2> shape{};
    H5T_class_t kind{};
    std::size_t size = 0;  ///< bytes of an element
};
Found find(hid_t file, const std::string& name)
{
    Found found;
    int rank = 0;
    if (H5Lexists(file, name.c_str(), H5P_DEFAULT) <= 0 || H5LTget_dataset_ndims(file, name.c_str(), &rank) < 0 || rank > 2 ||
        H5LTget_dataset_info(file, name.c_str(), found.shape.data(), &found.kind, &found.size) < 0)
        throw InputError(fmt::format("it has no {}", name));
    return found;
}

}  // namespace

bool has_hdf5() { return true; }

Hdf5Writer::Hdf5Writer(const std::filesystem::path& file, std::size_t user_block) : path_(file)
{
    const hid_t access = start_library(), creation = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_userblock(creation, user_block);
    file_ = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, creation, access);
    H5Pclose(creation);
    H5Pclose(access);
    if (file_ < 0) fail();
}
Hdf5Writer::~Hdf5Writer()
{
    if (set_ >= 0) H5Dclose(set_);
    if (file_ >= 0) H5Fclose(file_);
}
template <class T>
void Hdf5Writer::begin(const std::string& name, std::size_t rows, std::size_t columns)
{
    const std::array<hsize_t, 2> shape{rows, columns};
    begin(name, type_of<T>(), H5Screate_simple(2, shape.data(), nullptr));
    row_     = 0;
    columns_ = columns;
}
template <class T>
void Hdf5Writer::append(std::span<const T> numbers)
{
    const std::array<hsize_t, 2> first{row_, 0}, shape{numbers.size() / columns_, columns_};
    const hid_t all = H5Dget_space(set_), piece = H5Screate_simple(2, shape.data(), nullptr);
    const bool is_done = H5Sselect_hyperslab(all, H5S_SELECT_SET, first.data(), nullptr, shape.data(), nullptr) >= 0 &&
                         H5Dwrite(set_, type_of<T>(), piece, all, H5P_DEFAULT, numbers.data()) >= 0;
    H5Sclose(piece);
    H5Sclose(all);
    if (!is_done) fail();
    row_ += shape[0];
}
void Hdf5Writer::add_text(const std::string& name, const std::string& text)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, text.size() + 1);
    begin(name, type, H5Screate(H5S_SCALAR));
    const bool is_done = H5Dwrite(set_, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()) >= 0;
    H5Tclose(type);
    if (!is_done) fail();
}
/// Without time stamps, so the same state gives the same file.
void Hdf5Writer::begin(const std::string& name, std::int64_t type, std::int64_t space)
{
    end();
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(creation, false);
    set_ = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    H5Pclose(creation);
    H5Sclose(space);
    if (set_ < 0) fail();
}
/// Closes the array that has begun.
void Hdf5Writer::end()
{
    if (set_ >= 0 && H5Dclose(std::exchange(set_, -1)) < 0) fail();
}
void Hdf5Writer::close()
{
    end();
    if (H5Fclose(std::exchange(file_, -1)) < 0) fail();
}
void Hdf5Writer::fail() const
{
    throw OutputError(fmt::format("{}: cannot be written: is the disk full, or the directory read-only?", path_.string()));
}

Hdf5Reader::Hdf5Reader(const std::filesystem::path& file)
{
    const hid_t access = start_library();
    file_              = H5Fopen(file.c_str(), H5F_ACC_RDONLY, access);
    H5Pclose(access);
    if (file_ < 0) throw InputError("it is no HDF5 file");
}
Hdf5Reader::~Hdf5Reader()
{
    if (file_ >= 0) H5Fclose(file_);
}
template <class T>
void Hdf5Reader::read_rows(const std::string& name, ArrayOf<T> array, std::size_t first, std::size_t total) const
{
    const Found found = find(file_, name);
    if (found.shape != std::array<hsize_t, 2>{total, array.columns})
        throw InputError(
            fmt::format("its {} are {} x {}, not {} x {}", name, found.shape[0], found.shape[1], total, array.columns));
    if (array.rows == 0) return;
    const std::array<hsize_t, 2> begin{first, 0}, shape{array.rows, array.columns};
    const hid_t set = H5Dopen2(file_, name.c_str(), H5P_DEFAULT), all = H5Dget_space(set),
                rows   = H5Screate_simple(2, shape.data(), nullptr);
    const bool is_done = H5Sselect_hyperslab(all, H5S_SELECT_SET, begin.data(), nullptr, shape.data(), nullptr) >= 0 &&
                         H5Dread(set, type_of<T>(), rows, all, H5P_DEFAULT, array.data) >= 0;
    H5Sclose(rows);
    H5Sclose(all);
    H5Dclose(set);
    if (!is_done) throw InputError(fmt::format("its {} cannot be read", name));
}
template <class T>
std::vector<T> Hdf5Reader::list(const std::string& name) const
{
    std::vector<T> r(find(file_, name).shape[0]);
    read(name, ArrayOf<T>{r.data(), r.size(), 1});
    return r;
}
std::string Hdf5Reader::text(const std::string& name) const
{
    const Found found = find(file_, name);
    std::string r(found.size, '\0');
    if (found.kind != H5T_STRING || H5LTread_dataset_string(file_, name.c_str(), r.data()) < 0)
        throw InputError(fmt::format("its {} cannot be read", name));
    r.resize(r.find_last_not_of('\0') + 1);
    return r;
}

#else

namespace {

[[noreturn]] void refuse() { throw InputError(std::string(kNoHdf5)); }

}  // namespace

bool has_hdf5() { return false; }
Hdf5Writer::Hdf5Writer(const std::filesystem::path&, std::size_t) { refuse(); }
Hdf5Writer::~Hdf5Writer() = default;
template <class T>
void Hdf5Writer::begin(const std::string&, std::size_t, std::size_t)
{
    refuse();
}
template <class T>
void Hdf5Writer::append(std::span<const T>)
{
    refuse();
}
void Hdf5Writer::add_text(const std::string&, const std::string&) { refuse(); }
void Hdf5Writer::close() { refuse(); }
void Hdf5Writer::fail() const { refuse(); }
Hdf5Reader::Hdf5Reader(const std::filesystem::path&) { refuse(); }
Hdf5Reader::~Hdf5Reader() = default;
template <class T>
void Hdf5Reader::read_rows(const std::string&, ArrayOf<T>, std::size_t, std::size_t) const
{
    refuse();
}
template <class T>
std::vector<T> Hdf5Reader::list(const std::string&) const
{
    refuse();
}
std::string Hdf5Reader::text(const std::string&) const { refuse(); }

#endif

#define ORDO_HDF5_TYPE(T)                                                                                \
    template void Hdf5Writer::begin<T>(const std::string&, std::size_t, std::size_t);                    \
    template void Hdf5Writer::append(std::span<const T>);                                                \
    template void Hdf5Reader::read_rows(const std::string&, ArrayOf<T>, std::size_t, std::size_t) const; \
    template std::vector<T> Hdf5Reader::list(const std::string&) const;
ORDO_HDF5_TYPE(double)
ORDO_HDF5_TYPE(std::int32_t)
ORDO_HDF5_TYPE(std::int64_t)
ORDO_HDF5_TYPE(std::uint64_t)
#undef ORDO_HDF5_TYPE

}  // namespace ordo::io
