// The TOML parser, compiled here so that it is instrumented: the library of Debian is not. Two things are as they are there
// (3.3.0). It has no assertions, one of which is wrong: "[=" is an error that the parser names. And what it declares to be
// unreachable, but characters such as U+FEDF reach, returns something: that they are not white space.
#undef NDEBUG
#define TOML_ASSERT(expression) static_assert(true)
#define TOML_IMPLEMENTATION
#include <toml++/impl/preprocessor.h>
#undef TOML_UNREACHABLE
#define TOML_UNREACHABLE static_assert(true)
#include <toml++/toml.h>
