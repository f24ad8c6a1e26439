// Parsing and checking of options, shared by the commands.
#include "app/commands.hpp"
#include "base/error.hpp"
#include "io/file.hpp"

#include <fmt/format.h>

namespace ordo::app {

std::filesystem::path folder_of_program()
{
    std::error_code none;
    return std::filesystem::read_symlink("/proc/self/exe", none).parent_path();
}

std::pair<std::string, std::string> parse_setting(const std::string& text)
{
    const std::size_t at = text.find('=');
    if (at == std::string::npos || at == 0) throw InputError(fmt::format("--set {}: it must read key=value", text));
    return {text.substr(0, at), text.substr(at + 1)};
}

void require_writable_file(const std::string& option, const std::string& path)
{
    if (path.empty()) throw InputError(option + ": the name of the file is empty");
    try {
        io::AtomicFile probe(path);
    } catch (const OutputError& e) {
        throw InputError(option + " " + e.what());
    }
}

}  // namespace ordo::app
