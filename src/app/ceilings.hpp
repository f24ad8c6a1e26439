// Measures the limits of the machine, with which `ordo bench` compares.
#pragma once

namespace ordo::app {

struct Ceilings {
    double flops = 0.0;  ///< of fused multiply-adds, 1/s, two each
    /// Of a triad a = b + s c, bytes/s: three streams. Reading a cache line before writing it, a fourth stream, is not counted,
    /// neither here nor in the traffic of `ordo bench`.
    double bandwidth = 0.0;
};

/// For all threads, in less than a second. The best of a few runs, because other processes only slow them down.
Ceilings measure_ceilings();

}  // namespace ordo::app
