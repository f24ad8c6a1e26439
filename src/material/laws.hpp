// The list of all laws. To add one: a file beside this one, its line here, its test. Only the tables made from the list include
// it (laws.cpp, kernels/stress.cpp, verification/any_law.cpp).
#pragma once

#include "material/cam_clay.hpp"
#include "material/drucker_prager.hpp"
#include "material/fluid.hpp"
#include "material/j2.hpp"
#include "material/jaumann_elastic.hpp"
#include "material/johnson_cook.hpp"
#include "material/linear_rate_1d.hpp"
#include "material/mohr_coulomb.hpp"
#include "material/mooney_rivlin.hpp"
#include "material/mu_i.hpp"
#include "material/neo_hookean.hpp"
#include "material/ogden.hpp"
#include "material/st_venant_kirchhoff.hpp"
#if defined(ORDO_OWN_LAW)
#include ORDO_OWN_LAW  // a header that defines struct OwnLaw, for programs and tests with their own law
#endif

namespace ordo {

template <Law... L>
struct LawList {};

using Laws = LawList<NeoHookean, StVenantKirchhoff, JaumannElastic, LinearRate1D, J2, DruckerPrager, Fluid, MohrCoulomb,
                     JohnsonCook, CamClay, MuI, MooneyRivlin, Ogden
#if defined(ORDO_OWN_LAW)
                     ,
                     OwnLaw
#endif
                     >;

}  // namespace ordo
