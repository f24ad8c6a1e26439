// Numbers that look random and are the same in every run, for loads to try.
#pragma once

#include <cstdint>

namespace ordo {

/// A number between -1 and 1 that looks random (the finaliser of splitmix64: Steele, Lea & Flood 2014).
inline double scattered(std::uint64_t k)
{
    k += 0x9e3779b97f4a7c15u;
    k = (k ^ (k >> 30)) * 0xbf58476d1ce4e5b9u;
    k = (k ^ (k >> 27)) * 0x94d049bb133111ebu;
    k ^= k >> 31;
    return static_cast<double>(k >> 11) * 0x1p-52 - 1.0;
}

}  // namespace ordo
