// What the machine can do, measured: the ceilings that `ordo bench` compares with.
#pragma once

namespace ordo::app {

struct Ceilings {
    double flops = 0.0;  ///< of fused multiply-adds, 1/s, two each
    /// Of a triad a = b + s c, bytes/s: three streams. That a cache line is read before it is written, a fourth, is not
    /// counted, here or in the traffic that is compared with it.
    double bandwidth = 0.0;
};

/// Over all threads, in less than a second: the best of a few runs, for neighbours only take away.
Ceilings measure_ceilings();

}  // namespace ordo::app
