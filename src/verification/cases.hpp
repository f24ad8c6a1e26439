// The cases, one function each; see Case in study.hpp.
#pragma once

#include "verification/study.hpp"

namespace ordo::verification {

Case vibration_1d();
Case vibration_2d();
Case vibration_3d();
Case vibration_two_waves();
Case vibration_shifted();
Case vibration_free();
Case ring();
Case vortex();
Case shear_rotation();
Case bent_box();
Case rotation();
Case simple_shear();
Case bar_small_strain();
Case bar_large_strain();
Case bar_traction();
Case plate_impact();
Case couette();
Case poiseuille();
Case plastic_bar();
Case plastic_ring();
Case viscous_box();
Case thick_cylinder();
Case grains_on_plane();
Case two_disks();
Case wall_rebound();
Case bimaterial_bar();
Case bimaterial_ring();
Case bimaterial_sphere();
Case contact_bars();
Case contact_layers();
Case contact_ring();
Case reconstruction();
Case dispersion();

}  // namespace ordo::verification
