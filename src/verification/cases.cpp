#include "verification/cases.hpp"

namespace ordo::verification {

const std::vector<Case>& cases()
{
    static const std::vector<Case> all{vibration_1d(),
                                       vibration_2d(),
                                       vibration_3d(),
                                       vibration_two_waves(),
                                       vibration_shifted(),
                                       vibration_free(),
                                       ring(),
                                       vortex(),
                                       shear_rotation(),
                                       bent_box(),
                                       rotation(),
                                       simple_shear(),
                                       bar_small_strain(),
                                       bar_large_strain(),
                                       bar_traction(),
                                       plate_impact(),
                                       couette(),
                                       poiseuille(),
                                       plastic_bar(),
                                       plastic_ring(),
                                       viscous_box(),
                                       thick_cylinder(),
                                       grains_on_plane(),
                                       two_disks(),
                                       wall_rebound(),
                                       bimaterial_bar(),
                                       bimaterial_ring(),
                                       bimaterial_sphere(),
                                       contact_layers(),
                                       contact_ring(),
                                       contact_bars(),
                                       reconstruction(),
                                       dispersion()};
    return all;
}

}  // namespace ordo::verification
