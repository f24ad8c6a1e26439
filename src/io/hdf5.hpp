// Named arrays in an HDF5 file. Both classes throw InputError if ordo was built without HDF5.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ordo::io {

/// Whether ordo was built with HDF5, and what to do if not.
bool has_hdf5();
inline constexpr std::string_view kNoHdf5 =
    "needs HDF5, and ordo was built without it; install libhdf5-dev, then configure and build again";

/// An array of `rows` x `columns` numbers. T is double, int32_t, int64_t or uint64_t.
template <class T>
struct ArrayOf {
    T* data;
    std::size_t rows, columns;
};

/// A file under construction, whose first `user_block` bytes are left to the caller. Throws OutputError if writing fails.
class Hdf5Writer {
  public:
    Hdf5Writer(const std::filesystem::path& file, std::size_t user_block);
    ~Hdf5Writer();
    Hdf5Writer(const Hdf5Writer&) = delete;

    /// Begins an array of `rows` x `columns` numbers; `append` writes them, in any number of pieces.
    template <class T>
    void begin(const std::string& name, std::size_t rows, std::size_t columns);
    template <class T>
    void append(std::span<const T> numbers);
    template <class T>
    void add(const std::string& name, const std::vector<T>& list)
    {
        begin<T>(name, list.size(), 1);
        append(std::span<const T>(list));
    }
    void add_text(const std::string& name, const std::string& text);
    void close();

  private:
    void begin(const std::string& name, std::int64_t type, std::int64_t space);
    void end();
    [[noreturn]] void fail() const;

    std::filesystem::path path_;
    std::int64_t file_                    = -1;
    [[maybe_unused]] std::int64_t set_    = -1;           ///< the array that has begun
    [[maybe_unused]] std::size_t columns_ = 0, row_ = 0;  ///< its columns, and the next row
};

/// Throws InputError if the file is not HDF5 or lacks what is asked for; messages do not name the file.
class Hdf5Reader {
  public:
    explicit Hdf5Reader(const std::filesystem::path& file);
    ~Hdf5Reader();
    Hdf5Reader(const Hdf5Reader&) = delete;

    /// Fills an array of this shape.
    template <class T>
    void read(const std::string& name, ArrayOf<T> array) const
    {
        read_rows(name, array, 0, array.rows);
    }
    /// Fills an array with the rows from `first` on of one of `total` rows.
    template <class T>
    void read_rows(const std::string& name, ArrayOf<T> array, std::size_t first, std::size_t total) const;
    /// A list of any length.
    template <class T>
    std::vector<T> list(const std::string& name) const;
    std::string text(const std::string& name) const;

  private:
    [[maybe_unused]] std::int64_t file_ = -1;
};

}  // namespace ordo::io
