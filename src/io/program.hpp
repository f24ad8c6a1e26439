// What this program was built from and with.
#pragma once

#include <string>
#include <string_view>

namespace ordo::io {

/// The widest vector instructions that the compiler may use: "avx512", "avx2" or "any".
std::string_view instructions();

/// What the last digits of results depend on: commit, compiler and instructions, in one word.
std::string this_program();

/// For --version: version and commit, compiler, instructions, and which optional libraries are in it.
std::string version_text();

}  // namespace ordo::io
